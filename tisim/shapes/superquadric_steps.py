"""Newton's step for the common normal of two superquadrics, made in the positions of the points of contact.

On a flat face or edge of a body the component n_k of the normal is a high power of the position of the point,
x_k ~ n_k^(1/(g_k - 1)) in the frame of the body, and Newton's method in n takes many steps where x_k has to
change by a part of itself: its step is right for x_k and far off for n_k. So the two components of largest
dx_k/dn_k, of either body, are changed from n_k to

    n_k (1 + r)^(g_k - 1),    r = s_k/((g_k - 1) n_k)

where s_k is their change in Newton's step and r the relative change of x_k. For small r both steps are equal.
Two components define the normal unless they change along nearly the same direction; then only the first one
is changed in this way.
"""

from tisim.backend.taichi import ti
from tisim.numerics import elementary
from tisim.shapes.superquadric_points import KINK_WIDTH

LARGEST_STEP = 0.5
"""Largest step of the normal (rad)."""
NOT_ZERO = 1e-30
"""A number that in place of 0 prevents a division by it, which f32 can represent."""
FLAT = 0.1
"""Largest square of a component that may be changed: the normal of a face has two small ones."""
STRAIGHT = 1e-2
"""Relative change of x up to which Newton's step is made as it is."""
LEAST_SINE_SQUARE = 0.1
"""Square of the sine of the angle between the directions of two components, from which both define a step."""
LARGEST_COMPONENT = 0.3
"""Largest component after a step, unless it was larger before."""
LINEAR = 4.0 * KINK_WIDTH
"""Components below which x is proportional to n."""


@ti.func
def step_in_positions(step, tangents, tangents_j, body_i, body_j):
    """Return a step of the normal in the frame of i, and whether it differs from Newton's.

    step : Newton's step, along the two tangents. tangents, tangents_j : two unit vectors normal to n and to
    each other, in the frames of both bodies. body_i, body_j : the normal, the diagonal d of the derivative of
    the farthest point (m), and the exponents of each body, in its frame.
    """
    t, u = tangents
    n, g = _joined(body_i[0], body_j[0]), _joined(body_i[2], body_j[2])
    d, along_t, along_u = _joined(body_i[1], body_j[1]), _joined(t, tangents_j[0]), _joined(u, tangents_j[1])
    first, second, steepest, next_slope = 0, 0, 0.0 * step[0], 0.0 * step[0]
    for k in ti.static(range(6)):
        slope = ti.select(n[k] * n[k] < FLAT, d[k], 0.0)
        above_first, above_second = slope > steepest, slope > next_slope
        second = ti.select(above_first, first, ti.select(above_second, k, second))
        next_slope = ti.select(above_first, steepest, ti.select(above_second, slope, next_slope))
        first, steepest = ti.select(above_first, k, first), ti.select(above_first, slope, steepest)
    p, q = ti.Vector([along_t[first], along_u[first]]), ti.Vector([along_t[second], along_u[second]])
    change_p, change_q = p.dot(step), q.dot(step)
    ratio_p, ratio_q = _ratio(n[first], change_p, g[first]), _ratio(n[second], change_q, g[second])
    result, bent = step, 0
    if steepest > 0.0 and ti.max(ti.abs(ratio_p - 1.0), ti.abs(ratio_q - 1.0)) > STRAIGHT:
        bent = 1
        new_p = _change(n[first], change_p, ratio_p, g[first])
        new_q = _change(n[second], change_q, ratio_q, g[second])
        sine = p[0] * q[1] - p[1] * q[0]
        square = p.norm_sqr()
        if next_slope > 0.0 and sine * sine > LEAST_SINE_SQUARE * square * q.norm_sqr():
            result = ti.Vector([new_p * q[1] - new_q * p[1], new_q * p[0] - new_p * q[0]]) / sine
        else:
            result = step + (new_p - change_p) / square * p
        result *= ti.min(1.0, LARGEST_STEP / ti.max(result.norm(), NOT_ZERO))
    return result[0] * t + result[1] * u, bent


@ti.func
def _joined(a, b):
    """Return the components of two vectors as one vector."""
    return ti.Vector([a[0], a[1], a[2], b[0], b[1], b[2]])


@ti.func
def _ratio(n, change, g):
    """Return the ratio of x after and before Newton's step, by which a component n changes."""
    linear = ti.abs(n) < LINEAR
    return ti.select(linear, 1.0, 1.0 + change / ti.select(linear, 1.0, (g - 1.0) * n))


@ti.func
def _change(n, change, ratio, g):
    """Return the change of a component n for which x changes by a ratio."""
    result = change
    if ti.abs(n) >= LINEAR:
        size = ti.abs(n) * elementary.pow(ti.abs(ratio), g - 1.0)
        size = ti.min(size, ti.max(LARGEST_COMPONENT, ti.abs(n)))
        result = ti.select(ratio * n < 0.0, -size, size) - n
    return result
