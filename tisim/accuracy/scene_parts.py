"""The parts of a scene by their dotted paths, and copies of a scene with one part exchanged."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import Component, unit_of
from tisim.scene.scene import Scene


def parts(scene: Scene) -> Iterator[tuple[str, Component]]:
    """Yield every part of a scene with its dotted path, as in a TOML file."""
    for effect in scene.effects:
        yield from within(f"effects.{effect.label}", effect)
    for name in ("particles", "domain", "stepper"):
        yield from within(name, getattr(scene, name))


def within(path: str, part: Component) -> Iterator[tuple[str, Component]]:
    """Yield a part at a dotted path, and every part within it with its own path."""
    yield path, part
    for name in type(part).model_fields:
        if isinstance(inner := getattr(part, name), Component):
            yield from within(f"{path}.{name}", inner)


def exchanged(scene: Scene, path: str, part: Component) -> Scene:
    """Return a copy of a scene with another part at this dotted path. Settings of other effects that must
    equal those of the part are changed too."""
    first, *rest = path.split(".")
    if first == "effects":
        own = next(effect for effect in scene.effects if effect.label == rest[0])
        new = _put(own, rest[1:], part)
        effects = tuple(new if effect is own else effect.beside(new) for effect in scene.effects)
        return scene.model_copy(update={"effects": effects})
    return scene.model_copy(update={first: _put(getattr(scene, first), rest, part)})


def _put(part: Any, path: Sequence[str], new: Component) -> Any:
    if not path:
        return new
    return part.model_copy(update={path[0]: _put(getattr(part, path[0]), path[1:], new)})


def turned(scene: Scene, path: str, accuracy_parameter: AccuracyParameter, decades: float) -> Scene:
    """Return a copy with an accuracy parameter of the part at ``path`` changed; InputError if the value is
    invalid."""
    return exchanged(scene, path, accuracy_parameter.turned(dict(parts(scene))[path], decades))


def in_steps(scene: Scene, length: Callable[[float], float]) -> Scene:
    """Return a copy with other step lengths: all settings of the step control with the unit s."""
    control = scene.stepper.control
    lengths = [name for name, info in type(control).model_fields.items() if unit_of(info) == "s"]
    changed = {name: length(getattr(control, name)) for name in lengths}
    return exchanged(scene, "stepper.control", control.model_copy(update=changed))


def in_steps_of_at_most(scene: Scene, longest: float) -> Scene:
    """Return a copy whose steps are at most this long (s)."""
    return in_steps(scene, lambda length: min(length, longest))


def finest(scene: Scene, decades: float) -> Scene:
    """Return a copy with every accuracy parameter of its effects refined, so that their errors do not hide
    the error of the stepper."""
    for path, part in list(parts(scene)):
        for accuracy_parameter in part.accuracy_parameters:
            if accuracy_parameter.converges and not path.startswith("stepper"):
                scene = turned(scene, path, accuracy_parameter, decades)
    return scene
