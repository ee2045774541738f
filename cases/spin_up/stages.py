"""The stages of a spin-up: a pile settles, and its spin is then increased in steps, each held for a while."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.cases.coalescence import published
from tisim.cases.common.rubble_pile import Asteroid, Conserved, body, clusters_of, part
from tisim.cases.common.runs import overlap, sound
from tisim.cases.spin_up.scene import scene
from tisim.engine.batches import Progress, loaded
from tisim.engine.particle_state import ParticleState
from tisim.scene.initial_state import Arrays

DEFORMATION = {0.0: 600e-6, 119.0: 600e-6, 1190.0: 700e-6}
"""L21's angular velocity (rad/s) of the first significant deformation by magnetisation (A/m); section
4.3.2."""
DISRUPTION = {0.0: 700e-6, 119.0: 700e-6, 1190.0: 800e-6}
"""L21's angular velocity (rad/s) at which grains were shed, by magnetisation (A/m); section 4.3.2."""
DEFORMED_SHAPES = {
    0.0: {"width over height": 1.39},
    119.0: {"width over height": 1.28},
    1190.0: {"longest over shortest axis": 1.85, "intermediate over shortest axis": 1.21},
}
"""L21's shapes after the deformation by magnetisation (A/m), for grains of 100 cm; section 4.3.2. For grains
of 50 cm they are 1.28, 1.27, 1.46 and 1.17."""
POROSITY = 0.83
"""L21's porosity at 1190 A/m, for grains of 100 cm; section 4.3.2. For grains of 50 cm it is 0.836."""
RATES = tuple(1e-4 * k for k in range(1, 10))
"""Successive angular velocities of the pile, rad/s; section 4.3.1 of L21."""
QUICK = 4e-4
"""Largest angular velocity that is held for the shorter time, rad/s."""
HOLDS = (500.0, 3000.0)
"""The two hold times, s; L21 section 4.3.1."""
LOST = 0.05
"""Least fraction of all grains that a disrupted pile has lost. L21 gives no number."""
DEFORMED = 1.1
"""Least growth factor of the width over height of a deformed pile. L21 gives no number."""
SEEDS = 10
"""Number of random starts of each magnetisation."""


@dataclass(frozen=True)
class SpinStep:
    """A step of a spin-up: the imposed angular velocity (rad/s), and the state at its end.

    The angular velocity is 0 for the state before the first step.
    """

    rate: float
    state: Arrays

    @cached_property
    def asteroid(self) -> Asteroid:
        """Return the pile, or its largest fragment."""
        return Asteroid.of(self.state)

    @property
    def held(self) -> float:
        """Return the fraction of the mass of all grains that is in the pile."""
        inside = body(clusters_of(self.state), self.state["mass"])
        return float(self.state["mass"][inside].sum() / self.state["mass"].sum())

    @property
    def angular_momentum(self) -> float:
        """Return the angular momentum of all grains, kg m^2/s."""
        return float(np.linalg.norm(Conserved.of(self.state).angular))


@dataclass(frozen=True)
class SpinUp:
    """A spin-up of one pile, step by step.

    magnetisation : of the grains in L21's pile, A/m. seed : of the start. steps : with the state before the
    first.
    """

    magnetisation: float
    seed: int
    steps: Sequence[SpinStep]

    @property
    def broken(self) -> np.ndarray:
        """Return after which steps the pile has lost LOST or more of all grains since its largest mass; shape
        (steps,)."""
        held = np.array([step.held for step in self.steps])
        # The reference is the largest mass so far, because grains may still fall onto the pile after the
        # start.
        return np.asarray(np.maximum.accumulate(held) - held >= LOST)

    @property
    def disruption(self) -> float:
        """Return the first angular velocity (rad/s) that broke it; NaN if none did."""
        return self._first(self.broken)

    @property
    def deformation(self) -> float:
        """Return the first angular velocity (rad/s) that deformed or broke it; NaN if none did."""
        shape = np.array([step.asteroid.flattening for step in self.steps])
        return self._first(self.broken | (shape >= DEFORMED * shape[0]))

    def at(self, rate: float) -> SpinStep:
        """Return the step whose angular velocity is nearest to ``rate``, rad/s."""
        return self.steps[int(np.abs([step.rate - rate for step in self.steps]).argmin())]

    def _first(self, happened: np.ndarray) -> float:
        return self.steps[int(happened.argmax())].rate if happened.any() else float("nan")


