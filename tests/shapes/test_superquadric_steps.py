"""Steps of the common normal in the positions of the points of contact, against the power law by which they
are defined."""

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.shapes.superquadric_steps import STRAIGHT, step_in_positions


@ti.func
def _row(array: ti.template(), k):
    return ti.Vector([array[k, 0], array[k, 1], array[k, 2]])


@ti.kernel
def _step(
    along: ti.types.ndarray(), tangents: ti.types.ndarray(), n: ti.types.ndarray(), d: ti.types.ndarray(),
    g: ti.types.ndarray(), out: ti.types.ndarray(),
):  # fmt: skip
    for _ in range(1):
        t, u, t_j, u_j = _row(tangents, 0), _row(tangents, 1), _row(tangents, 2), _row(tangents, 3)
        here, there = (_row(n, 0), _row(d, 0), _row(g, 0)), (_row(n, 1), _row(d, 1), _row(g, 1))
        change, bent = step_in_positions(ti.Vector([along[0], along[1]]), (t, u), (t_j, u_j), here, there)
        for k in ti.static(range(3)):
            out[k] = change[k]
        out[3] = bent


class Face:
    """A face of i that meets a corner of j: the normal in both frames, and the slopes dx/dn of i and j."""

    def __init__(self, exponent, first=0.02):
        self.n = np.array([first, -0.05, np.sqrt(1 - first**2 - 0.05**2)])
        back = Rotation.from_rotvec([0.5, 0.9, -0.3])
        self.normals = np.array([self.n, back.apply(self.n)])
        self.tangents = np.linalg.svd(self.n[None])[2][1:]
        self.in_j = back.apply(self.tangents)
        self.slopes = np.array([[30.0, 20.0, 0.3], [0.3, 0.3, 0.3]])
        self.exponents = np.array([[exponent] * 3, [exponent] * 3])

    @in_taichi_thread
    def step(self, change):
        """The step for Newton's step ``change`` of the normal, and whether it differs."""
        out = np.zeros(4)
        _step(
            self.tangents @ change,
            np.ascontiguousarray(np.vstack([self.tangents, self.in_j])),
            self.normals,
            self.slopes,
            self.exponents,
            out,
        )
        return out[:3], bool(out[3])

    def newton(self, first, second):
        """The step in the tangential plane that changes components 0 and 1 by these numbers."""
        return self.tangents.T @ np.linalg.solve(self.tangents[:, :2].T, [first, second])


def test_components_of_a_face_change_as_a_power_of_the_position():
    """Also if the point moves across the middle of the face, where the component changes its sign."""
    face = Face(5.0)
    for size in (0.05, -0.12, -0.2):
        newton = face.newton(size, size / 2)
        change, bent = face.step(newton)
        ratio = 1 + newton[:2] / (4 * face.n[:2])
        expected = np.sign(ratio) * face.n[:2] * np.abs(ratio) ** 4
        assert bent
        np.testing.assert_allclose(face.n[:2] + change[:2], expected, rtol=1e-12)
        assert abs(change @ face.n) < 1e-15


def test_short_steps_and_those_of_ellipsoids_are_newtons():
    short = 1e-3 * STRAIGHT
    newton = Face(5.0).newton(short, short)
    change, bent = Face(5.0).step(newton)
    assert not bent
    np.testing.assert_allclose(change, newton, rtol=1e-12)
    newton = Face(2.0).newton(0.1, 0.05)
    np.testing.assert_allclose(Face(2.0).step(newton)[0], newton, rtol=1e-12)


def test_a_component_within_the_kink_changes_as_in_newtons_step():
    face = Face(5.0, first=0.0)
    change, bent = face.step(face.newton(1e-9, 0.04))
    assert bent
    np.testing.assert_allclose(change[:2], [1e-9, -0.05 * (0.8**4 - 1)], rtol=1e-9)
