"""The field of a uniformly magnetised cylinder far away: its multipoles, of which the first is the dipole."""

from __future__ import annotations

from tisim.backend.taichi import ti


@ti.func
def far_field(rho, z, radius, half, small):
    """Return the six functions of ``cylinder_field.shape`` at distances r > a = sqrt(R^2 + L^2).

    small : powers of (a/r)^2 below this are omitted.

    W = sum over even n of w_n P_n(z/r) / r^(n+1), w_n = R^2 a^(n+1) P'_(n+2)(L/a) / ((n+1) (n+2) (n+3)): on
    the axis W_zz is closed and 1 / sqrt((z + L)^2 + R^2) generates Legendre polynomials. Each derivative
    along z raises the order of P by one, each d/(rho d rho) differentiates P once more.
    """
    square = radius * radius + half * half
    distance = ti.sqrt(rho * rho + z * z)
    c, x = z / distance, half / ti.sqrt(square)
    # Legendre polynomials and derivatives of orders k - 1 and k, here for k = 1; x enters only through the
    # first derivatives.
    p, q = 1.0 + 0.0 * c, c
    dp, dq = 0.0 * c, 1.0 + 0.0 * c
    ddp, ddq = 0.0 * c, 0.0 * c
    xp, xq, dxp, dxq = 1.0 + 0.0 * x, x, 0.0 * x, 1.0 + 0.0 * x
    power = 1.0 + 0.0 * c
    zz, over, turn, cross, zzz, bend = 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c
    n, ratio = 0.0 * c, square / (distance * distance)
    while power > small:
        inverse = 1.0 / ((n + 1.0) * (n + 2.0) * (n + 3.0))
        second, third = (n + 1.0) * (n + 3.0) * inverse, (n + 1.0) * (n + 2.0) * inverse
        a, b, lead = 2.0 * n + 3.0, 2.0 * n + 5.0, dq
        # Up to order n + 2, and for the point then to order n + 3.
        xp, xq = xq, (a * x * xq - (n + 1.0) * xp) * second
        dxp, dxq = dxq, dxp + a * xp
        ddp, ddq = ddq, ddp + a * dq
        dp, dq = dq, dp + a * q
        p, q = q, (a * c * q - (n + 1.0) * p) * second
        moment = power * dxq
        zz += moment * third * q
        over += moment * inverse * lead
        turn += moment * inverse * ddq
        cross += moment * second * third * dq
        xp, xq = xq, (b * x * xq - (n + 2.0) * xp) * third
        dxp, dxq = dxq, dxp + b * xp
        ddp, ddq = ddq, ddp + b * dq
        dp, dq = dq, dp + b * q
        p, q = q, (b * c * q - (n + 2.0) * p) * third
        zzz += moment * q
        bend += moment * third * dq
        power *= ratio
        n += 2.0
    size = radius / distance * (radius / distance) * ti.sqrt(square) / distance
    return size * ti.Vector(
        [
            zz,
            -over,
            rho / distance * turn / distance,
            cross / distance,
            -zzz / distance,
            -bend / distance / distance,
        ]
    )
