"""The shortest distance of two superquadrics by Newton's method for the common normal.

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
of c - x_i - x_j. Flat faces have infinite radii: there h has a kink, across the plane in which a component of
n is 0 in the frame of the body. Two measures suffice. Components a n of the support function are replaced by
a sqrt(n^2 + KINK_WIDTH^2), and a step that fails by crossing a kink is cut at the kink, within which the next
step of Newton finds the point of contact on the face.
"""

from tisim.backend.taichi import ti
from tisim.numerics import elementary
from tisim.numerics.vectors import conjugate, product, rotated, rotation_matrix

KINK_WIDTH = 1e-11
"""Width of the kinks of the support function, relative to the semi-axes. It changes the gap by less than
twice this part of a semi-axis."""
MOST_EVALUATIONS = 200
"""Largest number of evaluations from one start; 4 to 12 are usual, up to 50 near
flat faces, and more at depths that equal the sum of the radii of curvature."""
LARGEST_STEP = 0.5
"""Largest step of the normal (rad)."""
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
NOT_ZERO = 1e-30
"""A number that in place of 0 prevents a division by it, which f32 can represent."""
DEEP_OVERLAP = 0.1
"""Depth of an overlap, relative to the smallest semi-axis, beyond which further starts are tried. Of 200,000
random pairs, the first start missed the largest d of none up to a depth of 0.19 and of one in 100 at 0.4."""
MOST_STARTS = 16
"""The ellipsoid's normal, six axes, and nine products of axes."""
MULTIPLIER_ROUNDS = 20
"""Largest number of iterations for the multiplier of a support point; 0 to 4 are usual."""