def turn(state: ParticleState | Arrays, rate: float) -> None:
    """Set the angular velocity (rad/s) of the pile in a state about z, as a rigid rotation.

    The difference from its present spin is added to the velocities and spins of its grains. Its momentum does
    not change.
    """
    arrays = {name: np.array(state[name]) for name in state}
    inside = body(clusters_of(arrays), arrays["mass"])
    grains = part(arrays, inside)
    change = np.array([0.0, 0.0, rate]) - Asteroid.of(arrays).spin
    arm = grains["position"] - np.average(grains["position"], axis=0, weights=grains["mass"])
    velocity, spin = arrays["velocity"], arrays["spin"]
    velocity[inside] += np.cross(change, arm)
    spin[inside] += change
    state["velocity"] = velocity
    state["spin"] = spin


def stage_ends(
    settled: float, rates: Sequence[float] = RATES, holds: tuple[float, float] = HOLDS
) -> np.ndarray:
    """Return the end of each step of a spin-up, s; shape (steps,).

    settled : time at which the pile has settled and the first step begins, s.
    """
    return settled + np.cumsum([holds[rate > QUICK * (1 + 1e-9)] for rate in rates])


def spin_ups(
    seeds: int,
    progress: Progress = lambda part: None,
    magnetisations: Sequence[float] = published.MAGNETISATIONS,
    rates: Sequence[float] = RATES,
    holds: tuple[float, float] = HOLDS,
    **settings: Any,
) -> list[SpinUp]:
    """Spin up piles of each magnetisation (A/m), each from several starts, all as one batch; see
    ``spun_up``."""
    wanted = [(m, seed) for m in magnetisations for seed in range(seeds)]
    return spun_up(wanted, progress, rates, holds, **settings)


def spun_up(
    wanted: Sequence[tuple[float, int]],
    progress: Progress = lambda part: None,
    rates: Sequence[float] = RATES,
    holds: tuple[float, float] = HOLDS,
    **settings: Any,
) -> list[SpinUp]:
    """Spin up piles, given the magnetisation (A/m) and the seed of each, all as one batch.

    rates : rad/s, rising. holds : hold times up to QUICK and beyond it, s.
    settings : of ``scene``; the pile settles for its duration.
    progress : receives the completed fraction, 0..1. RunError if a run fails.
    """
    clouds = [scene(magnetisation=m, seed=seed, **settings) for m, seed in wanted]
    settled = clouds[0].duration
    ends = stage_ends(settled, rates, holds)
    scenes = [one.model_copy(update={"duration": float(ends[-1])}) for one in clouds]
    seen: list[list[SpinStep]] = [[] for _ in scenes]
    with loaded(scenes) as simulation:
        for rate, end in zip((0.0, *rates), (settled, *ends), strict=True):
            if rate:
                for state in simulation.states:
                    turn(state, rate)
            simulation.run(until=end)
            for steps, result in zip(seen, sound(simulation.results()), strict=True):
                steps.append(SpinStep(rate, result.state))
            progress(float(end / ends[-1]))
    return [SpinUp(*one, steps) for one, steps in zip(wanted, seen, strict=True)]


def density(result: Result) -> float:
    """Return the density of the pile at the end, kg/m^3; its critical spin is proportional to the square
    root."""
    return Asteroid.of(result.state).density


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost`` in a pile before it is spun up: density and largest overlap.

    Paths of single grains are chaotic.
    """
    return (
        Quantity("density", density, random=True),
        Quantity("largest overlap", lambda result: overlap(result, np.min), random=True),
    )
