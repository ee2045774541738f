"""The shortest distance of two superquadrics, or of a rod and a superquadric, by Newton's method for the
common normal.

The distance between the planes of normal n that touch both bodies, one from each side, is

    d(n) = n . c - h_i(n) - h_j(n),    h(n) = n . x(n)

with the separation c of the centres and the point x(n) of a body that is farthest along n, which is closed up
to a scalar equation. The largest d over all unit vectors n is the gap. At a maximum n is the common normal
(B16 (4.8)), and the points x are the points of contact. In place of the six coordinates of B16 (4.11) there
are two unknowns, both points are always on their surfaces, and every step is judged by d itself, which must
grow. For bodies apart d has a single maximum, so the method needs no start close to the solution, in
contrast to the k-d tree of surface points of B16. For bodies that overlap d may have several; the gap is the
largest of them, and its amount is the shortest translation that separates the bodies.

Newton's step is (M_i + M_j + s)^-1 g in the plane normal to n. M is the second derivative of h, whose
eigenvalues are the radii of curvature of the body at x, s = n . (c - x_i - x_j), and g is the tangential part
of c - x_i - x_j. Flat faces have infinite radii, and h has kinks there, which ``superquadric_points`` gives a
small width. Three measures suffice. The step is first tried in the positions x (``superquadric_steps``). If
that fails, it is made as it is, and if this fails by crossing a kink it is cut at the kink, within which the
next step of Newton finds the point of contact on the face.
"""

from tisim.backend.taichi import ti
from tisim.numerics.vectors import conjugate, product, rotated, rotation_matrix
from tisim.shapes.superquadric_points import ELLIPSOIDS, ROD, WITH_RODS, constants, support
from tisim.shapes.superquadric_steps import LARGEST_STEP, NOT_ZERO, step_in_positions

MOST_EVALUATIONS = 200
"""Largest number of evaluations from one start; 3 to 8 are usual, and more near edges and at depths that
equal the sum of the radii of curvature."""
LEAST_RADIUS = 1e-2
"""Smallest sum of radii of curvature and gap that a step assumes if d is not concave, relative to the
smallest semi-axis."""
CONCAVE = 1e-8
"""The sum, relative to the smallest semi-axis, down to which d counts as concave. At a depth equal to the
sum of the radii of curvature it is 0, and the steps then converge by a factor of 2/3 each."""
REQUIRED_SHARE = 0.05
"""Share of the predicted increase of d that a step must reach."""
STEP_CUT = 0.3
"""Factor by which a step is cut that fails without crossing a kink."""
CLOSE_KINK, FAR_KINK = 1e-3, 0.9
"""Part of a failed step within which a kink must be to cut the step there."""
LAST_INCREASE = 1e-18
"""Predicted increase of d at which the iteration ends, relative to the smallest semi-axis."""
PLANE_ROUNDING = 4e-15
"""Rounding error of d, relative to the sum of all semi-axes and components of the separation."""
DEEP_OVERLAP = 0.1
"""Depth of an overlap, relative to the smallest semi-axis, beyond which further starts are tried. Of 200,000
random pairs, the first start missed the largest d of none up to a depth of 0.21 and of one in 100 at 0.35."""
START_EXPONENT = 5
"""Exponents are at most this where the normals of bodies are estimated for the first start."""
MOST_STARTS = 17
"""The sum of three normals, the ellipsoid's normal, six axes, and nine products of axes."""


@ti.func
def closest_superquadrics(
    family: ti.template(),  # type: ignore[valid-type]
    separation,
    q_i,
    semi_axes_i,
    exponents_i,
    q_j,
    semi_axes_j,
    exponents_j,
    far,
):
    """Return gap (m), unit normal from i to j, and the points of contact (m), each relative to the centre of
    its particle.

    family : of all bodies of a scene (``superquadric_points``): exponents of ellipsoids are not read, and
        bodies may be rods if it is WITH_RODS. separation : centre of j
        minus centre of i (m). q_i, q_j : unit quaternions of the orientations. semi_axes_i, semi_axes_j : m.
        exponents_i, exponents_j : from 2 to 20. far : gap (m) beyond which pairs do not interact.

    The gap of particles that overlap is negative; its amount is the length of the shortest translation that
    separates them. Pairs that are proved to be farther apart than ``far`` are not computed to the end: their
    gap is a lower bound, not below ``far``, and their normal separates them. The normal of concentric
    particles is one of the two directions along which they overlap least.

    Everything is computed in f64: a component of the normal of a flat face is a high power of the position of
    the contact on it.
    """
    c0, p_i, p_j = ti.cast(separation, ti.f64), ti.cast(q_i, ti.f64), ti.cast(q_j, ti.f64)
    a_i, a_j = ti.cast(semi_axes_i, ti.f64), ti.cast(semi_axes_j, ti.f64)
    g_i, g_j = ti.cast(exponents_i, ti.f64), ti.cast(exponents_j, ti.f64)
    # All in the frame of i; the columns of ``turn`` are the axes of j.
    c, turn = rotated(conjugate(p_i), c0), rotation_matrix(product(conjugate(p_i), p_j))
    enough, size = ti.cast(far, ti.f64), ti.min(a_i.min(), a_j.min())
    # The first start of ellipsoids is the second of others.
    initial = ti.static(1 if family == ELLIPSOIDS else 0)
    best, start = ti.cast(0.0, ti.f64), initial
    n, x_i, x_j = 0.0 * c, 0.0 * c, 0.0 * c
    while start < MOST_STARTS and (start == initial or best < -DEEP_OVERLAP * size):
        # With steps in positions from all starts, one in a million deep overlaps missed the largest d.
        first = _start(c, turn, a_i, _of_start(family, g_i), a_j, _of_start(family, g_j), start)
        value, normal, y_i, y_j = _ascend(family, c, turn, a_i, g_i, a_j, g_j, first, enough, start == 0)
        if start == initial or value > best:
            best, n, x_i, x_j = value, normal, y_i, y_j
        start += 1
    gap = 0.0 * separation[0]
    gap = best
    unit, point_i, point_j = 0.0 * separation, 0.0 * separation, 0.0 * separation
    unit, point_i, point_j = rotated(p_i, n), rotated(p_i, x_i), rotated(p_i, x_j)
    return gap, unit, point_i, point_j


