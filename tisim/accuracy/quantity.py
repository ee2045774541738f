"""Quantities that a study compares, and estimates of their true values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tisim.effects.base import PairEvent
from tisim.engine.result import Result
from tisim.errors import Words, must
from tisim.numerics.statistics import half_width
from tisim.operators.base import Operator
from tisim.scene.scene import Scene

Value = Callable[[Result], "np.ndarray | float"]


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


def usual(scene: Scene) -> tuple[Quantity, ...]:
    """Return the default quantity of a scene: the displacement of its particles.

    If the stepper is random, the quantity is the mean square displacement. In a periodic box it is the
    velocity, in a sheared box the velocity relative to the flow, because positions jump at the periodic
    faces. If impacts or operators are present, they may remove particles or make trajectories unpredictable;
    then it is the mean kinetic energy over random starts. InputError for random paths in a periodic box, and
    if impacts or operators start from a state without randomness.
    """
    if scene.stepper.random:
        must(not any(scene.domain.joined()), "quantities", "given for random paths in a box", Words("none"))
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
    rule = "given for a scene with impacts or operators whose start is not random"
    must(differ, "quantities", rule, Words("none"))
    return (Quantity("mean kinetic energy", kinetic_energy, random=True),)
