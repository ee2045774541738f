"""Volume, centre and inertia of a union of spheres, in which overlapping regions count once.

Integrals over the body are converted to integrals over its surface (Gauss). The surface consists of the part
of each sphere outside all others. A sphere is cut into rings of constant height u along an axis; the other
spheres leave arcs of each ring, with known ends. Between the heights at which arcs begin, end or meet, the
integrals over arcs are smooth except for square roots at the interval ends. Replacing the height by a sine
removes these, so that Gauss-Legendre quadrature converges exponentially.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

HEIGHTS, ARC_NODES = 32, 10
"""Gauss-Legendre nodes between two heights, and on an arc of at most a quarter turn. The relative error is a
few 1e-7, and 1e-9 if no ring of a sphere nearly vanishes (tests/geometry/test_sphere_union.py)."""


class Solid(NamedTuple):
    """Properties of a solid of density 1 kg/m^3: volume (m^3), centre of mass (m), shape (3,), and inertia
    tensor about it (m^5), shape (3, 3)."""

    volume: float
    centre: np.ndarray
    inertia: np.ndarray


def sphere_union(centre: np.ndarray, radius: np.ndarray) -> Solid:
    """Return the solid that is the union of spheres at ``centre`` (m), shape (n, 3), with ``radius`` (m),
    shape (n,)."""
    # The surface of a duplicate sphere would be counted twice.
    centre, radius = np.split(np.unique(np.column_stack([centre, radius]), axis=0), [3], axis=1)
    radius, middle = radius[:, 0], centre.mean(axis=0)
    place = centre - middle
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for i in range(len(place)):
        if not _near(place, radius, i).any():
            own = 4 / 3 * np.pi * radius[i] ** 3
            volume, first = volume + own, first + own * place[i]
            second += own * (np.outer(place[i], place[i]) + radius[i] ** 2 / 5 * np.eye(3))
            continue
        r, n, area = _exposed(place, radius, i)
        volume += (area * (r * n).sum(axis=-1)).sum() / 3
        # The divergence of x_j^2 x_k / 2 e_j is x_j x_k, that of x_k^3 / 3 e_k is x_k^2.
        first += np.einsum("p,pk,pk->k", area, r * r, n) / 2
        second += np.einsum("p,pj,pk,pj->jk", area, r * r, r, n) * (np.full((3, 3), 0.5) - np.eye(3) / 6)
    first /= volume
    second = (second + second.T) / 2 - volume * np.outer(first, first)
    return Solid(float(volume), middle + first, np.trace(second) * np.eye(3) - second)


def _near(place: np.ndarray, radius: np.ndarray, i: int) -> np.ndarray:
    """Return which other spheres overlap sphere i, shape (n,)."""
    near: np.ndarray = np.linalg.norm(place - place[i], axis=1) < radius + radius[i]
    near[i] = False
    return near


def _exposed(place: np.ndarray, radius: np.ndarray, i: int) -> tuple[np.ndarray, ...]:
    """Return positions (m), normals and areas (m^2) of quadrature nodes on the exposed surface of sphere i:
    shape (m, 3), (m, 3) and (m,)."""
    near = _near(place, radius, i)
    apart, others = place[i] - place[near], radius[near]
    distance = np.linalg.norm(apart, axis=1)
    # A normal n points into another sphere if n.apart < limit.
    limit = (others**2 - radius[i] ** 2 - distance**2) / (2 * radius[i])
    height, weight = _heights(apart, limit, distance)
    begin, end = _arcs(apart, limit, height)
    nodes, weights = np.polynomial.legendre.leggauss(ARC_NODES)
    half = (end - begin)[..., None] / 2
    angle = (begin[..., None] + half) + half * nodes
    normal = _normals(height[:, None, None], angle)
    hidden = (_normals(height[:, None], (begin + end) / 2) @ apart.T < limit).any(axis=-1)
    area = radius[i] ** 2 * weight[:, None, None] * half * weights * ~hidden[..., None]
    seen = area > 0
    return place[i] + radius[i] * normal[seen], normal[seen], area[seen]


def _normals(height: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return unit vectors with these heights along z and angles around it, shape (..., 3)."""
    ring = np.sqrt(1 - height**2)
    x, y, z = np.broadcast_arrays(ring * np.cos(angle), ring * np.sin(angle), height)
    return np.stack([x, y, z], axis=-1)


def _heights(apart: np.ndarray, limit: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return quadrature nodes in the height of a unit sphere, from -1 to 1, and their weights."""
    breaks = [-1.0, 1.0]
    for k in range(len(apart)):
        if abs(limit[k]) < distance[k]:
            tilt, width = np.arccos(apart[k, 2] / distance[k]), np.arccos(limit[k] / distance[k])
            breaks += [np.cos(tilt + width), np.cos(tilt - width)]
        for m in range(k):
            breaks += _meetings(apart[k], apart[m], limit[k], limit[m])
    edges = np.unique(breaks)
    nodes, weights = np.polynomial.legendre.leggauss(HEIGHTS)
    middle, half = (edges[1:] + edges[:-1])[:, None] / 2, (edges[1:] - edges[:-1])[:, None] / 2
    height = middle + half * np.sin(np.pi / 2 * nodes)
    return height.ravel(), (half * np.pi / 2 * np.cos(np.pi / 2 * nodes) * weights).ravel()


def _meetings(a: np.ndarray, b: np.ndarray, p: float, q: float) -> list[float]:
    """Return the heights of the unit vectors n with n.a = p and n.b = q: two, or none."""
    across = np.cross(a, b)
    square = across @ across
    if square <= 1e-24 * (a @ a) * (b @ b):
        return []
    inner = (np.cross(b, across) * p + np.cross(across, a) * q) / square
    rest = 1 - inner @ inner
    if rest <= 0:
        return []
    outer = np.sqrt(rest / square) * across
    return [float(inner[2] + outer[2]), float(inner[2] - outer[2])]


def _arcs(apart: np.ndarray, limit: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the start and end angles (rad) of arcs on the ring at each height, shape (heights, arcs). Rings
    are divided at the ends of arcs inside other spheres and at quarter turns. Some arcs have zero length."""
    ring = np.sqrt(1 - height**2)[:, None] * np.linalg.norm(apart[:, :2], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (limit - height[:, None] * apart[:, 2]) / ring
    half = np.where(np.abs(cosine) < 1, np.arccos(np.clip(cosine, -1, 1)), 0.0)
    towards = np.arctan2(apart[:, 1], apart[:, 0])
    quarters = np.broadcast_to(np.arange(5) * np.pi / 2, (len(height), 5))
    ends = np.concatenate([(towards + half) % (2 * np.pi), (towards - half) % (2 * np.pi), quarters], axis=1)
    ends = np.sort(ends, axis=1)
    return ends[:, :-1], ends[:, 1:]
