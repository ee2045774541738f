"""The field of magnetised spheres, compared with magpylib and with differences of the field."""

import magpylib
import numpy as np
from scipy.constants import mu_0

from tests.sources.fields import fields, relative
from tisim.sources import MagneticSpheres, Sphere


def test_field_and_gradient(rng):
    spheres = [
        Sphere(centre=rng.normal(size=3), radius=rng.uniform(0.3, 1), magnetisation=rng.normal(size=3) * 1e6)
        for _ in range(3)
    ]
    points = rng.normal(size=(1, 2000, 3))
    b, slope = fields([MagneticSpheres(spheres=spheres)], points)
    expected = sum(
        magpylib.magnet.Sphere(magnetization=s.magnetisation, diameter=2 * s.radius, position=s.centre).getB(
            points[0]
        )
        for s in spheres
    )
    assert relative(b[0], expected).max() < 1e-9
    assert np.median(relative(b[0], expected)) < 1e-13
    step, slope_by_difference = 1e-5, np.zeros_like(slope)
    for c in range(3):
        for sign in (1, -1):
            ahead = fields([MagneticSpheres(spheres=spheres)], points + sign * step * np.eye(3)[c])[0]
            slope_by_difference[..., c] += sign * ahead / (2 * step)
    distances = [np.linalg.norm(points[0] - s.centre, axis=1) - s.radius for s in spheres]
    clear = (np.abs(distances) > 1e-3).all(axis=0)
    size = np.linalg.norm(slope[0], axis=(1, 2)).max()
    assert np.linalg.norm((slope_by_difference - slope)[0, clear], axis=(1, 2)).max() < 1e-6 * size


def test_inside_and_at_the_centre():
    """2/3 mu_0 M, with zero gradient."""
    m = np.array([1e6, -2e6, 5e5])
    b, slope = fields(
        [MagneticSpheres(spheres=[Sphere(radius=2, magnetisation=m)])], [[[0, 0, 0], [0, 1, 1]]]
    )
    np.testing.assert_allclose(b[0], np.array([m, m]) * 2 / 3 * mu_0, rtol=1e-15)
    assert (slope == 0).all()
