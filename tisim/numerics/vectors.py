"""Vectors, and unit quaternions (w, x, y, z) of rotations, in kernels."""

from tisim.backend.taichi import ti
from tisim.numerics import elementary


@ti.func
def piece(vector, begin: ti.template(), size: ti.template()):  # type: ignore[valid-type]
    """Return ``size`` components of a vector from ``begin`` on."""
    return ti.Vector([vector[begin + k] for k in ti.static(range(size))])


@ti.func
def rotated(q, v):
    """Return a vector turned by a unit quaternion: v + 2 w u x v + 2 u x (u x v), u = (x, y, z)."""
    u = ti.Vector([q[1], q[2], q[3]])
    twice = 2.0 * u.cross(v)
    return v + q[0] * twice + u.cross(twice)


@ti.func
def turned(v, turn):
    """Return a vector rotated about an axis, given the axis times the angle (rad).

    It is v + 2 (w u x v + u x (u x v)) / |q|^2 with q = (w, u), in f64: in single precision lengths would
    drift with every rotation by the rounding of the factors.
    """
    half, r = 0.5 * ti.cast(turn, ti.f64), ti.cast(v, ti.f64)
    angle = half.norm()
    cosine, u = elementary.cos(angle), half
    if angle > 0.0:
        u = elementary.sin(angle) / angle * half
    twice = 2.0 / (cosine * cosine + u.norm_sqr()) * u.cross(r)
    return r + cosine * twice + u.cross(twice)


@ti.func
def brought(v, before, after):
    """Return a body-fixed vector after its body has turned from one orientation to another, both quaternions.

    It is rotated by ``after`` times the inverse of ``before``, of length 1 or nearly so; in f64, as
    ``turned``.
    """
    q, r = product(ti.cast(after, ti.f64), conjugate(ti.cast(before, ti.f64))), ti.cast(v, ti.f64)
    u = ti.Vector([q[1], q[2], q[3]])
    twice = 2.0 / q.norm_sqr() * u.cross(r)
    return r + q[0] * twice + u.cross(twice)


@ti.func
def conjugate(q):
    """Return the quaternion of the inverse rotation."""
    return ti.Vector([q[0], -q[1], -q[2], -q[3]])


@ti.func
def product(p, q):
    """Return the quaternion of rotation q followed by p (W. R. Hamilton, 1844)."""
    u, v = ti.Vector([p[1], p[2], p[3]]), ti.Vector([q[1], q[2], q[3]])
    w = p[0] * q[0] - u.dot(v)
    r = p[0] * v + q[0] * u + u.cross(v)
    return ti.Vector([w, r[0], r[1], r[2]])


@ti.func
def random_orientation(u, v, w):
    """Return a uniformly distributed random rotation from three numbers in 0..1.

    Source: K. Shoemake, Uniform random rotations, Graphics Gems III (1992) 124.
    """
    a, b, p, q = 2.0 * ti.math.pi * v, 2.0 * ti.math.pi * w, ti.sqrt(1.0 - u), ti.sqrt(u)
    x, y, z = p * elementary.sin(a), p * elementary.cos(a), q * elementary.sin(b)
    return ti.Vector([q * elementary.cos(b), x, y, z])


@ti.func
def farthest_axis(a):
    """Return the coordinate axis at the largest angle to a vector, without a branch."""
    size, zero, one = ti.abs(a), 0.0 * a[0], 0.0 * a[0] + 1.0
    first = (size[0] <= size[1]) & (size[0] <= size[2])
    second = (size[1] <= size[2]) & ~first
    x, y = ti.select(first, one, zero), ti.select(second, one, zero)
    return ti.Vector([x, y, one - x - y])


@ti.func
def normal_to(a):
    """Return a unit vector normal to a unit vector."""
    return a.cross(farthest_axis(a)).normalized()


@ti.func
def turn_between(a, b):
    """Return the quaternion of the smallest rotation that brings one unit vector onto another.

    With the angle t between them, cos(t/2) = |a + b|/2 and sin(t/2) = |a - b|/2, both without cancellation.
    The axis is a x b; for opposite vectors, for which it is not defined, any vector normal to a serves.
    """
    across = a.cross(b)
    # By rounding a short product may be inclined to a.
    across -= across.dot(a) * a
    size = across.norm()
    axis = ti.select(size > 0.0, across / ti.select(size > 0.0, size, 1.0), normal_to(a))
    v = 0.5 * (a - b).norm() * axis
    return ti.Vector([0.5 * (a + b).norm(), v[0], v[1], v[2]])


@ti.func
def orientation_of(x, z):
    """Return the unit quaternion of the rotation that brings the axes x and z onto two unit vectors normal to
    each other."""
    zero, one = 0.0 * x[0], 0.0 * x[0] + 1.0
    first = turn_between(ti.Vector([zero, zero, one]), z)
    before = rotated(first, ti.Vector([one, zero, zero]))
    # About z by the angle t, with cos(t/2) and sin(t/2) as in turn_between.
    sine = ti.select(before.cross(x).dot(z) < 0.0, -0.5, 0.5) * (before - x).norm()
    return product(ti.Vector([0.5 * (before + x).norm(), sine * z[0], sine * z[1], sine * z[2]]), first)


@ti.func
def rotation_matrix(q):
    """Return the 3 x 3 matrix of a unit quaternion; its columns are the rotated coordinate axes."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return ti.Matrix(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
