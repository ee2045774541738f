"""Springs with history and slip, shared by several parts of the granular law.

A spring is a vector T across the normal n of its contact. It is stretched by the relative velocity u of the
surfaces:

    dT/dt = S u + W x T,    W = n x dn/dt + n (w_i + w_j).n / 2

W is the angular velocity of the contact. It consists of the rotation of the normal and, about the normal, the
mean spin of both bodies (of grain and wall at a wall). If two bodies rotate as one with w, about any axis,
then W = w and u = 0, so T rotates with them. Any weighted mean of the spins has this property; the plain mean
is the same seen from either body, whatever their sizes. ``projected`` follows the rotation of n, but not the
rotation of both bodies about n.

Velocities are midway in a step, between the positions of the bodies before and after it. A step rotates T by
the whole rotation of the contact, and the new stretch by the second half of it, because surfaces are seen
midway. Both directions of time are treated alike, and the error is of second order in dt. The surfaces of
bodies that rotate as one by an angle a per step slip by some a^3 / 24 of their distance.

Source: M. R. Kuhn, K. Suzuki and A. Daouadji, Int. J. Numer. Methods Eng. 121 (2020) 560, for the twirl about
n; M. R. Kuhn and K. Bagi, Mech. Res. Commun. 32 (2005) 463, for objective motions of a contact.
"""

from __future__ import annotations

from tisim.backend.taichi import ti

TURN = 1e-12
"""A projected spring keeps its length; corrections of its square below this fraction are omitted."""
NO_GRIP = 1e-30
"""Springs below this stiffness carry no force; N/m."""


@ti.func
def tilted(before, normal):
    """Return the tilt: the direction midway between the unit vectors ``before`` and ``normal`` is along
    normal + tilt."""
    along = before.dot(normal)
    return (before - along * normal) / (1.0 + along)


@ti.func
def carried(remembered, normal, tilt, turn):
    """Return a stored vector after rotation with the contact in a step.

    tilt : a vector across the normal; the normal midway in the step is along normal + tilt. turn : half the
    angle (rad) by which both bodies on average rotate about the normal in the step.

    The vector is moved from the old contact plane to the new one along the normal midway between both, which
    keeps its length; about the normal it is rotated by 2 arctan(turn).
    """
    known = remembered - remembered.dot(normal) * (normal + tilt)
    share = 2.0 / (1.0 + turn * turn)
    return known + share * turn * (normal.cross(known) - turn * known)


@ti.func
def midway(slip, opening, normal, tilt, turn):
    """Return a relative velocity (m/s) of the surfaces midway in a step, rotated with the contact to the end
    of the step, to second order in the step.

    The part across the old normal becomes the part across the new one, rotated by half the rotation of the
    step. opening : the speed along the normal to be returned. tilt, turn : see ``carried``.
    """
    along = slip.dot(normal)
    return slip + (opening - along) * normal - along * tilt + turn * normal.cross(slip)


@ti.func
def projected(remembered, normal):
    """Return a stored vector rotated as in LAMMPS: projected to the plane of contact, with its length
    kept."""
    out, size = remembered.dot(normal), remembered.norm_sqr()
    known, flat = remembered - out * normal, size - out * out
    # Not near 0: processors, and not all compilers, replace the smallest numbers by zero.
    if out * out > TURN * size and flat > TURN * size:
        known *= ti.sqrt(size / flat)
    return known


@ti.func
def slipping(elastic, drag, limit):
    """Return the sum of an elastic force and a drag, cut to a limit, and the elastic force that remains."""
    grip, known = elastic + drag, elastic
    square = grip.norm_sqr()
    if square > limit * limit:
        grip *= limit / ti.sqrt(square)
        known = grip - drag
    return grip, known


@ti.func
def unloaded(stiffness, before):
    """Return the fraction of an elastic force that a spring retains when its stiffness decreases from
    ``before``: at constant force it would return more work than was put in."""
    return ti.min(stiffness / ti.max(before, NO_GRIP), 1.0)
