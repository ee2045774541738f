"""The stages of a spin-up: a pile settles, and is turned faster in steps, each held for a while."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from tisim.cases.coalescence.measures import Asteroid, Conserved, body, clusters_of, part
from tisim.cases.coalescence.published import MAGNETISATIONS
from tisim.cases.runs import sound
from tisim.cases.spin_up.scene import scene

from tisim import Simulation
from tisim.engine.batches import Progress
from tisim.engine.particle_state import ParticleState
from tisim.scene.initial_state import Arrays

RATES = tuple(1e-4 * k for k in range(1, 10))
"""The angular velocities that a pile is given, one after the other, rad/s; section 4.3.1 of L21."""
QUICK = 4e-4
"""Up to this one, rad/s, each is held for the shorter time."""
HOLDS = (500.0, 3000.0)
"""They are held for so long, s; L21 section 4.3.1."""
LOST = 0.05
"""A pile is disrupted where it has lost this part of all grains, or more. L21 gives no number."""
DEFORMED = 1.1
"""A pile is deformed where its width over its height has grown by this. L21 gives no number."""
SEEDS = 3
"""There are so many random starts of each magnetisation."""


@dataclass(frozen=True)
class SpinStep:
    """A step of a spin-up: the angular velocity that the pile was given (rad/s), and the state at its end.
    Before the first it is 0."""

    rate: float
    state: Arrays

    @cached_property
    def asteroid(self) -> Asteroid:
        """Return the pile, or the largest piece of it."""
        return Asteroid.of(self.state)

    @property
    def held(self) -> float:
        """Return the part of the mass of all grains that is in the pile."""
        inside = body(clusters_of(self.state), self.state["mass"])
        return float(self.state["mass"][inside].sum() / self.state["mass"].sum())

    @property
    def angular_momentum(self) -> float:
        """Return the angular momentum of all grains, kg m^2/s."""
        return float(np.linalg.norm(Conserved.of(self.state).angular))


@dataclass(frozen=True)
class SpinUp:
    """A spin-up of a pile of grains of a magnetisation (A/m; that of L21's pile) and a seed, step by step."""

    magnetisation: float
    seed: int
    steps: Sequence[SpinStep]

    @property
    def broken(self) -> np.ndarray:
        """Return after which steps it has lost LOST or more of all grains since it had most; shape
        (steps,)."""
        held = np.array([step.held for step in self.steps])
        # What has not come down yet at the start may still do so.
        return np.asarray(np.maximum.accumulate(held) - held >= LOST)

    @property
    def disruption(self) -> float:
        """Return the first angular velocity (rad/s) that broke it; NaN where none did."""
        return self._first(self.broken)

    @property
    def deformation(self) -> float:
        """Return the first angular velocity (rad/s) that deformed or broke it; NaN where none did."""
        shape = np.array([step.asteroid.flattening for step in self.steps])
        return self._first(self.broken | (shape >= DEFORMED * shape[0]))

    def at(self, rate: float) -> SpinStep:
        """Return the step with the angular velocity that is nearest to one, rad/s."""
        return self.steps[int(np.abs([step.rate - rate for step in self.steps]).argmin())]

    def _first(self, happened: np.ndarray) -> float:
        return self.steps[int(happened.argmax())].rate if happened.any() else float("nan")


def turn(state: ParticleState | Arrays, rate: float) -> None:
    """Give the pile in a state an angular velocity (rad/s) about z as a whole: what it lacks is added to the
    velocities and spins of its grains. Its momentum stays."""
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
    """Return when each step of a spin-up ends that begins when a pile has settled, all in s; shape
    (steps,)."""
    return settled + np.cumsum([holds[rate > QUICK * (1 + 1e-9)] for rate in rates])


def spin_ups(
    seeds: int,
    progress: Progress = lambda part: None,
    magnetisations: Sequence[float] = MAGNETISATIONS,
    rates: Sequence[float] = RATES,
    holds: tuple[float, float] = HOLDS,
    **settings: Any,
) -> list[SpinUp]:
    """Spin up piles of each magnetisation (A/m), each from some starts, all as one batch.

    rates : rad/s, rising. holds : how long each is held, s: up to QUICK, and beyond it. settings : those of
    ``scene``; the pile settles for its duration. progress : is told the part that is done, 0..1. RunError
    where one fails.
    """
    wanted = [(m, seed) for m in magnetisations for seed in range(seeds)]
    clouds = [scene(magnetisation=m, seed=seed, **settings) for m, seed in wanted]
    settled = clouds[0].duration
    ends = stage_ends(settled, rates, holds)
    scenes = [one.model_copy(update={"duration": float(ends[-1])}) for one in clouds]
    seen: list[list[SpinStep]] = [[] for _ in scenes]
    with closing(Simulation(scenes[0], len(scenes))) as simulation:
        simulation.load(scenes)
        for rate, end in zip((0.0, *rates), (settled, *ends), strict=True):
            if rate:
                for state in simulation.states:
                    turn(state, rate)
            simulation.run(until=end)
            for steps, result in zip(seen, sound(simulation.results()), strict=True):
                steps.append(SpinStep(rate, result.state))
            progress(float(end / ends[-1]))
    return [SpinUp(*one, steps) for one, steps in zip(wanted, seen, strict=True)]
