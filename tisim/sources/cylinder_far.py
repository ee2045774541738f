"""A uniformly magnetised cylinder from far away: its multipoles, of which the first is the dipole."""

from __future__ import annotations

from tisim import runtime
from tisim._taichi import ti

FAR = 36.0
"""(distance from the centre / distance of the rim from it)^2 from where the series is used."""
TERMS = {ti.f64: 12, ti.f32: 5}


def terms() -> int:
    """``TERMS`` of the precision that runs."""
    return TERMS[runtime.current().real]


@ti.func
def far_away(rho, z, radius, half):
    """What ``cylinder_field.shape`` gives, at distances r > a = sqrt(R^2 + L^2).

    W = sum over even n of w_n P_n(z/r) / r^(n+1), w_n = R^2 a^(n+1) P'_(n+2)(L/a) / ((n+1) (n+2) (n+3)): on
    the axis W_zz is closed and 1 / sqrt((z + L)^2 + R^2) generates Legendre polynomials. Each derivative
    along z raises the order of P by one, each d/(rho d rho) differentiates P once more.
    """
    square = radius * radius + half * half
    distance = ti.sqrt(rho * rho + z * z)
    c, x = z / distance, half / ti.sqrt(square)
    # Legendre polynomials and derivatives of orders k - 1 and k, here of k = 1; x enters with the first only.
    p, q = 1.0 + 0.0 * c, c
    dp, dq = 0.0 * c, 1.0 + 0.0 * c
    ddp, ddq = 0.0 * c, 0.0 * c
    xp, xq, dxp, dxq = 1.0 + 0.0 * x, x, 0.0 * x, 1.0 + 0.0 * x
    power = 1.0 + 0.0 * c
    zz, over, turn, cross, zzz, bend = 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c, 0.0 * c
    for i in ti.static(range(terms())):
        n = ti.static(2 * i)
        # To order n + 2, and its neighbours.
        xp, xq = xq, ((2 * n + 3) * x * xq - (n + 1) * xp) / (n + 2)
        dxp, dxq = dxq, dxp + (2 * n + 3) * xp
        first = dq
        ddp, ddq = ddq, ddp + (2 * n + 3) * dq
        dp, dq = dq, dp + (2 * n + 3) * q
        p, q = q, ((2 * n + 3) * c * q - (n + 1) * p) / (n + 2)
        moment = power * dxq
        zz += moment / (n + 3) * q
        over += moment / ((n + 1) * (n + 2) * (n + 3)) * first
        turn += moment / ((n + 1) * (n + 2) * (n + 3)) * ddq
        cross += moment / ((n + 2) * (n + 3)) * dq
        ddp, ddq = ddq, ddp + (2 * n + 5) * dq
        dp, dq = dq, dp + (2 * n + 5) * q
        p, q = q, ((2 * n + 5) * c * q - (n + 2) * p) / (n + 3)
        xp, xq = xq, ((2 * n + 5) * x * xq - (n + 2) * xp) / (n + 3)
        dxp, dxq = dxq, dxp + (2 * n + 5) * xp
        zzz += moment * q
        bend += moment / (n + 3) * dq
        power *= square / (distance * distance)
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
