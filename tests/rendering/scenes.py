"""Solids for tests of pictures, as shapes of particles with the same surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.plotting.bodies import solids_of
from tisim.rendering.camera import Camera, Raster, Window
from tisim.rendering.solids import Solids
from tisim.shapes import EllipsoidShape, SphereShape, SpherocylinderShape, SuperquadricShape
from tisim.shapes.particle_shape import ParticleShape

SHAPES: dict[str, ParticleShape] = {
    "sphere": SphereShape(diameter=1.2),
    "rod": SpherocylinderShape(length=1.5, diameter=0.5),
    "needle": SpherocylinderShape(length=1.9, diameter=0.05),
    "ellipsoid": EllipsoidShape(semi_axes=(0.3, 0.6, 0.9)),
    "superquadric": SuperquadricShape(semi_axes=(0.5, 0.4, 0.7), exponents=(4.0, 2.0, 6.0)),
    "box": SuperquadricShape(semi_axes=(0.5, 0.4, 0.7), exponents=(20.0, 20.0, 20.0)),
}
"""About 1 m large."""
FRAME = Window(-1.2, -1.2, 2.4, 2.4)
CAMERA = Camera(azimuth=25.0, elevation=40.0)


def raster(pixels: int = 400, camera: Camera = CAMERA, window: Window = FRAME) -> Raster:
    """The pixels of a square picture."""
    return Raster(camera, window, pixels, pixels)


def body(name: str, turn: Rotation, centre: tuple[float, float, float] = (0, 0, 0)) -> list[Solids]:
    """A shape with an orientation, red."""
    shape = SHAPES[name]
    state = {
        "position": np.array([centre], float),
        "radius": np.array([shape.bounding_radius()]),
        "orientation": turn.as_quat(scalar_first=True)[None],
        "shape": np.zeros(1, int),
    }
    return solids_of(state, (shape,), np.array([[1.0, 0.0, 0.0]]))
