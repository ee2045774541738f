"""Pairs of particles for tests of the narrow phase, their gaps by kernels, and searches by other means."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.vectors import rotation_matrix
from tisim.shapes.rod_pairs import closest_rods, closest_spheres
from tisim.shapes.superquadric import power_sum_root
from tisim.shapes.superquadric_pairs import closest_superquadrics
from tisim.shapes.superquadric_points import ROD, SUPERQUADRICS


class Contact(NamedTuple):
    """Results for n pairs: gap, shape (n,), and normal and points relative to the centres, shape (n, 3)."""

    gap: np.ndarray
    normal: np.ndarray
    point_i: np.ndarray
    point_j: np.ndarray


class Bodies(NamedTuple):
    """One superquadric of each pair: orientation, semi-axes and exponents, shape (n, 3)."""

    turn: Rotation
    axes: np.ndarray
    exponents: np.ndarray

    def support(self, direction):
        """The points relative to the centres that are farthest along directions, shape (n, 3)."""
        a, g = self.axes, self.exponents
        n = self.turn.apply(direction, inverse=True)
        with np.errstate(divide="ignore"):
            logs = np.log(np.abs(a * n) / g)
        u = np.exp((logs - power_sum_root(g / (g - 1), logs)[:, None]) / (g - 1))
        return self.turn.apply(a * np.sign(n) * u)

    def level(self, point):
        """sum_k |x_k/a_k|^g_k of points relative to the centres, 1 on the surface."""
        x = self.turn.apply(point, inverse=True)
        return (np.abs(x / self.axes) ** self.exponents).sum(axis=1)

    def normal(self, point):
        """The unit normal (4.6) at points of the surface."""
        x = self.turn.apply(point, inverse=True) / self.axes
        n = self.exponents / self.axes * np.abs(x) ** (self.exponents - 1) * np.sign(x)
        return self.turn.apply(n / np.linalg.norm(n, axis=1)[:, None])

    def __getitem__(self, rows):
        return Bodies(self.turn[rows], self.axes[rows], self.exponents[rows])


@ti.func
def _vector(array: ti.template(), m, size: ti.template()):
    return ti.Vector([ti.cast(array[m, k], float) for k in ti.static(range(size))])


@ti.func
def _write(out: ti.template(), m, gap, normal, point_i, point_j):
    out[m, 0] = gap
    for k in ti.static(range(3)):
        out[m, 1 + k], out[m, 4 + k], out[m, 7 + k] = normal[k], point_i[k], point_j[k]


Array = ti.types.ndarray()


@ti.kernel
def _superquadrics(
    family: ti.template(), c: Array, qi: Array, ai: Array, gi: Array, qj: Array, aj: Array, gj: Array,
    far: ti.f64, out: Array,
):  # fmt: skip
    for m in range(c.shape[0]):
        i = _vector(qi, m, 4), _vector(ai, m, 3), _vector(gi, m, 3)
        j = _vector(qj, m, 4), _vector(aj, m, 3), _vector(gj, m, 3)
        gap, normal, x, y = closest_superquadrics(
            family, _vector(c, m, 3), i[0], i[1], i[2], j[0], j[1], j[2], far
        )
        _write(out, m, gap, normal, x, y)


@ti.kernel
def _rods(c: Array, qi: Array, rod_i: Array, qj: Array, rod_j: Array, out: Array):
    for m in range(c.shape[0]):
        turn_i, turn_j = rotation_matrix(_vector(qi, m, 4)), rotation_matrix(_vector(qj, m, 4))
        gap, normal, x, y = closest_rods(
            _vector(c, m, 3),
            ti.Vector([turn_i[0, 2], turn_i[1, 2], turn_i[2, 2]]),
            ti.cast(rod_i[m, 0], float),
            ti.cast(rod_i[m, 1], float),
            ti.Vector([turn_j[0, 2], turn_j[1, 2], turn_j[2, 2]]),
            ti.cast(rod_j[m, 0], float),
            ti.cast(rod_j[m, 1], float),
        )
        _write(out, m, gap, normal, x, y)


@ti.kernel
def _spheres(c: Array, radii: Array, out: Array):
    for m in range(c.shape[0]):
        up, r = ti.Vector([0.0, 0.0, 1.0]), _vector(radii, m, 2)
        gap, normal, x, y = closest_spheres(_vector(c, m, 3), r[0], r[1], up)
        _write(out, m, gap, normal, x, y)


def _contact(out):
    return Contact(out[:, 0], out[:, 1:4], out[:, 4:7], out[:, 7:10])


def quaternions(turn):
    """Unit quaternions (w, x, y, z)."""
    return turn.as_quat(scalar_first=True)


@in_taichi_thread
def superquadric_contacts(separation, i, j, far=1e30, family=SUPERQUADRICS):
    """Contacts of superquadrics by the kernel."""
    out = np.zeros((len(separation), 10))
    shape_i, shape_j = (
        (quaternions(one.turn), np.ascontiguousarray(one.axes), np.ascontiguousarray(one.exponents))
        for one in (i, j)
    )
    _superquadrics(family, np.ascontiguousarray(separation), *shape_i, *shape_j, far, out)
    return _contact(out)


@in_taichi_thread
def rod_contacts(separation, turn_i, rod_i, turn_j, rod_j):
    """Contacts of rods by the kernel; ``rod_i`` has half the lengths of segments and radii, shape (n, 2)."""
    out = np.zeros((len(separation), 10))
    _rods(separation, quaternions(turn_i), rod_i, quaternions(turn_j), rod_j, out)
    return _contact(out)


@in_taichi_thread
def sphere_contacts(separation, radius_i, radius_j):
    """Contacts of spheres by the kernel."""
    out = np.zeros((len(separation), 10))
    _spheres(separation, np.stack([radius_i, radius_j], axis=1), out)
    return _contact(out)


def unit(vectors):
    """Vectors of length 1 along vectors."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def random_bodies(rng, count, largest=20.0, aspect=10.0):
    """Superquadrics of volume about 8, with exponents from 2 to ``largest`` and aspect ratios up to
    ``aspect``: a sixth each of supercuboids, of ellipsoids, of the largest exponent, of equal axes, of
    spheres, and of unequal axes and exponents."""
    axes = aspect ** rng.uniform(-0.5, 0.5, (count, 3))
    axes /= np.cbrt(axes.prod(axis=1))[:, None]
    exponents = 2 * (largest / 2) ** rng.uniform(0, 1, (count, 3))
    kind = rng.integers(0, 6, count)
    exponents[kind == 0] = exponents[kind == 0][:, :1]
    exponents[(kind == 1) | (kind == 4)] = 2.0
    exponents[kind == 2] = largest
    axes[(kind == 3) | (kind == 4)] = 1.0
    return Bodies(Rotation.random(count, rng=rng), axes, exponents)


