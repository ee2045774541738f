"""Gaps between the surfaces of given pairs of bodies, by the narrow phase of the engine."""

from collections.abc import Sequence

import numpy as np

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.errors import must
from tisim.numerics.vectors import rotated
from tisim.shapes.particle_shape import ParticleShape
from tisim.shapes.rod_pairs import closest_rods
from tisim.shapes.superquadric_pairs import closest_superquadrics
from tisim.shapes.superquadric_points import ELLIPSOIDS, ROD, SUPERQUADRICS, WITH_RODS


def gaps(
    shapes: Sequence[ParticleShape],
    shape: np.ndarray,
    scale: np.ndarray,
    orientation: np.ndarray,
    pairs: np.ndarray,
    separation: np.ndarray,
    far: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the gap (m, negative if the bodies overlap, shape (m,)) and the unit normal from the first to
    the second body (shape (m, 3)) of each pair.

    shapes : rods, spheres, superquadrics and ellipsoids. shape : index of the shape of each body. scale :
    size of each body over the size of its shape. orientation : unit quaternions w, x, y, z of the bodies,
    shape (n, 4). pairs : indices of two bodies, shape (m, 2). separation : centre of the second minus centre
    of the first (m), shape (m, 3). far : gap (m) beyond which a lower bound of the gap and a normal that
    separates the bodies are sufficient.

    Gaps of two rods or spheres are in closed form; others are found by Newton's method.
    """
    out = np.zeros((len(pairs), 4))
    rods = np.array([one.rod() or (-1.0, 0.0) for one in shapes]).reshape(-1, 2)
    round_ends = (rods[:, 0] >= 0)[shape]
    quick = round_ends[pairs].all(axis=1)
    turns, apart = np.ascontiguousarray(orientation, float), np.asarray(separation, float)
    runtime.current()
    for chosen, closed in ((quick, True), (~quick, False)):
        if not chosen.any():
            continue
        first, second = (np.ascontiguousarray(one, np.int32) for one in pairs[chosen].T)
        where, some = (np.ascontiguousarray(apart[chosen]), first, second, turns), np.zeros((len(first), 4))
        if closed:
            _rods(*where, rods[shape] * scale[:, None], some)
        else:
            family, axes, exponents = _as_superquadrics(shapes)
            sizes, powers = axes[shape] * scale[:, None], exponents[shape]
            _superquadrics(family, *where, sizes, powers, float(far), some)
        out[chosen] = some
    return out[:, 0], out[:, 1:]


def _as_superquadrics(shapes: Sequence[ParticleShape]) -> tuple[int, np.ndarray, np.ndarray]:
    """Return the family of some shapes, and their semi-axes (m) and exponents, shape (k, 3) each."""
    sizes = []
    for shape in shapes:
        given, rod = shape.superquadric(), shape.rod()
        if given is None and rod is not None:
            half, radius = rod
            given = (radius, radius, half + radius), (2.0, 2.0, ROD)
        must(given is not None, "shapes", "rods, spheres, superquadrics and ellipsoids", type(shape).__name__)
        sizes.append(given)
    axes, exponents = np.swapaxes(np.array(sizes, float), 0, 1)
    family = WITH_RODS if (exponents == ROD).any() else SUPERQUADRICS
    return ELLIPSOIDS if (exponents == 2).all() else family, axes, exponents


@ti.func
def _row(array: ti.template(), m, size: ti.template()):  # type: ignore[valid-type]
    """Return a row of an array as a vector in f64."""
    return ti.Vector([ti.cast(array[m, k], ti.f64) for k in ti.static(range(size))])


@ti.func
def _write(out: ti.template(), m, gap, normal):  # type: ignore[valid-type]
    out[m, 0] = gap
    for k in ti.static(range(3)):
        out[m, 1 + k] = normal[k]


@in_taichi_thread
@ti.kernel
def _rods(
    separation: ti.types.ndarray(),  # type: ignore[valid-type]
    first: ti.types.ndarray(),  # type: ignore[valid-type]
    second: ti.types.ndarray(),  # type: ignore[valid-type]
    q: ti.types.ndarray(),  # type: ignore[valid-type]
    rod: ti.types.ndarray(),  # type: ignore[valid-type]
    out: ti.types.ndarray(),  # type: ignore[valid-type]
):
    for m in range(first.shape[0]):
        i, j, c = first[m], second[m], _row(separation, m, 3)
        along = 0.0 * c
        along[2] += 1.0
        axis_i, axis_j = rotated(_row(q, i, 4), along), rotated(_row(q, j, 4), along)
        sizes_i, sizes_j = _row(rod, i, 2), _row(rod, j, 2)
        gap, normal, _x, _y = closest_rods(c, axis_i, sizes_i[0], sizes_i[1], axis_j, sizes_j[0], sizes_j[1])
        _write(out, m, gap, normal)


@in_taichi_thread
@ti.kernel
def _superquadrics(
    family: ti.template(),  # type: ignore[valid-type]
    separation: ti.types.ndarray(),  # type: ignore[valid-type]
    first: ti.types.ndarray(),  # type: ignore[valid-type]
    second: ti.types.ndarray(),  # type: ignore[valid-type]
    q: ti.types.ndarray(),  # type: ignore[valid-type]
    axes: ti.types.ndarray(),  # type: ignore[valid-type]
    exponents: ti.types.ndarray(),  # type: ignore[valid-type]
    far: ti.f64,
    out: ti.types.ndarray(),  # type: ignore[valid-type]
):
    for m in range(first.shape[0]):
        i, j = first[m], second[m]
        here = _row(q, i, 4), _row(axes, i, 3), _row(exponents, i, 3)
        there = _row(q, j, 4), _row(axes, j, 3), _row(exponents, j, 3)
        gap, normal, _x, _y = closest_superquadrics(
            family, _row(separation, m, 3), here[0], here[1], here[2], there[0], there[1], there[2], far
        )
        _write(out, m, gap, normal)
