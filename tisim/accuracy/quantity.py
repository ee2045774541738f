"""Quantities that a study compares, and their true values: in closed form, or from a much more accurate run.

The reference run uses the stepper of highest order; among steppers of equal order, the scene's own. It is set
to an error two decades below the finest setting of the sweep, together with all other convergent accuracy
parameters. Its error is estimated as its distance from the same stepper at a setting one decade coarser,
which overestimates the error by a factor of about nine. A stepper of another kind, at the same two settings,
must agree with it within the uncertainties of both; if it does not, the distance between them is taken as the
error. A second stepper alone is not a sufficient check: for a rotation, the trapezoidal rule and Boris'
stepper make the same error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tisim.accuracy.scene_changes import finest
from tisim.accuracy.sweep import USUAL_NUMBERS, SettingSweep, with_control
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.effects.base import PairEvent
from tisim.engine.result import Result
from tisim.errors import RunError, Words, must
from tisim.numerics.statistics import half_width
from tisim.operators.base import Operator
from tisim.scene.scene import Scene

Value = Callable[[Result], "np.ndarray | float"]
LARGEST_REFERENCE_ERROR = 0.1
"""A reference with a larger error than this, relative to the size of the motion, cannot tell settings
apart."""
ADVICE = (
    "paths are chaotic, or hard to resolve. Use a shorter duration, or a quantity averaged over many random "
    "starts (docs/accuracy.md)"
)
"""Advice that is given if the reference cannot tell settings apart."""
TIGHTER = 2.0
"""Decades of error between the finest setting of the sweep and the reference."""


@dataclass(frozen=True)
class Quantity:
    """A quantity of a result; its error is |measured - true| / size, with the Euclidean norm.

    value : function of a result, of any shape; zero means no change, as for a displacement.
    exact : the true value in closed form, as a function of a result; None if there is none.
    random : whether the quantity is a mean over random starts. Then ``exact`` is this mean.
    returns : whether the value may return to zero, such as the displacement on a closed path. Then ``size``
        is the largest |value| during the run, observed in short steps; otherwise it is |true| at the end.
    """

    name: str
    value: Value
    exact: Value | None = None
    random: bool = False
    returns: bool = False

    def size(self, result: Result) -> float:
        """Return the |value| of a result, in its own unit."""
        return float(np.linalg.norm(np.ravel(np.asarray(self.value(result)))))

    @property
    def relative_to(self) -> str:
        """Text that describes the size to which errors are relative."""
        return "its largest value during the run" if self.returns else "its true value"


@dataclass(frozen=True)
class QuantityEstimate:
    """An estimate of a value with its uncertainty: half its 95 % confidence interval, or a bound; 0 if
    exact."""

    value: np.ndarray
    uncertainty: float = 0.0

    def error(self, truth: QuantityEstimate, size: float) -> tuple[float, float]:
        """Return the distance from the truth relative to ``size``, and the uncertainty of this distance."""
        off = float(np.linalg.norm(self.value - truth.value))
        return off / size, float(np.hypot(self.uncertainty, truth.uncertainty)) / size


def estimate(quantity: Quantity, results: Sequence[Result]) -> QuantityEstimate:
    """Return the estimate from one result, or from the mean over random starts."""
    values = np.array([np.ravel(np.asarray(quantity.value(result))) for result in results])
    if not quantity.random:
        return QuantityEstimate(values[0])
    return mean(values)


def mean(values: np.ndarray) -> QuantityEstimate:
    """Return the mean over the first axis, with its confidence interval from Student's t.

    values : array of shape (n, components), n > 1.
    """
    return QuantityEstimate(values.mean(axis=0), float(np.linalg.norm(half_width(values))))


def displacement(result: Result) -> np.ndarray:
    """Return the displacement of every particle since the start, ordered by id, m, shape (n, 3)."""
    order = np.argsort(result.state["id"])
    return result.state["position"][order] - result.start["position"]


def velocity(result: Result) -> np.ndarray:
    """Return the velocity of every particle at the end, ordered by id, m/s, shape (n, 3)."""
    return result.state["velocity"][np.argsort(result.state["id"])]


def velocity_in_shear(result: Result) -> np.ndarray:
    """Return the ``velocity`` relative to the streaming velocity of a sheared box, m/s, shape (n, 3)."""
    place = result.state["position"][np.argsort(result.state["id"])]
    return velocity(result) - result.scene.domain.streaming_velocity(place)


def kinetic_energy(result: Result) -> float:
    """Return the kinetic energy of all particles at the end, without rotation, J."""
    return 0.5 * float((result.state["mass"] * (result.state["velocity"] ** 2).sum(axis=1)).sum())


def mean_square(result: Result) -> float:
    """Return the mean square displacement of the particles since the start, m^2."""
    return float((displacement(result) ** 2).sum(axis=1).mean())


def packed_fraction(result: Result) -> float:
    """Return the packing fraction of a packing in a periodic box."""
    return packing_fraction(PackedBodies.from_result(result))


def usual(scene: Scene) -> tuple[Quantity, ...]:
    """Return the default quantity of a scene: the displacement of its particles, or a packing fraction.

    If the stepper is random, the quantity is the mean square displacement. In a periodic box it is the
    velocity, in a sheared box the velocity relative to the flow, because positions jump at the periodic
    faces. If impacts or operators are present, they may remove particles or make trajectories unpredictable;
    then it is the mean kinetic energy over random starts. InputError for random paths in a periodic box, and
    if impacts or operators start from a state without randomness.
    """
    if scene.stepper.packs:
        rule = "given, as walls bound the packing"
        must(all(scene.domain.joined()), "quantities", rule, Words("none"))
        one, other = (scene.start(scene.seed + k) for k in (0, 1))
        differ = any(not np.array_equal(one[name], other[name]) for name in one)
        return (Quantity("packing fraction", packed_fraction, random=differ),)
    if scene.stepper.random:
        must(
            not any(scene.domain.joined()),
            "quantities",
            "given, as the mean square displacement is not defined in a periodic box",
            Words("none"),
        )
        return (Quantity("mean square displacement", mean_square, random=True),)
    if not any(isinstance(effect, Operator | PairEvent) for effect in scene.effects):
        # Positions jump at periodic faces, and so do velocities if the faces move relative to each other.
        name, value = "displacement", displacement
        if scene.domain.shears():
            name, value = "velocity relative to the flow", velocity_in_shear
        elif any(scene.domain.joined()):
            name, value = "velocity", velocity
        return (Quantity(name, value, returns=True),)
    starts = [scene.start(scene.seed + k) for k in (0, 1)]
    differ = any(not np.array_equal(starts[0][name], starts[1][name]) for name in ("position", "velocity"))
    rule = "given, as impacts or operators act and the start is not random"
    must(differ, "quantities", rule, Words("none"))
    return (Quantity("mean kinetic energy", kinetic_energy, random=True),)


@dataclass(frozen=True)
class Truth:
    """The best estimate of the true value of a quantity.

    source : origin of the value, as text.
    size : the value to which errors are relative, in the unit of the quantity.
    """

    estimate: QuantityEstimate
    source: str
    size: float

    @property
    def error(self) -> float:
        """An upper bound of the relative error of the true value."""
        return self.estimate.uncertainty / self.size


@dataclass(frozen=True)
class ReferenceRun:
    """A run that contributes to a truth: a method set to an error larger by a number of decades."""

    method: SettingSweep
    decades: float

    @property
    def scene(self) -> Scene:
        """The scene that is run."""
        return finest(self.method.at(self.decades), -TIGHTER)

    @property
    def name(self) -> str:
        """The stepper and its step control, as text."""
        stepper = self.method.base.stepper
        return with_control(type(stepper).__name__, stepper)


def reference_runs(methods: Sequence[SettingSweep], level: float) -> list[ReferenceRun]:
    """Return the reference, the same method one decade coarser, and another stepper at both settings if there
    is one.

    level : decades of error at the finest settings of the methods. InputError if no method converges.
    """
    able = [m for m in methods if m.converges and all(s.numbers == USUAL_NUMBERS for s in m.settings)]
    must(
        bool(able),
        "stepper",
        "one whose error can be made as small as wanted, for the reference",
        Words("none"),
    )
    best = max(able, key=lambda method: method.base.stepper.order)
    others = [
        m for m in able if type(m.base.stepper) is not type(best.base.stepper) and m.base.stepper.order > 1
    ]
    tight = level - TIGHTER
    return [ReferenceRun(m, level) for m in (best, *others[:1]) for level in (tight, tight + 1)]


def truth_in_closed_form(quantity: Quantity, result: Result, largest: float = 0.0) -> Truth:
    """Return the truth in closed form for the scene of a result. largest : largest |value| during the run."""
    assert quantity.exact is not None
    return _truth(
        quantity, QuantityEstimate(np.ravel(np.asarray(quantity.exact(result)))), "its closed form", largest
    )


def truth_by_reference(
    quantity: Quantity,
    runs: Sequence[Sequence[Result]],
    references: Sequence[ReferenceRun],
    largest: float = 0.0,
) -> Truth:
    """Return the truth from the runs of a reference and its checks. largest : largest |value| during the
    run."""
    best, short, *other = (estimate(quantity, results) for results in runs)
    off = _distance(best, short)
    if other:
        apart = _distance(best, other[0])
        off = off if apart <= off + _distance(*other) else apart
    source = f"{references[0].name} at {references[0].decades:+g} decades of error, checked by itself"
    source += "".join(f" and by {other_run.name}" for other_run in references[2:3])
    # The sum of the error of the stepper and the uncertainty from the finite number of starts.
    return _truth(quantity, QuantityEstimate(best.value, off + best.uncertainty), source, largest)


def tells_apart(quantity: Quantity, truth: Truth) -> bool:
    """Return whether errors relative to the truth of a quantity can tell settings apart.

    They cannot if the error of the reference is a large fraction of the size of the motion. The uncertainty
    from a finite number of random starts does not count as an error of the reference, because the number of
    starts is itself a setting.
    """
    return quantity.random or truth.error <= LARGEST_REFERENCE_ERROR


def require_known(quantity: Quantity, truth: Truth) -> None:
    """Raise RunError if errors relative to the truth of a quantity cannot tell settings apart."""
    if not tells_apart(quantity, truth):
        rule = f"known by the reference to {LARGEST_REFERENCE_ERROR:g} of the motion"
        raise RunError(
            f"{quantity.name} must be {rule}; received {truth.error:.1g}: {ADVICE}. "
            "To go on: --anyway, or a Study with require_reference=False"
        )


def _truth(quantity: Quantity, estimated: QuantityEstimate, source: str, largest: float) -> Truth:
    """Return a truth; InputError if its size is zero, so that no relative error exists."""
    size = float(np.linalg.norm(estimated.value))
    if quantity.returns:
        size = max(size, largest)
    when = "at some time" if quantity.returns else "at the end"
    must(size > 0, quantity.name, f"other than zero {when}", size)
    return Truth(estimated, source, size)


def _distance(one: QuantityEstimate, other: QuantityEstimate) -> float:
    return float(np.linalg.norm(one.value - other.value))
