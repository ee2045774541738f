"""Rotations by unit quaternions in kernels, against SciPy."""

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics.vectors import normal_to, orientation_of, product, rotated, rotation_matrix, turn_between

Array = ti.types.ndarray()


@ti.func
def _read(array: ti.template(), m, size: ti.template()):
    return ti.Vector([array[m, k] for k in ti.static(range(size))])


@in_taichi_thread
@ti.kernel
def _turn(q: Array, v: Array, by_quaternion: Array, by_matrix: Array):
    for m in range(q.shape[0]):
        first = rotated(_read(q, m, 4), _read(v, m, 3))
        second = rotation_matrix(_read(q, m, 4)) @ _read(v, m, 3)
        for k in ti.static(range(3)):
            by_quaternion[m, k], by_matrix[m, k] = first[k], second[k]


@in_taichi_thread
@ti.kernel
def _multiply(p: Array, q: Array, out: Array):
    for m in range(q.shape[0]):
        r = product(_read(p, m, 4), _read(q, m, 4))
        for k in ti.static(range(4)):
            out[m, k] = r[k]


@in_taichi_thread
@ti.kernel
def _between(a: Array, b: Array, turn: Array, normal: Array):
    for m in range(a.shape[0]):
        q, n = turn_between(_read(a, m, 3), _read(b, m, 3)), normal_to(_read(a, m, 3))
        for k in ti.static(range(4)):
            turn[m, k] = q[k]
        for k in ti.static(range(3)):
            normal[m, k] = n[k]


@in_taichi_thread
@ti.kernel
def _axes(x: Array, z: Array, turn: Array):
    for m in range(x.shape[0]):
        q = orientation_of(_read(x, m, 3), _read(z, m, 3))
        for k in ti.static(range(4)):
            turn[m, k] = q[k]


def unit(v):
    return v / np.linalg.norm(v, axis=1)[:, None]


def test_quaternions_rotate_and_multiply_as_in_scipy(rng):
    p, q = (Rotation.random(1000, rng=rng) for _ in range(2))
    v = rng.normal(size=(1000, 3))
    by_quaternion, by_matrix, both = np.zeros((1000, 3)), np.zeros((1000, 3)), np.zeros((1000, 4))
    _turn(q.as_quat(scalar_first=True), v, by_quaternion, by_matrix)
    np.testing.assert_allclose(by_quaternion, q.apply(v), rtol=0, atol=1e-14)
    np.testing.assert_allclose(by_matrix, q.apply(v), rtol=0, atol=1e-14)
    _multiply(p.as_quat(scalar_first=True), q.as_quat(scalar_first=True), both)
    np.testing.assert_allclose(
        Rotation.from_quat(both, scalar_first=True).apply(v), (p * q).apply(v), atol=1e-14
    )


def test_the_smallest_rotation_between_two_vectors_is_about_their_common_normal(rng):
    """Also for vectors that are parallel or opposite, exactly or up to any small angle."""
    a = unit(rng.normal(size=(6000, 3)))
    a[:3] = np.eye(3)
    b = unit(rng.normal(size=(6000, 3)))
    tilt = 10 ** rng.uniform(-18, -1, (4000, 1)) * rng.normal(size=(4000, 3))
    b[:2000], b[2000:4000] = unit(a[:2000] + tilt[:2000]), -unit(a[2000:4000] + tilt[2000:])
    b[:3], b[3:1000], b[2000:3000] = -a[:3], a[3:1000], -a[2000:3000]
    turn, normal = np.zeros((6000, 4)), np.zeros((6000, 3))
    _between(a, b, turn, normal)
    np.testing.assert_allclose(np.linalg.norm(turn, axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose(Rotation.from_quat(turn, scalar_first=True).apply(a), b, rtol=0, atol=5e-15)
    np.testing.assert_allclose((turn[:, 1:] * a).sum(axis=1), 0, atol=1e-15)
    angle = np.arccos((a * b)[4000:].sum(axis=1))
    np.testing.assert_allclose(2 * np.arccos(turn[4000:, 0]), angle, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose((normal * a).sum(axis=1), 0, atol=1e-15)


def test_an_orientation_is_given_by_two_axes(rng):
    """Also along the coordinate axes, where half of the turns are by 180 degrees."""
    frames = Rotation.random(1000, rng=rng).as_matrix()
    frames[:24] = Rotation.create_group("O").as_matrix().round()
    turn = np.zeros((1000, 4))
    x, z = np.ascontiguousarray(frames[:, :, 0]), np.ascontiguousarray(frames[:, :, 2])
    _axes(x, z, turn)
    np.testing.assert_allclose(np.linalg.norm(turn, axis=1), 1, rtol=1e-14)
    found = Rotation.from_quat(turn, scalar_first=True).as_matrix()
    np.testing.assert_allclose(found, frames, rtol=0, atol=1e-14)
