"""The shape of a blast: the ellipsoid with the second moments of the cloud, from runs and in closed form.

Without drag a particle keeps its speed along the field and circles across it. All particles start away from
the centre of mass at one speed, so a ball of them, with any radial density profile, is an ellipsoid of
revolution about the field at all later times. With d the displacement, r the start, and <n_k^2> = 1/3 over
all directions,

    <(r_k + d_k)^2> = (<r^2> + 2 <r> d cos(psi) + d^2)/3,

d = v t along the field, at psi = 0, and d = (2 v/w) |sin(w t/2)| across it, turned by psi = w t/2, w = q B/m.
Drag reduces the speed by 1 part in 1000 in the second that Z16 shows. With Stokes drag, the same holds with
the displacements d of ``closed_forms.displacement``, and the ellipsoid comes to rest.
"""

import numpy as np
from scipy.spatial import cKDTree

from tisim import Result, Scene
from tisim.accuracy import Quantity, quantity
from tisim.cases.blast.closed_forms import displacement
from tisim.cases.blast.scene import SPECIFIC_CHARGE, SPEED
from tisim.effects import PairForce
from tisim.errors import must
from tisim.scene.initial_state import Arrays

AGES = 40.0
"""A time over the relaxation time after which particles are at rest, to rounding."""


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


def ellipsoid(flux: np.ndarray, time: float, start: float, tau: float = np.inf) -> np.ndarray:
    """Return second moments in closed form, m^2, shape (3, 3): a ball of half axis start, m, in a field, T,
    (3,). tau : relaxation time of Stokes drag, s."""
    strength = float(np.linalg.norm(flux))
    along, across = extents(SPECIFIC_CHARGE * strength, time, start, tau)
    n = flux / strength if strength > 0 else np.array([1.0, 0.0, 0.0])
    return across * np.eye(3) + (along - across) * np.outer(n, n)


def extents(
    w: np.ndarray | float, time: np.ndarray | float, start: float, tau: np.ndarray | float = np.inf
) -> tuple[np.ndarray, np.ndarray]:
    """Return second moments along and across the field, m^2, for a uniformly filled ball of half axis start,
    m. tau : relaxation time of Stokes drag, s."""
    square, mean = 3 / 5 * start**2, 3 / 4 * start
    along, across = (displacement(time, SPEED, tau, rate) for rate in (0.0, w))
    first, second = ((square + 2 * mean * d.real + np.abs(d) ** 2) / 3 for d in (along, across))
    return first, second


def at_rest(flux: np.ndarray, tau: float, start: float) -> np.ndarray:
    """Return second moments of the cloud at rest, m^2, shape (3, 3): ``ellipsoid`` after a long time."""
    return ellipsoid(flux, AGES * tau, start, tau)


def strength_and_tau(along: float, across: float, start: float) -> tuple[float, float]:
    """Return the flux density (T) and relaxation time (s) that give half axes (m) along and across the field
    at rest.

        1 + (w tau)^2 = (along^2 - start^2)/(across^2 - start^2),
        (v tau)^2 + 3/2 start (v tau) = 3/5 (along^2 - start^2)

    with v the speed and w = q B/m: the solution of ``at_rest``. start : half axis of the ball, m.
    """
    must(start < across <= along, "half axes", f"{start:g} < across <= along", (along, across))
    grown = along**2 - start**2
    tau = (np.sqrt((3 / 4 * start) ** 2 + 3 / 5 * grown) - 3 / 4 * start) / SPEED
    w = np.sqrt(grown / (across**2 - start**2) - 1) / tau
    return float(w / SPECIFIC_CHARGE), float(tau)


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
    return (Quantity("positions", quantity.displacement, returns=True),)
