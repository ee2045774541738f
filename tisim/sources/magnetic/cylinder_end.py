"""One end of a uniformly magnetised cylinder: the functions from which its field and gradient are computed.

Let W(r) = 1/(4 pi) integral dV' / |r - r'| over the cylinder. Then H_i = sum_j d_i d_j W M_j, so field and
gradient are the second and third derivatives of W, and each of them is a difference between the two ends.
Each end is replaced by the end of a half-infinite cylinder of radius R that extends away from the point. The
point is at a distance u >= 0 in front of the end, measured along the axis; V is the W of the half-infinite
cylinder. With rho the distance from the axis, and subscripts for derivatives, six numbers describe it, in
this order:

    V_uu,  V_rho / rho,  rho (V_rho / rho)_rho / rho,  V_rho u / rho,  V_uuu,  V_rho uu / rho

All other derivatives follow from Laplace's equation. The six numbers go smoothly to 0 far away and are free
of cancellation.
"""

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics.elliptic import elliptic, limits

SLIM = 1.0 / 36.0
"""The series about the axis is used if (rho / distance to the rim)^2 is below this, with the distance from
the axis."""
SERIES_BELOW = {ti.f64: 1e-18, ti.f32: 1e-9}
"""Powers below this are omitted from a series."""


def small() -> float:
    """Return ``SERIES_BELOW`` for the precision in use."""
    return SERIES_BELOW[runtime.current().real]


@ti.func
def two_ends(rho, u, radius):
    """Return the six numbers of two ends, (6, 2); rho >= 0, both u >= 0 and radius > 0 in one unit of length.

    Both are computed side by side, because each alone would wait for its own divisions and roots.
    """
    far = u * u + radius * radius
    slim = rho * rho < SLIM * far
    both = ti.Matrix([[0.0 * rho, 0.0 * rho] for _ in range(6)])
    if not (slim[0] and slim[1]):
        both = off_axis(rho, u, radius, False)[0]
    # One test for most points, which are far from the axis for both ends.
    for k in range(ti.select(slim[0] or slim[1], 2, 0)):
        first = k == 0
        if ti.select(first, slim[0], slim[1]):
            one = near_axis(rho, ti.select(first, u[0], u[1]), radius, ti.select(first, far[0], far[1]))
            for i in ti.static(range(6)):
                both[i, 0] = ti.select(first, one[i], both[i, 0])
                both[i, 1] = ti.select(first, both[i, 1], one[i])
    return both


@ti.func
def end(rho, u, radius):
    """Return the six numbers of one end."""
    both = two_ends(rho, ti.Vector([u, u]), radius)
    return ti.Vector([both[i, 0] for i in ti.static(range(6))])


class ClosedEnds:
    """Ends from closed forms, accurate to the working precision.

    far : the series of the whole cylinder is used if (distance from the centre / distance of the rim from the
    centre)^2 is above this. small : powers below this are omitted from that series.
    """

    far = 36.0

    def __init__(self) -> None:
        self.small = small()

    @ti.func
    def both(self, rho, u, radius):
        return two_ends(rho, u, radius)

    @ti.func
    def mostly(self, rho, u, radius):
        """Return the six numbers of two ends without a loop or a branch, and whether they are valid; they are
        at most points."""
        both, met = off_axis(rho, u, radius, True)
        slim = rho * rho < SLIM * (u * u + radius * radius)
        return both, met and not (slim[0] or slim[1])


