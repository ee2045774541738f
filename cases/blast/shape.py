"""The shape of a blast: the ellipsoid that has the cloud's second moments, as run and in closed form.

Without drag a particle keeps its speed along the field and circles across it. All start away from the centre
of mass at one speed, so a ball of them, of whatever density along its radius, is an ellipsoid of revolution
about the field ever after: with d the way gone and r the start, and <n_k^2> = 1/3 over all directions,

    <(r_k + d_k)^2> = (<r^2> + 2 <r> d cos(psi) + d^2)/3,

d = v t along the field, at psi = 0, and d = (2 v/w) |sin(w t/2)| across it, turned by psi = w t/2, w = q B/m.
Drag takes 1 part in 1000 of the speed in the second that Z16 shows.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from tisim.cases.blast.scene import SPECIFIC_CHARGE, SPEED

from tisim.scene.initial_state import Arrays


def moments(state: Arrays) -> np.ndarray:
    """Second moments about the centre of mass, by mass: m^2, shape (3, 3)."""
    mass = state["mass"]
    r = state["position"] - np.average(state["position"], axis=0, weights=mass)
    return np.asarray((mass[:, None] * r).T @ r / mass.sum())


def principal_half_axes(tensor: np.ndarray) -> np.ndarray:
    """Half axes of the full ellipsoid with these second moments, longest first: sqrt(5 eigenvalue), m."""
    return np.sqrt(5.0 * np.linalg.eigvalsh(tensor)[::-1])


def ball(tensor: np.ndarray) -> float:
    """Half axis (m) of the full ball with the trace of these second moments."""
    return float(np.sqrt(5 / 3 * np.trace(tensor)))


def ellipsoid(flux: np.ndarray, time: float, start: float) -> np.ndarray:
    """Second moments in closed form, m^2, shape (3, 3): a ball of half axis start, m, in a field, T, (3,)."""
    strength = float(np.linalg.norm(flux))
    along, across = extents(SPECIFIC_CHARGE * strength, time, start)
    n = flux / strength if strength > 0 else np.array([1.0, 0.0, 0.0])
    return across * np.eye(3) + (along - across) * np.outer(n, n)


def extents(w: float, time: np.ndarray | float, start: float) -> tuple[np.ndarray, np.ndarray]:
    """Second moments along and across the field, m^2, as if the ball were filled evenly."""
    square, mean = 3 / 5 * start**2, 3 / 4 * start
    straight, half = SPEED * np.asarray(time, float), w * np.asarray(time, float) / 2
    chord = straight * np.sinc(half / np.pi)
    along = (square + 2 * mean * straight + straight**2) / 3
    return along, (square + 2 * mean * chord * np.cos(half) + chord**2) / 3


def contacts(state: Arrays) -> int:
    """Pairs of equal spheres that touch or overlap."""
    reach = 2.0 * float(state["radius"].max())
    return len(cKDTree(state["position"]).query_pairs(reach))
