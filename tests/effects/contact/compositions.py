"""Scenes of three contact laws that together contain all other parts, with two materials each.

Each law is compiled once. A test of one part turns the others off by their parameters.
"""

import numpy as np

from tests.effects.contact.grains import AWAY, CAPACITY, WORLDS, cell, effects
from tests.scenes import compiled, scene
from tisim import Material, MaterialPair
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects import (
    DMT,
    JKR,
    SJKR,
    ConstantDamping,
    Granular,
    HertzMaterial,
    Hooke,
    LinearSpring,
    MindlinDisplacement,
    RestitutionDamping,
    RollingCDT,
    RollingEPSD,
    RollingSDS,
    TwistingMarshall,
    TwistingSDS,
    ViscoelasticDamping,
    ViscousFriction,
)
from tisim.testing.uncompiled import started

LAWS = {
    "hooke": Granular(
        normal=Hooke(),
        damping=RestitutionDamping(),
        tangential=LinearSpring(stiffness_ratio=0.4),
        rolling=RollingSDS(),
        twisting=TwistingSDS(),
        cohesion=SJKR(),
    ),
    "jkr": Granular(
        normal=JKR(),
        damping=ViscoelasticDamping(),
        tangential=MindlinDisplacement(),
        rolling=RollingEPSD(damping_ratio=0.2),
        twisting=TwistingMarshall(),
    ),
    "dmt": Granular(
        normal=HertzMaterial(),
        damping=ConstantDamping(),
        tangential=ViscousFriction(damping_ratio=0.7),
        rolling=RollingCDT(),
        cohesion=DMT(),
    ),
}
WALLED = ("jkr",)
"""Laws of scenes with walls, which take longer to compile."""
NEUTRAL = {
    "hooke": {
        "stiffness": 2e4,
        "restitution": 1.0,
        "friction": 0.0,
        "rolling_friction": 0.0,
        "rolling_stiffness": 1.0,
        "rolling_damping": 0.0,
        "twisting_friction": 0.0,
        "twisting_stiffness": 1.0,
        "twisting_damping": 0.0,
        "cohesion_energy_density": 0.0,
    },
    "jkr": {
        "young": 1e6,
        "poisson": 0.3,
        "viscous_time": 0.0,
        "friction": 0.0,
        "rolling_friction": 0.0,
        "surface_energy": 0.0,
    },
    "dmt": {
        "young": 1e6,
        "poisson": 0.3,
        "damping": 0.0,
        "friction": 0.0,
        "rolling_friction": 0.0,
        "surface_energy": 0.0,
    },
}
"""Materials with a normal force only, SI."""
TWO = {
    "hooke": (
        {
            "stiffness": 1e4,
            "restitution": 0.6,
            "friction": 0.4,
            "rolling_friction": 0.2,
            "rolling_stiffness": 3e3,
            "rolling_damping": 2.0,
            "twisting_friction": 0.05,
            "twisting_stiffness": 50.0,
            "twisting_damping": 0.1,
            "cohesion_energy_density": 2e3,
        },
        {
            "stiffness": 4e4,
            "restitution": 0.9,
            "friction": 0.1,
            "rolling_friction": 0.05,
            "rolling_stiffness": 9e3,
            "rolling_damping": 1.0,
            "twisting_friction": 0.01,
            "twisting_stiffness": 80.0,
            "twisting_damping": 0.2,
            "cohesion_energy_density": 1e3,
        },
    ),
    "jkr": (
        {
            "young": 1e5,
            "poisson": 0.25,
            "viscous_time": 1e-4,
            "friction": 0.4,
            "rolling_friction": 0.2,
            "surface_energy": 10.0,
        },
        {
            "young": 1e6,
            "poisson": 0.4,
            "viscous_time": 3e-4,
            "friction": 0.2,
            "rolling_friction": 0.1,
            "surface_energy": 40.0,
        },
    ),
    "dmt": (
        {
            "young": 1e5,
            "poisson": 0.25,
            "damping": 10.0,
            "friction": 0.4,
            "rolling_friction": 0.2,
            "surface_energy": 10.0,
        },
        {
            "young": 1e6,
            "poisson": 0.4,
            "damping": 30.0,
            "friction": 0.2,
            "rolling_friction": 0.1,
            "surface_energy": 40.0,
        },
    ),
}
"""Two materials for each law, with which every part acts."""