@ti.func
def closest_superquadrics(
    ellipsoids: ti.template(),  # type: ignore[valid-type]
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

    ellipsoids : True if all exponents of a scene are 2; they are then not read. separation : centre of j
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
    best, start = ti.cast(0.0, ti.f64), 0
    n, x_i, x_j = 0.0 * c, 0.0 * c, 0.0 * c
    while start < MOST_STARTS and (start == 0 or best < -DEEP_OVERLAP * size):
        first = _start(c, turn, a_i, a_j, start)
        value, normal, y_i, y_j = _ascend(ellipsoids, c, turn, a_i, g_i, a_j, g_j, first, enough)
        if start == 0 or value > best:
            best, n, x_i, x_j = value, normal, y_i, y_j
        start += 1
    gap = 0.0 * separation[0]
    gap = best
    unit, point_i, point_j = 0.0 * separation, 0.0 * separation, 0.0 * separation
    unit, point_i, point_j = rotated(p_i, n), rotated(p_i, x_i), rotated(p_i, x_j)
    return gap, unit, point_i, point_j


@ti.func
def farthest_point(ellipsoids: ti.template(), direction, semi_axes, exponents):  # type: ignore[valid-type]
    """Return the point (m, f64) of a superquadric that is farthest along a unit vector (f64), in the frame of
    the body."""
    a, g = ti.cast(semi_axes, ti.f64), ti.cast(exponents, ti.f64)
    _h, x, _d, _v, _f = _support(ellipsoids, direction, _constants(ellipsoids, a, g))
    return x


@ti.func
def _start(c, turn, a_i, a_j, start):
    """Return one of the directions from which the normal is sought, in the half space of c.

    The first is normal to an ellipsoid around the sum of both bodies, n ~ (A_i^2 + A_j^2)^-1 c, and exact for
    two spheres. The others are the normals of faces of boxes: the axes of i, those of j, and their products.
    """
    n = c
    kind, first = (start + 2) // 3, (start + 2) % 3
    if kind == 0:
        square_i, square_j, back = a_i * a_i, a_j * a_j, turn.transpose()
        rows = [
            square_i * _unit(c, k) + turn @ (square_j * (back @ _unit(c, k))) for k in ti.static(range(3))
        ]
        # By Cramer's rule, without the determinant, which is positive.
        n = c[0] * rows[1].cross(rows[2]) + c[1] * rows[2].cross(rows[0]) + c[2] * rows[0].cross(rows[1])
    elif kind == 1:
        n = _unit(c, first)
    elif kind == 2:
        n = turn @ _unit(c, first)
    else:
        n = _unit(c, first).cross(turn @ _unit(c, kind - 3))
    side = ti.select(n.dot(c) < 0.0, -1.0, 1.0)
    size = n.norm()
    up = ti.Vector([0.0 * size, 0.0 * size, 1.0 + 0.0 * size])
    return ti.select(size > 0.0, side / ti.select(size > 0.0, size, 1.0) * n, up)


@ti.func
def _unit(like, k):
    """Return coordinate axis k as a vector of the type of ``like``."""
    zero = 0.0 * like[0]
    return ti.Vector([ti.select(k == axis, zero + 1.0, zero) for axis in ti.static(range(3))])


@ti.func
def _ascend(ellipsoids: ti.template(), c, turn, a_i, g_i, a_j, g_j, start, far):  # type: ignore[valid-type]
    """Return a maximum of d (m), its normal, and the points of contact relative to both centres (m), in the
    frame of i."""
    size = ti.min(a_i.min(), a_j.min())
    noise = PLANE_ROUNDING * (a_i.sum() + a_j.sum() + ti.abs(c).sum())
    back = turn.transpose()
    body_i, body_j = _constants(ellipsoids, a_i, g_i), _constants(ellipsoids, a_j, g_j)
    normal, trial, step = start, start, 0.0 * start
    x_i, x_j = 0.0 * c, 0.0 * c
    value, predicted, part = 0.0 * size, 0.0 * size, 0.0 * size
    pending, rounds = 1, 0
    while pending == 1 and rounds < MOST_EVALUATIONS:
        h_i, s_i, d_i, v_i, f_i = _support(ellipsoids, trial, body_i)
        h_j, s_j, d_j, v_j, f_j = _support(ellipsoids, back @ trial, body_j)
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
        trial = _scaled_to_1(normal + part * step)
        rounds += 1
    return value, normal, x_i, x_j


@ti.func
def _scaled_to_1(v):
    """Return a vector divided by its length."""
    return 1.0 / v.norm() * v


@ti.func
def _constants(ellipsoids: ti.template(), a, g):  # type: ignore[valid-type]
    """Return the numbers that the support function of a body reads: a_k^2 for an ellipsoid; otherwise
    ln(a_k/g_k), g_k and 1/(g_k - 1)."""
    scale, inverse = a * a, 0.0 * a
    if ti.static(not ellipsoids):
        scale = ti.Vector([elementary.log(a[k] / g[k]) for k in ti.static(range(3))])
        inverse = 1.0 / (g - 1.0)
    return scale, g, inverse


@ti.func
def _support(ellipsoids: ti.template(), n, body):  # type: ignore[valid-type]
    """Return h(n) (m), the farthest point x along a unit vector n (m), and d, v and f of its derivative
    dx/dn = diag(d) - f v v^T (m).

    For an ellipsoid h^2 = sum_k (a_k n_k)^2. In general the farthest point is at

        |x_k/a_k| = u_k = (w_k/(g_k m))^(1/(g_k - 1)),    w_k = a_k sqrt(n_k^2 + KINK_WIDTH^2)

    and h = sum_k w_k u_k, with m such that the point is on the surface: with p_k = g_k/(g_k - 1),

        sum_k e_k = 1,    e_k = (w_k/(g_k m))^p_k,    w_k u_k = m g_k e_k

    ln m follows by Newton's method, for equal exponents in one step. With q_k = 1/(g_k - 1) and y_k = w_k
    u_k/(n_k^2 + KINK_WIDTH^2),

        x_k = y_k n_k,    d_k = y_k (q_k n_k^2 + KINK_WIDTH^2)/(n_k^2 + KINK_WIDTH^2)
        v_k = q_k x_k,    1/f = sum_k q_k w_k u_k
    """
    scale, g, q = body
    h, f, x, d, v = 0.0 * n[0], 0.0 * n[0], 0.0 * n, 0.0 * n, 0.0 * n
    if ti.static(ellipsoids):
        h = ti.sqrt((scale * n).dot(n))
        inverse = 1.0 / h
        x, d = inverse * scale * n, inverse * scale
        v, f = x, inverse
    else:
        width = KINK_WIDTH * KINK_WIDTH
        square = n * n + width
        p = g * q
        logs = scale + 0.5 * ti.Vector([elementary.log(square[k]) for k in ti.static(range(3))])
        log_m = logs.max()
        e = ti.Vector([elementary.exp(p[k] * (logs[k] - log_m)) for k in ti.static(range(3))])
        if g[0] == g[1] and g[1] == g[2]:
            total = e.sum()
            log_m += elementary.log(total) / p[0]
            e *= 1.0 / total
        else:
            searching, rounds = 1, 0
            while searching == 1 and rounds < MULTIPLIER_ROUNDS:
                total = e.sum()
                change = elementary.log(total) * total / p.dot(e)
                log_m += change
                if change < 1e-6:
                    # To second order this is exact to rounding.
                    e *= 1.0 - p * change * (1.0 - 0.5 * p * change)
                    searching = 0
                else:
                    e = ti.Vector([elementary.exp(p[k] * (logs[k] - log_m)) for k in ti.static(range(3))])
                rounds += 1
        heights = elementary.exp(log_m) * g * e
        h = heights.sum()
        inverse = 1.0 / square
        y = heights * inverse
        x = y * n
        d = y * (q * n * n + width) * inverse
        v, f = q * x, 1.0 / q.dot(heights)
    return h, x, d, v, f
