"""Scenes shared by several tests, and one compiled simulation for each of their structures."""

from __future__ import annotations

import numpy as np
import pytest

from tisim import Box, Particles, Scene, Simulation
from tisim.backend import runtime
from tisim.effects import Agglomeration, DeformationWork, Friction, Heating, Impact, Reaction, Softening
from tisim.operators import Cooling, Fragmentation
from tisim.steppers import Boris, FixedStep, Verlet

DENSITY = 2000.0
RADIUS = 1e-3
GRAIN = DENSITY * 4 / 3 * np.pi * RADIUS**3
"""kg, mass of a grain of RADIUS and DENSITY."""
HEAT_CAPACITY = 500.0
SOFT = 1.0
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


def laws(
    hardness=SOFT,
    surface_energy=1e16,
    grain_mass=GRAIN,
    threshold=2 ** (-1 / 3),
    activation_energy=0.0,
    reaction=1e3,
):
    """All impact laws of Z04; by default the hardness does not depend on temperature."""
    return (
        Impact(hardness=hardness),
        Friction(coefficient=0.1),
        Heating(heat_capacity=HEAT_CAPACITY),
        DeformationWork(),
        Softening(activation_energy=activation_energy),
        Reaction(energy_density=reaction),
        Fragmentation(surface_energy=surface_energy, grain_mass=grain_mass, threshold=threshold),
        Agglomeration(),
    )


def flow(
    seed=0,
    grains=100,
    hardness=3e5,
    surface_energy=1e16,
    grain_mass=GRAIN,
    threshold=0.5,
    duration=1e-3,
    side=0.02,
    images=False,
    stepper=None,
    sizes=1.0,
):
    """A random cloud under all of Z04's physics; ``sizes`` is the largest radius over the smallest."""
    draw = np.random.Generator(np.random.Philox(seed))
    radius = RADIUS * sizes ** -draw.uniform(0, 1, grains)
    return Scene(
        particles=Particles(
            position=draw.uniform(-side / 2, side / 2, (grains, 3)),
            velocity=np.array([100.0, 10, 10]) + draw.uniform(-1, 1, (grains, 3)) * [150.0, 15, 15],
            radius=radius,
            density=DENSITY,
            quantities={"temperature": draw.uniform(200, 600, grains)},
        ),
        effects=(*laws(hardness, surface_energy, grain_mass, threshold, 300.0, 2e4), Cooling()),
        domain=Box(low=(-side / 2,) * 3, high=(side / 2,) * 3, images=images),
        stepper=stepper or Verlet(),
        duration=duration,
        seed=seed,
    )


def momentum(state):
    """Momentum, kg m/s."""
    return (state["mass"][:, None] * state["velocity"]).sum(axis=0)


def energy(state, heat_capacity=HEAT_CAPACITY):
    """Energy balance, J: kinetic energy, heat, and losses to cooling and new surface, less supplied
    energy."""
    kinetic = 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1)).sum()
    heat = heat_capacity * (state["mass"] * state["temperature"]).sum()
    spent = sum(state[name].sum() for name in ("cooling_loss", "fracture_energy") if name in state)
    supplied = sum(state[name].sum() for name in ("reaction_heat", "deformation_work") if name in state)
    return kinetic + heat + spent - supplied


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
