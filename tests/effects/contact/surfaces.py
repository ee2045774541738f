"""Scenes of grains at fixed walls of all shapes: one structure, compiled once."""

import numpy as np

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.scenes import scene, simulate
from tisim import Material, geometry
from tisim.effects import Gravity, Walls

WORLDS, CAPACITY = 32, 2
RADIUS, YOUNG, POISSON = 0.1, 1e7, 0.3
"""m, Pa; for grains of 1 kg."""
AWAY = 1e6
"""m; position of a shape that must not be touched."""
SHEET = -100.0
"""m; the height of the flat sheet of triangles, from -2 to 2 along x and y."""


def sheet():
    """A flat sheet of unlike triangles, and a ridge on it that is convex above and concave on its sides."""
    rng = np.random.default_rng(2)
    edge = np.linspace(-2, 2, 9)
    x, y = (a.ravel() for a in np.meshgrid(edge, edge, indexing="ij"))
    inner = (np.abs(x) < 2) & (np.abs(y) < 2)
    x, y = (a + np.where(inner, rng.uniform(-0.15, 0.15, a.shape), 0) for a in (x, y))
    k = np.arange(81).reshape(9, 9)
    low, right, up, far = (a.ravel() for a in (k[:-1, :-1], k[1:, :-1], k[:-1, 1:], k[1:, 1:]))
    faces = np.concatenate([np.stack([low, right, far], 1), np.stack([low, far, up], 1)])
    flat = np.column_stack([x, y, np.full(81, SHEET)])
    ridge = [[a, 4 + b, SHEET + h] for a in (-2, 2) for b, h in ((-1, 0), (0, 1), (1, 0))]
    slopes = 81 + np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    return geometry.TriangulatedSurface(
        vertices=np.concatenate([flat, ridge]), faces=np.concatenate([faces, slopes])
    )


TRIANGLES = sheet()
FAR = {
    "planes": (geometry.Plane(point=(0, 0, -AWAY)),),
    "discs": (geometry.Disc(centre=(AWAY, 0, 0), radius=1),),
    "spheres": (geometry.SphericalSurface(centre=(AWAY, 9, 0), radius=1),),
    "cylinders": (geometry.CylindricalSurface(start=(0, AWAY, 0), end=(0, AWAY, 1), radius=1),),
    "cones": (geometry.ConicalSurface(start=(0, AWAY, 9), end=(0, AWAY, 10), start_radius=1, end_radius=0),),
    "boxes": (geometry.BoxSurface(low=(AWAY,) * 3, high=(2 * AWAY,) * 3),),
}


def beside(position, velocity, shapes, gravity=(0.0, 0.0, 0.0), law=None, spin=None, **more):
    """A grain at some shapes, given by the names of their lists."""
    law = {"young": YOUNG, "poisson": POISSON, "restitution": 1.0, "friction": 0.0, **(law or {})}
    acting = (
        HERTZ_MINDLIN,
        Walls(surface=TRIANGLES, **{**FAR, **shapes}),
        Gravity(acceleration=gravity),
    )
    quantities = {"spin": [spin or (0.0, 0.0, 0.0)]}
    given = {"radius": RADIUS, "mass": 1.0, "dt": 2e-5, "quantities": quantities, **more}
    given["materials"] = {"grain": Material(**law)}
    return scene([position], [velocity], acting, **given)


def run(scenes, **more):
    """Results of scenes, which must all end without failure."""
    results = simulate(scenes, worlds=WORLDS, capacity=CAPACITY, **more)
    for result in results:
        assert result.status.ok, result.status.reason
    return results


def moving(state):
    """Kinetic energy, J."""
    spin = 0.4 * state["mass"] * state["radius"] ** 2 * (state["spin"] ** 2).sum(axis=1)
    return 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1) + spin).sum()
