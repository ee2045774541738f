"""Linear magnetisable cylinders in a uniform field, by boundary elements.

A body with M = chi H has charges on its surface only, sigma = n.M. With the field H of all charges, on the
inner side,

    sigma / chi + sigma / 2 - n.H = n.H_0

at the centre of each panel. Charges are uniform in each panel of the curved surface; panels are smaller
towards the rims, and integrals over them are sums over Gauss points.
"""

from dataclasses import dataclass

import numpy as np

GAUSS = 4
"""Points along each side of a panel; an even number, so that none is at the centre."""


@dataclass
class Surface:
    """The panels of a cylinder: centres, normals, areas, and points with their weights in each."""

    centre: np.ndarray
    normal: np.ndarray
    points: np.ndarray
    weights: np.ndarray

    @property
    def area(self) -> np.ndarray:
        return self.weights.sum(axis=1)


def graded(n: int) -> np.ndarray:
    """Limits of n intervals of -1..1 that become smaller towards both ends."""
    return -np.cos(np.linspace(0, np.pi, n + 1))


def _patch(limits_a, limits_b, place, normal, stretch):
    """Panels of the map ``place`` (a, b); stretch : area element over da db."""
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    lower, upper = (
        np.meshgrid(limits_a[k], limits_b[k], indexing="ij") for k in (slice(None, -1), slice(1, None))
    )
    (a0, b0), (a1, b1) = ([one.ravel() for one in pair] for pair in (lower, upper))
    a = 0.5 * (a0 + a1)[:, None] + 0.5 * (a1 - a0)[:, None] * np.repeat(x, GAUSS)
    b = 0.5 * (b0 + b1)[:, None] + 0.5 * (b1 - b0)[:, None] * np.tile(x, GAUSS)
    weight = 0.25 * ((a1 - a0) * (b1 - b0))[:, None] * np.outer(w, w).ravel() * stretch(a, b)
    middle = 0.5 * (a0 + a1), 0.5 * (b0 + b1)
    return place(*middle), normal(*middle), place(a, b), weight


def surface(cylinder, fineness: int) -> Surface:
    """The panels of a cylinder: 4 n around, 4 n along and 2 n across, for a fineness n."""
    angles = np.linspace(0, 2 * np.pi, 4 * fineness + 1)
    radius, half = cylinder.radius, 0.5 * cylinder.length
    heights = half * graded(4 * fineness)
    rings = radius * np.sin(np.linspace(0, np.pi / 2, 2 * fineness + 1))

    def around(f, z):
        return np.stack(np.broadcast_arrays(radius * np.cos(f), radius * np.sin(f), z), axis=-1)

    def outward(f, z):
        return np.stack(np.broadcast_arrays(np.cos(f), np.sin(f), 0 * z), axis=-1)

    patches = [_patch(angles, heights, around, outward, lambda f, z: radius)]
    for up in (-1.0, 1.0):

        def cap(f, rho, up=up):
            return np.stack(np.broadcast_arrays(rho * np.cos(f), rho * np.sin(f), up * half), axis=-1)

        def axial(f, rho, up=up):
            return np.stack(np.broadcast_arrays(0 * f, 0 * f, up), axis=-1)

        patches.append(_patch(angles, rings, cap, axial, lambda f, rho: rho))
    e = np.array(cylinder.direction)
    first = np.cross(e, np.eye(3)[np.argmin(np.abs(e))])
    first /= np.linalg.norm(first)
    turn = np.stack([first, np.cross(e, first), e])
    centre, normal, points, weights = (np.concatenate(one) for one in zip(*patches, strict=True))
    shift = np.array(cylinder.centre)
    return Surface(centre @ turn + shift, normal @ turn, points @ turn + shift, weights)


def field(places: np.ndarray, panels: Surface, charge: np.ndarray) -> np.ndarray:
    """H (A/m) of charges (A/m) at places, (n, 3)."""
    return np.array([_kernel(r, panels) @ charge for r in places])


def _kernel(r: np.ndarray, panels: Surface) -> np.ndarray:
    """H at a place for unit charge on each panel, (3, panels)."""
    apart = r - panels.points
    cube = np.einsum("pqa,pqa->pq", apart, apart) ** 1.5
    return np.einsum("pqa,pq->ap", apart, panels.weights / (4 * np.pi * cube))


def solve(cylinders, applied, susceptibility: float, fineness: int):
    """The panels of all cylinders, their charges (A/m), and the mean magnetisation of each cylinder (A/m);
    applied : H_0 (A/m)."""
    each = [surface(one, fineness) for one in cylinders]
    panels = Surface(*(np.concatenate([getattr(s, name) for s in each]) for name in Surface.__annotations__))
    kernel = np.array([n @ _kernel(r, panels) for r, n in zip(panels.centre, panels.normal, strict=True)])
    # Half of the flux of a charge on a closed surface leaves through it. The elements for a panel itself are
    # set so that this is exact, and charges then add up to 0.
    start = 0
    for one in each:
        own = slice(start, start + len(one.centre))
        block = kernel[own, own]
        np.fill_diagonal(block, 0.0)
        np.fill_diagonal(block, 0.5 - one.area @ block / one.area)
        start = own.stop
    matrix = np.diag(np.full(len(kernel), 1 / susceptibility + 0.5)) - kernel
    charge = np.linalg.solve(matrix, panels.normal @ np.asarray(applied))
    moments = panels.centre * (panels.area * charge)[:, None]
    volumes = [np.pi * one.radius**2 * one.length for one in cylinders]
    parts = np.split(moments, np.cumsum([len(s.centre) for s in each])[:-1])
    return panels, charge, np.array([m.sum(axis=0) / v for m, v in zip(parts, volumes, strict=True)])