@ti.func
def _of_start(family: ti.template(), g):  # type: ignore[valid-type]
    """Return the exponents from which the normal of a body is estimated; a rod is flat along its segment."""
    powers = g
    if ti.static(family == WITH_RODS):
        powers = ti.select(g == ROD, 1.0 * START_EXPONENT, g)
    return powers


@ti.func
def _at_least_2(family: ti.template(), g):  # type: ignore[valid-type]
    """Return the exponents for steps in positions; the normal of a rod is changed as Newton's step says."""
    powers = g
    if ti.static(family == WITH_RODS):
        powers = ti.max(g, 2.0)
    return powers


@ti.func
def _start(c, turn, a_i, g_i, a_j, g_j, start):
    """Return one of the directions from which the normal is sought, in the half space of c.

    The second is normal to an ellipsoid around the sum of both bodies, n ~ (A_i^2 + A_j^2)^-1 c, and exact
    for two spheres. The first is the sum of this one and of the normals of both bodies in the directions in
    which the ellipsoids touch, A_i^2 n and A_j^2 n. The others are the normals of faces of boxes: the axes of
    i, the axes of j, and their products.
    """
    n = c
    kind, axis = (start + 1) // 3, (start + 1) % 3
    if kind == 0:
        square_i, square_j, back = a_i * a_i, a_j * a_j, turn.transpose()
        rows = [
            square_i * _unit(c, k) + turn @ (square_j * (back @ _unit(c, k))) for k in ti.static(range(3))
        ]
        # By Cramer's rule, without the determinant, which is positive.
        n = c[0] * rows[1].cross(rows[2]) + c[1] * rows[2].cross(rows[0]) + c[2] * rows[0].cross(rows[1])
        if start == 0:
            n = n / ti.max(n.norm(), NOT_ZERO)
            n += _normal_near(a_i * n, a_i, g_i) + turn @ _normal_near(a_j * (back @ n), a_j, g_j)
    elif kind == 1:
        n = _unit(c, axis)
    elif kind == 2:
        n = turn @ _unit(c, axis)
    else:
        n = _unit(c, axis).cross(turn @ _unit(c, kind - 3))
    side = ti.select(n.dot(c) < 0.0, -1.0, 1.0)
    size = n.norm()
    up = ti.Vector([0.0 * size, 0.0 * size, 1.0 + 0.0 * size])
    return ti.select(size > 0.0, side / ti.select(size > 0.0, size, 1.0) * n, up)


@ti.func
def _normal_near(u, a, g):
    """Return nearly the unit normal of a body in the direction of the point a_k u_k from its centre.

    Exponents above START_EXPONENT are replaced by it, and |u|^(g - 1) is interpolated between whole powers.
    """
    size = 1.0 / ti.max(ti.abs(u).max(), NOT_ZERO)
    n = g / a * u
    for k in ti.static(range(3)):
        for whole in ti.static(range(2, START_EXPONENT)):
            part = ti.min(ti.max(g[k] - whole, 0.0), 1.0)
            n[k] *= 1.0 - part + part * size * ti.abs(u[k])
    return n / ti.max(n.norm(), NOT_ZERO)


@ti.func
def _unit(like, k):
    """Return coordinate axis k as a vector of the type of ``like``."""
    zero = 0.0 * like[0]
    return ti.Vector([ti.select(k == axis, zero + 1.0, zero) for axis in ti.static(range(3))])


