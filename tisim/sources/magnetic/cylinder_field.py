"""The field of a uniformly magnetised cylinder and its gradient, relative to its own axis and in its own
units.

The cylinder has radius R and extends from z = -L to L along its axis (as in B16 chapter 5). M has any
direction: B16 Eqs (5.3) and (5.21) are the columns of one tensor, W_ij of ``cylinder_end``. By symmetry,
three functions of rho and z are enough for the field, and three more for its gradient:

    W_zz,  W_rho / rho,  rho (W_rho / rho)_rho / rho,  W_rho z / rho,  W_zzz,  W_rho zz / rho
"""

from tisim.backend.taichi import ti
from tisim.sources.magnetic.cylinder_far import far_field


@ti.func
def shape(rho, z, end, radius, half, ends: ti.template()):  # type: ignore[valid-type]
    """Return the six functions, as a vector. Lengths are in one unit. end : |z| - half, computed by the
    caller without cancellation. ends : closed or tabulated."""
    six = ti.Vector([0.0 * rho, 0.0, 0.0, 0.0, 0.0, 0.0])
    if rho * rho + z * z > ends.far * (radius * radius + half * half):
        six = far_field(rho, z, radius, half, ends.small)
    else:
        pair = ends.both(rho, ti.Vector([ti.abs(z) + half, ti.abs(end)]), radius)
        six = close_by(rho, z, end, radius, pair)
    return six


@ti.func
def mostly(rho, z, end, radius, half, ends: ti.template()):  # type: ignore[valid-type]
    """Return the six functions without a loop or a branch, and whether they are valid; they are at most
    points, except far away and near the axis."""
    pair, right = ends.mostly(rho, ti.Vector([ti.abs(z) + half, ti.abs(end)]), radius)
    far = rho * rho + z * z > ends.far * (radius * radius + half * half)
    return close_by(rho, z, end, radius, pair), right and not far


@ti.func
def close_by(rho, z, end, radius, pair):
    """Return the difference between the ends; between the ends, an infinite cylinder is added (B16 Eq.
    5.24)."""
    side, between = ti.select(z < 0.0, -1.0, 1.0), end < 0.0
    odd = ti.select(between, 1.0, -1.0)
    six = ti.Vector(
        [
            pair[0, 0] + odd * pair[0, 1],
            pair[1, 0] + odd * pair[1, 1],
            pair[2, 0] + odd * pair[2, 1],
            side * (pair[3, 0] - pair[3, 1]),
            side * (pair[4, 0] - pair[4, 1]),
            pair[5, 0] + odd * pair[5, 1],
        ]
    )
    # Without a branch, because the positions of points are unpredictable for a CPU.
    beside = ti.max(rho, radius)
    share = (radius / beside) ** 2
    six[1] = ti.select(between, six[1] - 0.5 * share, six[1])
    six[2] = ti.select(between and rho >= radius, six[2] + share / beside, six[2])
    return six


@ti.func
def field(six, rho, outward, m_across, m_along):
    """Return H across and along the axis for M across and along it: sum_j W_ij M_j, in the unit of M.

    outward : unit vector from the axis to the point. Quantities across the axis are vectors, those along it
    numbers.
    """
    m_out = outward.dot(m_across)
    across = six[1] * m_across + rho * (six[2] * m_out + six[3] * m_along) * outward
    return across, rho * six[3] * m_out + six[0] * m_along


@ti.func
def tensor(six, rho, outward, axis):
    """Return W_ij, by which H_i = sum_j W_ij M_j; it is symmetric."""
    bend = rho * (0.5 * six[2] * outward + six[3] * axis)
    half = outward.outer_product(bend) + 0.5 * (six[0] - six[1]) * axis.outer_product(axis)
    symmetric = half + half.transpose()
    for i in ti.static(range(3)):
        symmetric[i, i] += six[1]
    return symmetric


@ti.func
def gradient(six, rho, outward, axis, m_across, m_along):
    """Return [i, k] dH_i / dr_k = sum_j W_ijk M_j, per unit of length; the matrix is symmetric and
    traceless."""
    turn, cross, bend = six[2], six[3], rho * six[5]
    both, steep = six[4] + 2.0 * cross, bend + 4.0 * turn
    m_out = outward.dot(m_across)
    tilt = cross * m_across + (bend * m_along - both * m_out) * outward
    spread = turn * m_out + cross * m_along
    mixed = turn * m_across - 0.5 * (steep * m_out + both * m_along) * outward
    # x y^T + y x^T for the mixed pairs, and the separate terms on the diagonal.
    half = outward.outer_product(mixed) + axis.outer_product(
        tilt + 0.5 * (bend * m_out + six[4] * m_along - spread) * axis
    )
    symmetric = half + half.transpose()
    for i in ti.static(range(3)):
        symmetric[i, i] += spread
    return symmetric