def grains(name, position, velocity, spin=None, planes=(AWAY,), gravity=(0.0, 0.0, 0.0), **more):
    """Grains given one by one under a law, by default of 1 kg and 1 m radius. They have the first of two
    equal materials with a normal force only; ``first`` and ``second`` change their values."""
    spin = np.zeros_like(np.asarray(velocity, float)) if spin is None else spin
    made = {
        "first": Material(**{**NEUTRAL[name], **more.pop("first", {})}),
        "second": Material(**{**NEUTRAL[name], **more.pop("second", {})}),
    }
    acting = effects(planes, gravity, LAWS[name])
    acting = acting if name in WALLED else (acting[0], acting[2])
    given = {"radius": 1.0, "mass": 1.0, **more}
    return scene(position, velocity, acting, quantities={"spin": spin}, materials=made, **given)


def heap(name, rng, n=30, side=1.5, dt=1e-4, steps=200, pairs=False):
    """Grains of unlike sizes and of two materials that overlap, spin and slide, in a cell too small
    for them."""
    radius, (first, second) = rng.uniform(0.1, 0.3, n), TWO[name]
    return grains(
        name,
        rng.uniform(0, side, (n, 3)),
        rng.normal(size=(n, 3)),
        5 * rng.normal(size=(n, 3)),
        planes=cell(side),
        gravity=(1.0, 0.0, -3.0),
        radius=radius,
        mass=30 * radius**3,
        dt=dt,
        steps=steps,
        first=first,
        second=second,
        material=np.arange(n) % 2,
        material_pairs={"second-first": MaterialPair(friction=0.7)} if pairs else {},
    )


def loaded(scenes):
    """The simulation shared by scenes of one law, loaded with these scenes."""
    simulation = compiled(scenes[0], WORLDS, CAPACITY)
    simulation.load(scenes)
    return simulation


Array = ti.types.ndarray()
DT = 1e-5
"""s, a step along a path."""


@in_taichi_thread
@ti.kernel
def _along(law: ti.template(), path: Array, out: Array):
    """Forces along a path of overlap, slip and relative spin, with R* = 1 m, m* = 1 kg and the normal x."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        at_wall = ti.Vector([1.0, 3.5, 2.5, 2.5])
        past = ti.Vector.zero(ti.f64, max(1, law.memory))
        n = ti.Vector([1.0, 0.0, 0.0])
        for k in range(path.shape[0]):
            slip = ti.Vector([path[k, 1], path[k, 2], path[k, 3]])
            spin = ti.Vector([path[k, 4], path[k, 5], path[k, 6]])
            force, couple, known = law.contact(
                0, 0, n, path[k, 0], 1.0, 1.0, at_wall, slip, spin, 0.0 * n, 0.0, past, DT
            )
            out[k, 6] = ti.cast(law.lasts(0, 0, path[k, 0], 1.0, past), ti.f64)
            past = ti.select(out[k, 6] > 0.0, known, 0.0)
            for c in ti.static(range(3)):
                out[k, c], out[k, 3 + c] = out[k, 6] * force[c], out[k, 6] * couple[c]


def along(name, overlap, moved=0.0, turned=0.0, **first):
    """Force (N) and torque (N m) on i at each point of a path of one contact, and whether it exists; (n, 3),
    (n, 3), (n,).

    The contact faces x, with R* = 1 m and m* = 1 kg; ``moved`` is the tangential displacement of its surfaces
    since the point before (m), and ``turned`` the rotation of the other grain since then (rad).
    """
    made = grains(name, [[0, 0, 0]], [[0, 0, 0]], first=first)
    steps = [np.broadcast_to(one, (len(overlap), 3)) / DT for one in (moved, turned)]
    path, out = np.column_stack([overlap, *steps]), np.zeros((len(overlap), 7))
    # Of the law alone: a simulation would take much longer to compile.
    with started(made) as (allocation, _):
        (bound,) = allocation.effects.of(Granular)
        _along(bound, path, out)
    return out[:, :3], out[:, 3:6], out[:, 6]


def alone(law, overlap, **material):
    """Force (N) of another law at some overlaps of a contact with R* = 1 m and m* = 1 kg at rest; (n, 3)."""
    made = scene([[0, 0, 0]], [[0, 0, 0]], (law,), materials={"grain": Material(**material)})
    out = np.zeros((len(overlap), 7))
    with started(made) as (allocation, _):
        _along(allocation.effects[0], np.column_stack([overlap, np.zeros((len(overlap), 6))]), out)
    return out[:, :3]
