"""The point of a superquadric or a rod that is farthest along a direction, and its derivative.

Flat faces and edges have infinite radii of curvature: there the support function h(n) = n . x(n) has a
kink, across the plane in which a component of n is 0 in the frame of the body. Components a n are therefore
replaced by a sqrt(n^2 + KINK_WIDTH^2). So is the component of the segment of a rod.

Kernels know the families of the bodies of a scene: only ellipsoids, superquadrics, or superquadrics and rods.
In the last case a rod of radius R and a segment of length L has the semi-axes (R, R, L/2 + R) and the
exponents (2, 2, ROD).
"""

from tisim.backend.taichi import ti
from tisim.numerics import elementary

ELLIPSOIDS, SUPERQUADRICS, WITH_RODS = range(3)
"""Families of the bodies of a scene."""
ROD = 0.0
"""The third exponent of a rod."""
KINK_WIDTH = 1e-11
"""Width of the kinks of the support function, relative to the semi-axes. It changes the gap by less than
twice this part of a semi-axis."""
MULTIPLIER_ROUNDS = 20
"""Largest number of iterations for the multiplier of a support point; 0 to 4 are usual."""


@ti.func
def farthest_point(family: ti.template(), direction, semi_axes, exponents):  # type: ignore[valid-type]
    """Return the point (m, f64) of a superquadric that is farthest along a unit vector (f64), in the frame of
    the body."""
    a, g = ti.cast(semi_axes, ti.f64), ti.cast(exponents, ti.f64)
    _h, x, _d, _v, _f = support(family, direction, constants(family, a, g))
    return x


@ti.func
def constants(family: ti.template(), a, g):  # type: ignore[valid-type]
    """Return the numbers that the support function of a body reads: a_k^2 for an ellipsoid, a_k for a rod;
    otherwise ln(a_k/g_k), g_k and 1/(g_k - 1)."""
    scale, inverse = a * a, 0.0 * a
    if ti.static(family == SUPERQUADRICS):
        scale, inverse = _logarithms(a, g)
    elif ti.static(family == WITH_RODS):
        scale = a
        if g[2] != ROD:
            scale, inverse = _logarithms(a, g)
    return scale, g, inverse


@ti.func
def _logarithms(a, g):
    return ti.Vector([elementary.log(a[k] / g[k]) for k in ti.static(range(3))]), 1.0 / (g - 1.0)


@ti.func
def support(family: ti.template(), n, body):  # type: ignore[valid-type]
    """Return h(n) (m), the farthest point x along a unit vector n (m), and d, v and f of its derivative
    dx/dn = diag(d) - f v v^T (m), in the plane normal to n.

    For an ellipsoid h^2 = sum_k (a_k n_k)^2. For a superquadric see ``_superquadric``. For a rod

        h = R + L/2 q,    x = R n + L/2 (n_z/q) z,    d = (R, R, R + L/2 KINK_WIDTH^2/q^3)

    with q^2 = n_z^2 + KINK_WIDTH^2.
    """
    scale, g, q = body
    h, f, x, d, v = 0.0 * n[0], 0.0 * n[0], 0.0 * n, 0.0 * n, 0.0 * n
    if ti.static(family == ELLIPSOIDS):
        h = ti.sqrt((scale * n).dot(n))
        inverse = 1.0 / h
        x, d = inverse * scale * n, inverse * scale
        v, f = x, inverse
    elif ti.static(family == SUPERQUADRICS):
        h, x, d, v, f = _superquadric(n, scale, g, q)
    else:
        if g[2] == ROD:
            half, width = scale[2] - scale[0], KINK_WIDTH * KINK_WIDTH
            root = ti.sqrt(n[2] * n[2] + width)
            h, x, d = scale[0] + half * root, scale[0] * n, 0.0 * n + scale[0]
            x[2] += half * n[2] / root
            d[2] += half * (width / (root * root)) / root
        else:
            h, x, d, v, f = _superquadric(n, scale, g, q)
    return h, x, d, v, f


@ti.func
def _superquadric(n, scale, g, q):
    """Return ``support`` of a superquadric.

    The farthest point is at

        |x_k/a_k| = u_k = (w_k/(g_k m))^(1/(g_k - 1)),    w_k = a_k sqrt(n_k^2 + KINK_WIDTH^2)

    and h = sum_k w_k u_k, with m such that the point is on the surface: with p_k = g_k/(g_k - 1),

        sum_k e_k = 1,    e_k = (w_k/(g_k m))^p_k,    w_k u_k = m g_k e_k

    ln m follows by Newton's method, for equal exponents in one step. With q_k = 1/(g_k - 1) and y_k = w_k
    u_k/(n_k^2 + KINK_WIDTH^2),

        x_k = y_k n_k,    d_k = y_k (q_k n_k^2 + KINK_WIDTH^2)/(n_k^2 + KINK_WIDTH^2)
        v_k = q_k x_k,    1/f = sum_k q_k w_k u_k
    """
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
    inverse = 1.0 / square
    y = heights * inverse
    x = y * n
    d = y * (q * n * n + width) * inverse
    return heights.sum(), x, d, q * x, 1.0 / q.dot(heights)