@ti.func
def _ascend(family: ti.template(), c, turn, a_i, g_i, a_j, g_j, start, far, in_positions):  # type: ignore[valid-type]
    """Return a maximum of d (m), its normal, and the points of contact relative to both centres (m), in the
    frame of i.

    in_positions : whether steps are first tried in the positions of the points of contact.
    """
    size = ti.min(a_i.min(), a_j.min())
    noise = PLANE_ROUNDING * (a_i.sum() + a_j.sum() + ti.abs(c).sum())
    back = turn.transpose()
    body_i, body_j = constants(family, a_i, g_i), constants(family, a_j, g_j)
    normal, trial, step, change = start, start, 0.0 * start, 0.0 * start
    x_i, x_j = 0.0 * c, 0.0 * c
    value, predicted, part = 0.0 * size, 0.0 * size, 0.0 * size
    pending, rounds, bent = 1, 0, 0
    while pending == 1 and rounds < MOST_EVALUATIONS:
        h_i, s_i, d_i, v_i, f_i = support(family, trial, body_i)
        h_j, s_j, d_j, v_j, f_j = support(family, back @ trial, body_j)
        d = c.dot(trial) - h_i - h_j
        if rounds == 0 or d >= value + REQUIRED_SHARE * part * predicted - noise:
            normal, value = trial, d
            apart = c - s_i - turn @ s_j
            # Two unit vectors normal to n and to each other (T. Duff et al., J. Comput. Graph. Tech. 6
            # (2017) 1).
            sign = ti.select(normal[2] < 0.0, -1.0, 1.0)
            f = -1.0 / (sign + normal[2])
            b = normal[0] * normal[1] * f
            t = ti.Vector([1.0 + sign * normal[0] * normal[0] * f, sign * b, -sign * normal[0]])
            u = ti.Vector([b, sign + normal[1] * normal[1] * f, -normal[1]])
            t_j, u_j = back @ t, back @ u
            tv_i, uv_i, tv_j, uv_j = v_i.dot(t), v_i.dot(u), v_j.dot(t_j), v_j.dot(u_j)
            s = apart.dot(normal)
            tt = (d_i * t).dot(t) - f_i * tv_i * tv_i + (d_j * t_j).dot(t_j) - f_j * tv_j * tv_j + s
            tu = (d_i * t).dot(u) - f_i * tv_i * uv_i + (d_j * t_j).dot(u_j) - f_j * tv_j * uv_j
            uu = (d_i * u).dot(u) - f_i * uv_i * uv_i + (d_j * u_j).dot(u_j) - f_j * uv_j * uv_j + s
            # If d is not concave, the radii are increased until the smallest is LEAST_RADIUS.
            mean, spread = 0.5 * (tt + uu), ti.sqrt(0.25 * (tt - uu) * (tt - uu) + tu * tu)
            large = ti.abs(mean) + spread
            least = ti.select(mean > 0.0, (tt * uu - tu * tu) / ti.max(large, NOT_ZERO), mean - spread)
            raised = ti.select(least > CONCAVE * size, 0.0, LEAST_RADIUS * size - least)
            tt, uu = tt + raised, uu + raised
            g_t, g_u, det = apart.dot(t), apart.dot(u), tt * uu - tu * tu
            s_t, s_u = (uu * g_t - tu * g_u) * (1.0 / det), (tt * g_u - tu * g_t) * (1.0 / det)
            step = s_t * t + s_u * u
            predicted = g_t * s_t + g_u * s_u
            part = ti.min(1.0, LARGEST_STEP / ti.max(step.norm(), NOT_ZERO))
            if predicted <= LAST_INCREASE * size or d > far:
                pending = 0
                # Only a step of Newton's that is the last one is right without a test.
                if predicted > LAST_INCREASE * size:
                    step *= 0.0
                # The points move as the radii of curvature give for the last step, which closes their
                # distance across n: on flat faces they are defined by the other body.
                step_j = back @ step
                x_i = s_i + d_i * step - f_i * v_i.dot(step) * v_i
                x_j = turn @ (-s_j - d_j * step_j + f_j * v_j.dot(step_j) * v_j)
                normal = _scaled_to_1(normal + step)
            change, bent = part * step, 0
            if ti.static(family != ELLIPSOIDS):  # noqa: SIM102
                if pending == 1 and in_positions:
                    along = part * ti.Vector([s_t, s_u])
                    here = normal, d_i, _at_least_2(family, g_i)
                    there = back @ normal, d_j, _at_least_2(family, g_j)
                    change, bent = step_in_positions(along, (t, u), (t_j, u_j), here, there)
        elif bent == 1:
            change, bent = part * step, 0
        else:
            # The nearest kink that the step crosses, of either body.
            limit, nearest = part, ti.cast(2.0, ti.f64)
            normal_j, step_j = back @ normal, back @ step
            for k in ti.static(range(3)):
                for n, v in ti.static(((normal, step), (normal_j, step_j))):
                    at = -n[k] / ti.select(v[k] == 0.0, 1.0, v[k])
                    inside = (at > CLOSE_KINK * limit) & (at < FAR_KINK * limit)
                    nearest = ti.min(nearest, ti.select(inside, at, 2.0))
            part = ti.select(nearest < 1.0, nearest, STEP_CUT * limit)
            change = part * step
        trial = _scaled_to_1(normal + change)
        rounds += 1
    return value, normal, x_i, x_j


@ti.func
def _scaled_to_1(v):
    """Return a vector divided by its length."""
    return 1.0 / v.norm() * v