def beside(rng, i, j):
    """Bodies j of which a tenth is parallel to i, and a tenth nearly so."""
    count = len(i.axes)
    kind = rng.random((count, 1))
    small = Rotation.from_rotvec(unit(rng.normal(size=(count, 3))) * 10 ** rng.uniform(-8, -1, (count, 1)))
    near, own = quaternions(i.turn * small), quaternions(j.turn)
    turn = np.where(kind < 0.1, quaternions(i.turn), np.where(kind < 0.2, near, own))
    return Bodies(Rotation.from_quat(turn, scalar_first=True), j.axes, j.exponents)


def surface_point(rng, bodies):
    """A random point of each surface, in a random direction from the centre: more often on a face than in
    uniform directions of the normal, which are almost all normals of corners."""
    ray = bodies.axes * unit(rng.normal(size=bodies.axes.shape))
    beyond = np.exp(power_sum_root(bodies.exponents, np.log(np.abs(ray / bodies.axes))))
    return bodies.turn.apply(ray / beyond[:, None])


def touching(rng, i, j):
    """Common normals and separations of bodies that touch: half of them at random normals, half at random
    points of i."""
    count = len(i.axes)
    normal = unit(rng.normal(size=(count, 3)))
    point = i.support(normal)
    on_surface = rng.random(count) < 0.5
    chosen = surface_point(rng, i)
    normal = np.where(on_surface[:, None], i.normal(chosen), normal)
    point = np.where(on_surface[:, None], chosen, point)
    return normal, point + j.support(normal)


