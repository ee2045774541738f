"""The sweeps of a study: all ways to run a scene that trade accuracy for time, as declared by its parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tisim import steppers
from tisim.accuracy.scene_changes import (
    SOFTER,
    exchanged,
    non_default_settings,
    parts,
    softened,
    softening,
    text_of_setting,
    turned,
    within,
)
from tisim.components import serialization
from tisim.components.accuracy_parameter import AccuracyParameter, three_digits
from tisim.components.component import Component
from tisim.effects.base import Effect
from tisim.errors import InputError
from tisim.scene.scene import Scene
from tisim.steppers.base import Stepper

USUAL_NUMBERS = ("f64", "strict")
"""The precision and the arithmetic with which methods are compared."""


@dataclass(frozen=True)
class Setting:
    """One way to run a scene: the changed scene, its description, precision, arithmetic and number of
    starts."""

    scene: Scene
    description: str
    precision: str = "f64"
    starts: int = 1
    arithmetic: str = "strict"

    @property
    def numbers(self) -> tuple[str, str]:
        """The precision and the arithmetic."""
        return self.precision, self.arithmetic


@dataclass(frozen=True)
class SettingSweep:
    """A sweep over the settings of one method, the cheapest first; one line in the picture.

    weights : estimated run times, relative to each other.
    accuracy_parameter : the varied parameter, of the part at ``path``; None for a list of laws or of numbers
        of starts.
    exact : method and setting with the exact law, for approximate laws; None for all other sweeps.
    """

    name: str
    settings: tuple[Setting, ...]
    weights: tuple[float, ...]
    base: Scene
    path: str = ""
    accuracy_parameter: AccuracyParameter | None = None
    exact: tuple[str, str] | None = None

    @property
    def converges(self) -> bool:
        """Whether the error of the stepper vanishes along the sweep."""
        parameter = self.accuracy_parameter
        return parameter is not None and parameter.converges and self.path.startswith("stepper")

    def at(self, decades: float) -> Scene:
        """Return the scene with the accuracy parameter set to an error larger than in ``base`` by
        ``decades``."""
        assert self.accuracy_parameter is not None
        return turned(self.base, self.path, self.accuracy_parameter, decades)


def methods(
    scene: Scene,
    dt: float,
    extent: float,
    levels: Sequence[float],
    numbers: Sequence[tuple[str, str]],
    starts: int,
) -> list[SettingSweep]:
    """Return all methods for a scene with steps of about dt (s) and particles up to ``extent`` (m) apart.

    levels : decades of error, relative to the scene, to which accuracy parameters are set.
    numbers : precisions and arithmetics; all but ("f64", "strict") are tried with the first method only,
        which is the scene's own stepper.
    starts : number of random starts of each run.
    """
    sweeps = []
    own = sorted(parts(scene), key=lambda item: not item[0].startswith("stepper"))
    for path, part in own:
        sweeps += [
            _turning(scene, path, accuracy_parameter, levels, starts)
            for accuracy_parameter in part.accuracy_parameters
        ]
    if sweeps:
        first = sweeps[0]
        for kind in numbers:
            if kind != USUAL_NUMBERS and first.accuracy_parameter:
                sweeps.append(_turning(scene, first.path, first.accuracy_parameter, levels, starts, kind))
    for effect in scene.effects:
        laws = effect.approximations(extent)
        if laws:
            # All other settings are as accurate as possible, so that only the error of the law shows.
            accurate = sweeps[0].settings[-1] if sweeps else Setting(scene, "")
            exact = (sweeps[0].name, accurate.description) if sweeps else None
            sweeps.append(_laws(accurate.scene, effect, laws, starts, exact))
    if properties := softening(scene):
        sweeps.append(_softer(scene, properties, starts))
    for stepper in _steppers(scene, dt):
        other = exchanged(scene, "stepper", stepper)
        for path, part in within("stepper", stepper):
            sweeps += [_turning(other, path, k, levels, starts) for k in _tried(part)]
    return [method for method in sweeps if method.settings]


def _tried(part: Component) -> list[AccuracyParameter]:
    """Return the accuracy parameters of a part of another stepper that are varied: the convergent ones, or
    all if none of them converges."""
    convergent = [one for one in part.accuracy_parameters if one.converges]
    return convergent or list(part.accuracy_parameters)


def ensembles(scene: Scene, sizes: Sequence[int]) -> SettingSweep:
    """Return the sweep of the unchanged scene over increasing numbers of random starts."""
    settings = tuple(Setting(scene, f"{n} starts", starts=n) for n in sizes)
    return SettingSweep("random starts", settings, tuple(n / sizes[0] for n in sizes), scene)


def rivals(stepper: Stepper, effects: Sequence[Effect], dt: float) -> tuple[Stepper, ...]:
    """Return the steppers to compare with a stepper in a scene of these effects, with steps of about dt
    (s)."""
    own = stepper.rivals(effects, dt)
    if own is not None:
        return own
    # Sorted by name, so that the order does not depend on imports.
    kinds = [kind for _, kind in sorted(Stepper.known().items())]
    return tuple(other for kind in kinds for other in kind.alternatives(effects, dt))


def _steppers(scene: Scene, dt: float) -> list[Stepper]:
    """Return the steppers, other than its own, that are suitable for the scene."""
    serialization.load(steppers)
    kinds = {_kind(scene.stepper)}
    suitable = []
    for stepper in rivals(scene.stepper, scene.effects, dt):
        if type(stepper.control) is type(scene.stepper.control):
            stepper = stepper.model_copy(update={"control": scene.stepper.control})
        if _kind(stepper) not in kinds and _suits(stepper, scene):
            kinds.add(_kind(stepper))
            suitable.append(stepper)
    return suitable


def _suits(stepper: Stepper, scene: Scene) -> bool:
    try:
        stepper.check(scene)
    except InputError:
        return False
    return True


def _kind(stepper: Stepper) -> tuple[Any, ...]:
    """Return a key that distinguishes methods but ignores the settings of the step control."""
    return type(stepper), type(stepper.control), stepper.structure(), tuple(stepper.values())


def _turning(
    scene: Scene,
    path: str,
    accuracy_parameter: AccuracyParameter,
    levels: Sequence[float],
    starts: int,
    numbers: tuple[str, str] = USUAL_NUMBERS,
) -> SettingSweep:
    settings: list[Setting] = []
    weights: list[float] = []
    for decades in levels:
        try:
            changed = turned(scene, path, accuracy_parameter, decades)
        except InputError:
            continue  # The part cannot have this setting, for example a shortest step above the longest.
        if not _stands(changed):
            continue  # The setting does not suit the domain, for example waves that do not fit into it.
        part = dict(parts(changed))[path]
        description = ", ".join(f"{name}={_short(getattr(part, name))}" for name in accuracy_parameter.orders)
        if any(description == one.description for one in settings):
            continue  # A whole number may be rounded to the same value at two levels.
        settings.append(Setting(changed, description, numbers[0], starts, numbers[1]))
        weights.append(10.0 ** (-decades / scene.stepper.order) if path.startswith("stepper") else 1.0)
    name = f"{_title(scene, path)}: {', '.join(accuracy_parameter.orders)}"
    name += "".join(f", {kind}" for kind, plain in zip(numbers, USUAL_NUMBERS, strict=True) if kind != plain)
    return SettingSweep(name, tuple(settings), tuple(weights), scene, path, accuracy_parameter)


def _short(value: float) -> str:
    """Return a whole number in full and another one to three digits."""
    return str(value) if isinstance(value, int) else f"{value:.3g}"


def _laws(
    scene: Scene, own: Effect, laws: Sequence[Effect], starts: int, exact: tuple[str, str] | None
) -> SettingSweep:
    settings = []
    for law in laws:
        named = law.model_copy(update={"name": own.name})
        changed = exchanged(scene, f"effects.{own.label}", named)
        if not _stands(changed):
            continue  # The materials lack properties of this law, or it does not suit the domain.
        differ = [
            f"{name}={text_of_setting(getattr(law, name))}"
            for name in type(law).model_fields
            if getattr(own, name, None) != getattr(law, name)
        ]
        settings.append(Setting(changed, ", ".join(differ) or type(law).__name__, starts=starts))
    name = type(laws[0]).__name__
    return SettingSweep(name, tuple(settings), (1.0,) * len(settings), scene, exact=exact)


def _stands(scene: Scene) -> bool:
    """Return whether a scene with an exchanged part can be run."""
    try:
        Scene(**dict(scene))
    except InputError:
        return False
    return True


def _softer(scene: Scene, properties: Mapping[str, float], starts: int) -> SettingSweep:
    settings = []
    for factor in SOFTER:
        softer = softened(scene, properties, factor)
        control = softer.stepper.control
        steps = (f"{name}={value:.3g}" for name, value in non_default_settings(control).items())
        settings.append(Setting(softer, f"by {factor:g}, {', '.join(steps)}", starts=starts))
    weights = tuple(factor ** -min(properties.values()) for factor in SOFTER)
    return SettingSweep(f"softer, in longer steps: {', '.join(properties)}", tuple(settings), weights, scene)


def with_control(name: str, stepper: Stepper) -> str:
    """Return a name of a stepper followed by the kind of its step control, if that trades accuracy for
    time."""
    control = stepper.control
    return f"{name}, {type(control).__name__}" if control.accuracy_parameters else name


def _title(scene: Scene, path: str) -> str:
    if not path.startswith("stepper"):
        return path.removeprefix("effects.")
    # Required settings of every such stepper, such as the fluid, do not distinguish methods.
    stepper, fields = scene.stepper, type(scene.stepper).model_fields
    chosen = [
        f"{k}={three_digits(v) if isinstance(v, float) else v!r}"
        for k, v in non_default_settings(stepper).items()
        if k != "control" and not fields[k].is_required()
    ]
    return with_control(type(stepper).__name__ + (f"({', '.join(chosen)})" if chosen else ""), stepper)
