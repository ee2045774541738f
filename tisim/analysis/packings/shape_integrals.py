"""Surface area and integral of the mean curvature of shapes, from which distances of random bodies follow."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import leggauss

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.errors import must
from tisim.shapes.particle_shape import ParticleShape
from tisim.shapes.superquadric import power_sum_root

OCTANT_NODES = 160
"""Gauss-Legendre nodes of each angle within an octant. Up to an aspect ratio of 10 and an exponent of 20 the
relative errors are then below 1e-7 (the largest that was found), and below 1e-12 for exponents up to 8."""


def surface_area(shape: ParticleShape) -> float:
    """Return the area S (m^2) of the surface of a shape: of rods in closed form, of superquadrics by
    quadrature to a part in 1e7.

    The points of a superquadric are x_k = a_k rho t_k, with t on the unit sphere and sum_k (rho t_k)^g_k = 1.
    With F = sum_k y_k^g_k, y = rho t, its area is the integral of

        a_1 a_2 a_3 |grad F / a| rho^3 / (y . grad F)

    over t, as volume elements of the cone from the centre show.
    """
    if (rod := shape.rod()) is not None:
        half, radius = rod
        return float(4 * np.pi * radius * (radius + half))
    a, g = _superquadric(shape)
    t, weight = _octant()
    rho = np.exp(-power_sum_root(np.broadcast_to(g, t.shape), np.log(t)))
    y = rho[:, None] * t
    gradient = g * y ** (g - 1)
    density = np.prod(a) * np.linalg.norm(gradient / a, axis=1) * rho**3 / (y * gradient).sum(axis=1)
    return float(8 * weight @ density)


def curvature_integral(shape: ParticleShape) -> float:
    """Return the integral M (m) of the mean curvature over the surface of a convex shape, 2 pi times its mean
    width: pi L + 2 pi D for a rod, and the integral of the support function over all directions for others.

    Source: H. Hadwiger, Vorlesungen ueber Inhalt, Oberflaeche und Isoperimetrie (1957).
    """
    if (rod := shape.rod()) is not None:
        half, radius = rod
        return float(2 * np.pi * half + 4 * np.pi * radius)
    n, weight = _octant()
    return float(8 * weight @ (shape.support(n) * n).sum(axis=1))


def surface_areas(packing: PackedBodies) -> np.ndarray:
    """Return the surface area of each body, m^2, shape (n,)."""
    return np.array([surface_area(one) for one in packing.shapes])[packing.shape] * packing.scale**2


def curvature_integrals(packing: PackedBodies) -> np.ndarray:
    """Return the integral of the mean curvature over each body, m, shape (n,)."""
    return np.array([curvature_integral(one) for one in packing.shapes])[packing.shape] * packing.scale


def _superquadric(shape: ParticleShape) -> tuple[np.ndarray, np.ndarray]:
    known = shape.superquadric()
    must(known is not None, "shape", "a rod or a superquadric", type(shape).__name__)
    assert known is not None
    return np.array(known[0]), np.array(known[1])


def _octant() -> tuple[np.ndarray, np.ndarray]:
    """Return directions in the first octant and their weights, which are solid angles."""
    x, w = leggauss(OCTANT_NODES)
    # The angles are even functions of u at both ends, where powers of components are not smooth.
    u = np.pi / 4 * (x + 1)
    theta, wide = np.pi / 2 * np.sin(u) ** 2, np.pi / 4 * np.pi / 2 * np.sin(2 * u) * w
    polar, azimuth = (one.ravel() for one in np.meshgrid(theta, theta, indexing="ij"))
    sine = np.sin(polar)
    n = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(polar)], axis=1)
    return n, np.outer(wide * np.sin(theta), wide).ravel()
