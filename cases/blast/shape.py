"""The shape of a blast: the ellipsoid with the second moments of the cloud, from runs and in closed form.

Without drag a particle keeps its speed along the field and circles across it. All particles start away from
the centre of mass at one speed, so a ball of them, with any radial density profile, is an ellipsoid of
revolution about the field at all later times. With d the displacement, r the start, and <n_k^2> = 1/3 over
all directions,

    <(r_k + d_k)^2> = (<r^2> + 2 <r> d cos(psi) + d^2)/3,

d = v t along the field, at psi = 0, and d = (2 v/w) |sin(w t/2)| across it, turned by psi = w t/2, w = q B/m.
Drag reduces the speed by 1 part in 1000 in the second that Z16 shows.
"""

import numpy as np
from scipy.spatial import cKDTree

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import displacement
from tisim.cases.blast.scene import SPECIFIC_CHARGE, SPEED
from tisim.effects import PairForce
from tisim.scene.initial_state import Arrays


def moments(state: Arrays) -> np.ndarray:
    """Return the mass-weighted second moments about the centre of mass: m^2, shape (3, 3)."""
    mass = state["mass"]
    r = state["position"] - np.average(state["position"], axis=0, weights=mass)
    return np.asarray((mass[:, None] * r).T @ r / mass.sum())


def principal_half_axes(tensor: np.ndarray) -> np.ndarray:
    """Return the half axes of the full ellipsoid with these second moments, longest first: sqrt(5
    eigenvalue), m."""
    return np.sqrt(5.0 * np.linalg.eigvalsh(tensor)[::-1])


def ball(tensor: np.ndarray) -> float:
    """Return the half axis (m) of the full ball with the trace of these second moments."""
    return float(np.sqrt(5 / 3 * np.trace(tensor)))


def ellipsoid(flux: np.ndarray, time: float, start: float) -> np.ndarray:
    """Return second moments in closed form, m^2, shape (3, 3): a ball of half axis start, m, in a field, T,
    (3,)."""
    strength = float(np.linalg.norm(flux))
    along, across = extents(SPECIFIC_CHARGE * strength, time, start)
    n = flux / strength if strength > 0 else np.array([1.0, 0.0, 0.0])
    return across * np.eye(3) + (along - across) * np.outer(n, n)


def extents(w: float, time: np.ndarray | float, start: float) -> tuple[np.ndarray, np.ndarray]:
    """Return second moments along and across the field, m^2, for a uniformly filled ball."""
    square, mean = 3 / 5 * start**2, 3 / 4 * start
    straight, half = SPEED * np.asarray(time, float), w * np.asarray(time, float) / 2
    chord = straight * np.sinc(half / np.pi)
    along = (square + 2 * mean * straight + straight**2) / 3
    return along, (square + 2 * mean * chord * np.cos(half) + chord**2) / 3


def contacts(state: Arrays) -> int:
    """Return the number of pairs of equal spheres that touch or overlap."""
    reach = 2.0 * float(state["radius"].max())
    return len(cKDTree(state["position"]).query_pairs(reach))


def half_axes(state: Arrays) -> np.ndarray:
    """Return the half axes, m, of the ellipsoid with the second moments of the cloud: sqrt(5 <r_k^2>) for x,
    y, z."""
    r = state["position"] - np.average(state["position"], axis=0, weights=state["mass"])
    return np.sqrt(5.0 * np.average(r**2, axis=0, weights=state["mass"]))


def of_the_end(result: Result) -> np.ndarray:
    """Return the half axes of the cloud at the end of a run, m."""
    return half_axes(result.state)


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``: the positions, or the shape over random starts if particles
    touch, because their paths are then chaotic."""
    if any(isinstance(effect, PairForce) for effect in scene.effects):
        return (Quantity("half-axes of the cloud", of_the_end, random=True),)
    return (Quantity("positions", displacement, returns=True),)
