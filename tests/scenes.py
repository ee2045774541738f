"""Scenes shared by several tests, and one compiled simulation for each of their structures."""

from __future__ import annotations

import numpy as np
import pytest

from tisim import Particles, Scene, Simulation
from tisim.backend import runtime
from tisim.cases.hard.reacting_flow import (
    BONDING_HARDNESS,
    STONE,
    STONE_HEAT_CAPACITY,
    STONE_MASS,
    STONE_RADIUS,
    energy,
    flow,
    laws,
)
from tisim.steppers import Boris, FixedStep, Verlet

__all__ = ["energy", "flow", "laws"]

DENSITY = STONE
RADIUS = STONE_RADIUS
GRAIN = STONE_MASS
"""kg, mass of a grain of RADIUS and DENSITY."""
HEAT_CAPACITY = STONE_HEAT_CAPACITY
SOFT = BONDING_HARDNESS
"""Pa; a hardness at which all grains bond."""

_compiled: dict = {}


def compiled(scene, worlds=1, capacity=64, schedule=None):
    """A simulation for the structure of a scene; each structure is compiled once for all tests."""
    key = (runtime.generation(), scene.structure(), worlds, capacity, schedule)
    if key not in _compiled:
        _compiled[key] = Simulation(scene, worlds, capacity, schedule)
    return _compiled[key]


def usual(schedule):
    """The given schedule on a CPU; None, the default (launches), on a device."""
    return schedule if runtime.current().device == "cpu" else None


def close_compiled():
    """Close all simulations that ``compiled`` has made."""
    while _compiled:
        _compiled.popitem()[1].close()


def simulate(scenes, worlds=1, capacity=64, steps=None, schedule=None):
    """Results of scenes of one structure, run side by side."""
    simulation = compiled(scenes[0], worlds, capacity, schedule)
    simulation.load(scenes)
    simulation.run(steps=steps)
    return simulation.results()


def by_id(result):
    """State of a result with its particles in the order of their ids."""
    order = np.argsort(result.state["id"])
    return {name: values[order] for name, values in result.state.items()}


def fixed(dt):
    """Verlet with a constant step."""
    return Verlet(control=FixedStep(dt=dt))


def suited(effects, dt):
    """A stepper with a constant step for these effects: Boris if velocities gyrate, when Verlet
    gains energy."""
    gyrates = any(effect.gyrates(effects) for effect in effects)
    return Boris(control=FixedStep(dt=dt)) if gyrates else fixed(dt)


def scene(
    position, velocity, effects=(), radius=RADIUS, density=DENSITY, mass=None, dt=1e-9, steps=1, **more
):
    """Grains given one by one, for a number of equal steps."""
    quantities, material = more.pop("quantities", {}), more.pop("material", None)
    return Scene(
        particles=Particles(
            position=np.asarray(position, float),
            velocity=np.asarray(velocity, float),
            radius=radius,
            density=None if mass is not None else density,
            mass=mass,
            material=material,
            quantities=quantities,
        ),
        effects=effects,
        stepper=more.pop("stepper", None) or suited(effects, dt),
        duration=more.pop("duration", dt * steps),
        **more,
    )


def roundoff():
    """The difference between 1 and the next number, in the precision of the suite."""
    return float(np.finfo(runtime.current().precision.replace("f", "float")).eps)


def head_on(speed, effects, radius=RADIUS, **more):
    """Two equal grains, just touching, that approach each other at ``speed`` (m/s) each."""
    reach = radius * (1 - 1e-12)
    return scene(
        [[-reach, 0, 0], [reach, 0, 0]], [[speed, 0, 0], [-speed, 0, 0]], effects, radius=radius, **more
    )


def hit(speed, effects, **more):
    """The same at room temperature, for a very short time, in which only the impact happens."""
    return head_on(speed, effects, dt=1e-15, quantities={"temperature": 300.0}, **more)


def momentum(state):
    """Momentum, kg m/s."""
    return (state["mass"][:, None] * state["velocity"]).sum(axis=0)


def check_sums(result):
    """Check mass, volume and momentum to rounding, and the energy balance to the rounding of all
    exchanges."""
    start, end = result.start, result.state
    assert result.status.ok, result.status.reason
    assert all(np.isfinite(values).all() for values in end.values())
    assert end["mass"].sum() == pytest.approx(start["mass"].sum(), rel=1e-14)
    assert (end["radius"] ** 3).sum() == pytest.approx((start["radius"] ** 3).sum(), rel=1e-13)
    size = (start["mass"] * np.linalg.norm(start["velocity"], axis=1)).sum()
    np.testing.assert_allclose(momentum(end), momentum(start), rtol=0, atol=1e-13 * size)
    assert energy(end) == pytest.approx(energy(start), rel=1e-12)
