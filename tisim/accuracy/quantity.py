"""What a study compares: a quantity of a result, and what is known of its true value."""

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
    """A quantity of a result; its error is |measured - true| / size, with the root of the sum of squares.

    value : of a result, any shape; zero means that nothing has happened, as for a displacement.
    exact : the true value in closed form, of the scene of a result; None where there is none.
    random : whether it is the mean over random starts that counts. Then ``exact`` is of that mean.
    returns : whether it may come back to zero, as the displacement on a closed path does. Then size is the
        largest |value| on the way, in steps short enough to see it; else it is |true|, at the end.
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
        """What its errors are relative to, for people."""
        return "its largest on the way" if self.returns else "its true value"


@dataclass(frozen=True)
class QuantityEstimate:
    """An estimate is a value, and how far it may be off: half its 95 % interval, or a bound; 0 if exact."""

    value: np.ndarray
    uncertainty: float = 0.0

    def error(self, truth: QuantityEstimate, size: float) -> tuple[float, float]:
        """Return the distance from the truth relative to ``size``, and how far that may be off."""
        off = float(np.linalg.norm(self.value - truth.value))
        return off / size, float(np.hypot(self.uncertainty, truth.uncertainty)) / size


def estimate(quantity: Quantity, results: Sequence[Result]) -> QuantityEstimate:
    """Return the estimate from one result, or from the mean over those of random starts."""
    values = np.array([np.ravel(np.asarray(quantity.value(result))) for result in results])
    if not quantity.random:
        return QuantityEstimate(values[0])
    return mean(values)


def mean(values: np.ndarray) -> QuantityEstimate:
    """Return the mean over the first axis, with its interval by Student's t.

    values : of shape (n, components), n > 1.
    """
    return QuantityEstimate(values.mean(axis=0), float(np.linalg.norm(half_width(values))))


def displacement(result: Result) -> np.ndarray:
    """Return the displacement of every particle since the start, by their ids, m, shape (n, 3)."""
    order = np.argsort(result.state["id"])
    return result.state["position"][order] - result.start["position"]


def velocity(result: Result) -> np.ndarray:
    """Return the velocity of every particle at the end, in the order of their ids, m/s, shape (n, 3)."""
    return result.state["velocity"][np.argsort(result.state["id"])]


def velocity_in_shear(result: Result) -> np.ndarray:
    """Return the ``velocity`` relative to the flow that the images of a sheared box take part in, m/s, shape
    (n, 3)."""
    place = result.state["position"][np.argsort(result.state["id"])]
    return velocity(result) - result.scene.domain.streaming_velocity(place)


def kinetic_energy(result: Result) -> float:
    """Return the kinetic energy of all particles at the end, without rotation, J."""
    return 0.5 * float((result.state["mass"] * (result.state["velocity"] ** 2).sum(axis=1)).sum())


def mean_square(result: Result) -> float:
    """Return the mean square displacement of the particles since the start, m^2."""
    return float((displacement(result) ** 2).sum(axis=1).mean())


def usual(scene: Scene) -> tuple[Quantity, ...]:
    """Return what is compared unless something else is asked for: where particles have moved to.

    Impacts and operators may remove particles, and after some impacts no path can be followed: there it is
    the mean kinetic energy over random starts. InputError where there is nothing random. Of paths that are
    random themselves it is the mean square displacement.
    """
    if scene.stepper.random:
        must(not any(scene.domain.joined()), "quantities", "given for random paths in a box", Words("none"))
        return (Quantity("mean square displacement", mean_square, random=True),)
    if not any(isinstance(effect, Operator | PairEvent) for effect in scene.effects):
        # Across joined faces a place jumps, and so does a velocity where these move past each other.
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
