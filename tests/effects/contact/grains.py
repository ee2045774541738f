"""Scenes of grains under Hertz and Mindlin, shared by several tests: one structure, compiled once."""

import numpy as np

from tests.effects.contact.granular_reference import Grains, law_of
from tests.scenes import scene, simulate
from tisim import Material
from tisim.effects import Granular, Gravity, HertzMaterial, MindlinForce, RestitutionDamping, Walls
from tisim.geometry import Plane

WORLDS, CAPACITY = 32, 64
USUAL = {"young": 1e7, "poisson": 0.3, "restitution": 0.8, "friction": 0.4}
"""The material unless a test requires another; young in Pa."""
HERTZ_MINDLIN = Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce())
FAR = 1e6
"""m; position of a wall that must not be touched."""
FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
AWAY = ((0.0, 0.0, -FAR), (0.0, 0.0, 1.0))


def cell(side):
    """The six walls of a cube, point and normal of each."""
    low = [((0.0, 0.0, 0.0), tuple(axis)) for axis in np.eye(3)]
    return low + [((side,) * 3, tuple(-axis)) for axis in np.eye(3)]


def effects(planes=(AWAY,), gravity=(0.0, 0.0, 0.0), law=HERTZ_MINDLIN):
    """A law, by default Hertz and Mindlin, walls, and gravity."""
    walls = tuple(Plane(point=point, normal=normal) for point, normal in planes)
    return law, Walls(planes=walls), Gravity(acceleration=gravity)


def grains(position, velocity, spin=None, planes=(AWAY,), gravity=(0.0, 0.0, 0.0), law=None, **more):
    """Grains given one by one, by default 1 kg and 1 m in radius."""
    spin = np.zeros_like(np.asarray(velocity, float)) if spin is None else spin
    given = {"radius": 1.0, "mass": 1.0, **more}
    materials = {"grain": Material(**{**USUAL, **(law or {})})}
    acting = effects(planes, gravity)
    return scene(position, velocity, acting, quantities={"spin": spin}, materials=materials, **given)


def run(scenes, **more):
    """Results of scenes, which must all end without failure."""
    results = simulate(scenes, worlds=WORLDS, capacity=CAPACITY, **more)
    for result in results:
        assert result.status.ok or result.status.reason == "running", result.status.reason
    return results


def heap(rng, n=40, side=1.6, dt=2e-4, steps=300, **law):
    """Grains of unlike sizes that overlap, spin and slide, in a cell too small for them."""
    radius = rng.uniform(0.1, 0.3, n)
    law = {"young": 1e5, "poisson": 0.25, "restitution": 0.6, "friction": 0.4, **law}
    return grains(
        rng.uniform(0, side, (n, 3)),
        rng.normal(size=(n, 3)),
        5 * rng.normal(size=(n, 3)),
        planes=cell(side),
        gravity=(1.0, 0.0, -3.0),
        law=law,
        radius=radius,
        mass=30 * radius**3,
        dt=dt,
        steps=steps,
    )


def reference(made):
    """The same grains in NumPy, at their start."""
    start = made.start()
    planes = [plane for one in made.effects if isinstance(one, Walls) for plane in one.planes]
    (acceleration,) = [one.acceleration for one in made.effects if isinstance(one, Gravity)]
    return Grains(
        law_of(made),
        *(start[name] for name in ("position", "velocity", "spin", "radius", "mass")),
        planes=[(plane.point, plane.normal) for plane in planes],
        acceleration=acceleration,
        material=start.get("material"),
    )