@ti.func
def near_axis(rho, u, radius, far):
    """Return the six numbers of an end by the power series in rho of an axisymmetric harmonic function, whose
    values on the axis have a closed form.

    V_uuu(0, u) = R^2 / (2 d^3), d^2 = far = u^2 + R^2, and its k-th derivative is V_uuu(0, u) times (-1)^k k!
    C_k(u/d) / d^k, with Gegenbauer's C_k of order 3/2.
    """
    d = ti.sqrt(far)
    c, t = u / d, -rho * rho / far
    # C_2j and C_2j+1, t^j, and (1/2)_j / j!, each with its own factor of j in the sums.
    even, odd, power, part = 1.0 + 0.0 * c, 3.0 * c, 1.0 + 0.0 * c, 1.0 + 0.0 * c
    uu, over, turn, cross, uuu, bend = 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c
    j = 0.0 * c
    while ti.abs(power) > ti.static(small()):
        k = 2.0 * j
        inverse = 1.0 / ((j + 1.0) * (j + 2.0) * (k + 3.0))
        next, shared = 0.5 * (j + 2.0) * (k + 3.0) * inverse, (j + 2.0) * (k + 3.0) * inverse
        term = power * part
        uuu += term * even
        cross += term * shared * even
        bend += term * shared * (k + 1.0) * odd
        term *= (k + 1.0) * next
        # (1/2)_(j+1) / (j+1)! and the same over j + 2.
        over_next = (j + 1.0) * (k + 3.0) * inverse
        turn += term * over_next * odd
        uu += term * next * odd
        over += term * over_next * next * odd
        even = (2.0 * k + 5.0) * next * c * odd - (k + 3.0) * next * even
        after = (j + 1.0) * (j + 2.0) * inverse
        odd = (2.0 * k + 7.0) * after * c * even - (k + 4.0) * after * odd
        part *= (k + 1.0) * next
        power *= t
        j += 1.0
    area = radius * radius / far
    tip = 1.0 / (1.0 + c)
    return area * ti.Vector(
        [
            -0.5 * (tip + t * uu),
            0.25 * (tip + t * over),
            -0.25 * rho / far * turn,
            -0.25 / d * cross,
            0.5 / d * uuu,
            0.25 / far * bend,
        ]
    )


@ti.func
def off_axis(rho, u, radius, mostly: ti.template()):  # type: ignore[valid-type]
    """Return the six numbers of two ends, (6, 2), by closed forms in complete elliptic integrals, evaluated
    by the sums of ``elliptic``, and whether these have converged; mostly : as in ``elliptic``.

    The second derivatives are B16 Eqs (5.3)-(5.6), (5.20)-(5.22). The third derivatives are the field of a
    current loop (W. R. Smythe, Static and Dynamic Electricity, 1950, section 7.10).
    """
    least = ti.static(limits()[1])
    total, gap, product = rho + radius, rho - radius, rho * radius
    inside = gap < 0.0
    # Each division is done only once.
    over_rho, over_total, over_product = 1.0 / rho, 1.0 / total, 0.25 / product
    wide = total * total
    reach = u * u + wide
    over_s = 1.0 / ti.sqrt(reach)
    over_reach = over_s * over_s
    beta, m, n = u * over_s, 4.0 * product * over_reach, 4.0 * product * over_total * over_total
    size = ti.max(ti.abs(gap) * over_total, least)
    gamma = ti.select(inside, -size, size)
    over_gamma = 1.0 / gamma
    kc = ti.max(ti.sqrt(u * u + gap * gap) * over_s, least)
    rest = n * (size * size + beta * beta)
    k, sigma, third, other, met = elliptic(kc, reach * over_product, size, ti.abs(over_gamma), rest, mostly)
    # The same difference in two forms: each loses digits if the other does not.
    lift = ti.select(
        gamma < 0.5,
        1.0 - 0.5 * (1.0 + gamma) * (third * over_gamma),
        0.5 * ((1.0 + gamma) * other - (1.0 - gamma)) * over_gamma,
    )
    uu = 0.5 * beta * (1.0 - gamma) * k * lift
    ratio = radius * over_rho * (radius * over_rho)
    part = 2.0 * radius * over_total * (radius * over_total) * beta * k
    over = -part * wide * (over_reach * sigma + over_product * other)
    slope = (1.0 - gamma) * (1.0 + 0.5 * (1.0 - gamma) * (third * over_gamma)) + 2.0 * m * sigma
    turn = part * wide * over_product * slope
    square = kc * kc
    over_square, volume = 1.0 / square, radius * k * over_reach * over_s
    e = 1.0 - 0.5 * m - 0.5 * m * m * sigma
    rim = (square * reach - (gap * total + u * u) * e) / radius
    away = 2.0 * radius + 2.0 * m * rho * sigma - total * m * (1.0 + m * sigma)
    both = ti.Matrix.rows(
        [
            uu - ti.select(inside, 0.5, 0.0),
            over + 0.25 * ti.select(inside, 1.0, ratio),
            (turn - 0.5 * ti.select(inside, 0.0, ratio)) * over_rho,
            -4.0 * radius * volume * sigma,
            0.5 * volume * over_square * ti.select(m < 0.5, away, rim),
            2.0 * radius * u * volume * over_reach * over_square * (1.0 - sigma * (2.0 - m)),
        ]
    )
    return both, met