def plane_distance(normal, separation, i, j):
    """d(n) = n . (c - x_i(n) - x_j(n)), whose maximum over n is the gap."""
    return (normal * (separation - i.support(normal) - j.support(normal))).sum(axis=1)


def spiral(count):
    """Evenly distributed directions, shape (count, 3)."""
    rank = np.arange(count) + 0.5
    z, angle = 1 - 2 * rank / count, np.pi * (1 + np.sqrt(5)) * rank
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


def searched_gap(rng, separation, i, j, directions=2000, kept=12, rounds=60):
    """The largest d(n), without derivatives: the best directions of a spiral, and of the axes of both bodies
    and their products, followed by random search in caps that shrink around the best so far."""
    count = len(separation)
    axes = [one.turn.apply(np.tile(e, (count, 1))) for one in (i, j) for e in np.eye(3)]
    crossed = [np.cross(axes[k], axes[3 + m]) for k in range(3) for m in range(3)]
    crossed = [np.where(np.linalg.norm(n, axis=1)[:, None] > 1e-9, n, axes[0]) for n in crossed]
    starts = [*(np.tile(n, (count, 1)) for n in spiral(directions)), *map(unit, (*axes, *crossed))]
    starts = np.array([n * np.where((n * separation).sum(axis=1) < 0, -1, 1)[:, None] for n in starts])
    values = np.array([plane_distance(n, separation, i, j) for n in starts])
    best = np.full(count, -np.inf)
    for rank in np.argsort(-values, axis=0)[:kept]:
        rows = np.arange(count)
        n, value, cap = starts[rank, rows].copy(), values[rank, rows].copy(), np.full(count, 0.1)
        for _ in range(rounds):
            improved = np.zeros(count, bool)
            for _ in range(8):
                trial = unit(n + cap[:, None] * rng.normal(size=(count, 3)))
                d = plane_distance(trial, separation, i, j)
                better = d > value
                n[better], value[better] = trial[better], d[better]
                improved |= better
            cap *= np.where(improved, 1.0, 0.5)
        best = np.maximum(best, value)
    return best


class RodsOfPairs(NamedTuple):
    """One rod of each pair, with the methods of ``Bodies``: orientation, half the length of its segment and
    radius, shape (n,)."""

    turn: Rotation
    half: np.ndarray
    radius: np.ndarray

    @property
    def axes(self):
        return np.column_stack([self.radius, self.radius, self.half + self.radius])

    @property
    def exponents(self):
        return np.tile([2.0, 2.0, ROD], (len(self.half), 1))

    def support(self, direction):
        e = self.turn.apply([0, 0, 1])
        side = np.sign((e * direction).sum(axis=1))
        return self.radius[:, None] * direction + (side * self.half)[:, None] * e

    def away(self, point):
        """Vectors to points from the nearest points of the segments."""
        e = self.turn.apply([0, 0, 1])
        along = np.clip((e * point).sum(axis=1), -self.half, self.half)
        return point - along[:, None] * e

    def level(self, point):
        return np.linalg.norm(self.away(point), axis=1) / self.radius

    def normal(self, point):
        return unit(self.away(point))

    def __getitem__(self, rows):
        return RodsOfPairs(self.turn[rows], self.half[rows], self.radius[rows])
