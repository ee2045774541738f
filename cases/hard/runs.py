"""Starts, runs and conserved quantities of hard cases."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tisim import Particles, Result, Scene, Simulation, run
from tisim.backend import runtime
from tisim.cases.common.runs import sound
from tisim.steppers import FixedStep, Verlet

State = Mapping[str, np.ndarray]


def given(
    position: ArrayLike, velocity: ArrayLike, radius: ArrayLike, mass: ArrayLike, **quantities: Any
) -> Particles:
    """Return particles one by one: positions (m) and velocities (m/s) of shape (n, 3) or (3,), radii (m),
    masses (kg) and further quantities."""
    return Particles(
        position=np.atleast_2d(np.asarray(position, float)),
        velocity=np.atleast_2d(np.asarray(velocity, float)),
        radius=radius,
        mass=mass,
        quantities=quantities,
    )


def verlet(dt: float) -> Verlet:
    """Return Verlet with steps of one length, s."""
    return Verlet(control=FixedStep(dt=dt))


def by_id(state: State) -> dict[str, np.ndarray]:
    """Return a state with its particles in the order of their ids."""
    order = np.argsort(state["id"])
    return {name: values[order] for name, values in state.items()}


def ends(scenes: Sequence[Scene]) -> list[dict[str, np.ndarray]]:
    """Return the final states of scenes, by id; RunError if a run fails."""
    return [by_id(result.state) for result in sound(run(list(scenes)))]


def looks(scenes: Sequence[Scene], number: int) -> list[list[dict[str, np.ndarray]]]:
    """Return, for each scene, its states at the start and after each of ``number`` equal parts of its steps.

    The scenes have one structure and steps of one length. RunError if a run fails.
    """
    steps = max(round(one.duration / one.stepper.control.dt) for one in scenes)  # type: ignore[attr-defined]
    simulation = Simulation(scenes[0], worlds=len(scenes), capacity=max(one.capacity() for one in scenes))
    try:
        simulation.load(list(scenes))
        series = [[by_id(result.state)] for result in simulation.results()]
        for _ in range(number):
            simulation.run(steps=-(-steps // number))
            for states, result in zip(series, sound(simulation.results()), strict=True):
                states.append(by_id(result.state))
    finally:
        simulation.close()
    return series


def solved(scenes: Sequence[Scene]) -> list[Result]:
    """Return scenes of one structure as they are before their first step, with moments already solved."""
    simulation = Simulation(scenes[0], worlds=len(scenes), capacity=max(one.capacity() for one in scenes))
    try:
        simulation.load(list(scenes))
        return simulation.results()
    finally:
        simulation.close()


def missing(result: Result, *words: str) -> int:
    """Return how many of the words the message of a failed run lacks; all if the run did not fail."""
    return sum(result.status.ok or word not in result.status.reason for word in words)


@contextmanager
def single_precision() -> Iterator[None]:
    """Run in single precision within this context, on the same device and threads."""
    with runtime.turn:
        before = runtime.current()
        try:
            runtime.init(before.device, "f32", before.threads, before.arithmetic)
            yield
        finally:
            runtime.init(before.device, before.precision, before.threads, before.arithmetic)


def kinetic(state: State) -> float:
    """Return the kinetic energy of solid spheres, with rotation if they have a spin, J."""
    energy = 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1)).sum()
    if "spin" in state:
        inertia = 0.4 * state["mass"] * state["radius"] ** 2
        energy += 0.5 * (inertia * (state["spin"] ** 2).sum(axis=1)).sum()
    return float(energy)


def momentum(state: State) -> np.ndarray:
    """Return the total momentum, kg m/s, shape (3,)."""
    return (state["mass"][:, None] * state["velocity"]).sum(axis=0)


def off(actual: ArrayLike, expected: ArrayLike, scale: float | None = None) -> float:
    """Return the largest deviation of numbers from the expected ones, over ``scale``; by default over the
    largest expected magnitude."""
    deviation = np.abs(np.asarray(actual, float) - np.asarray(expected, float)).max()
    return float(deviation / (np.abs(expected).max() if scale is None else scale))
