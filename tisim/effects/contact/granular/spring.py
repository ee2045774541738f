"""Springs that remember how far surfaces have moved past each other, and slip: what several parts share.

A spring is a vector T across the normal n of its contact, and is drawn by the velocity u of the surfaces:

    dT/dt = S u + W x T,    W = n x dn/dt + n (w_i + w_j).n / 2

W is the angular velocity of the contact: that of its normal, and about it the mean spin of both bodies (at a
wall that of grain and wall). Two bodies that turn as one, at w, have W = w and u = 0, whichever axis that is
about, so that T turns with them. Any mean of the spins would do for that; the plain one is the same seen from
either body, whatever their sizes. ``projected`` knows how n turns, but not how both bodies turn about n.

Velocities are those midway in a step, between the places where bodies were and are. A step turns T by the
whole turn of the contact, and what is drawn, as the surfaces are midway, by the second half of it: both
directions of time are alike, and the error is of second order in dt. Between bodies that turn as one by an
angle a in a step surfaces so slip by some a^3 / 24 of their distance.

Source: M. R. Kuhn, K. Suzuki and A. Daouadji, Int. J. Numer. Methods Eng. 121 (2020) 560, for the twirl about
n; M. R. Kuhn and K. Bagi, Mech. Res. Commun. 32 (2005) 463, for objective motions of a contact.
"""

from __future__ import annotations

from tisim.backend.taichi import ti

TURN = 1e-12
"""A projected spring keeps its length; its square is not corrected by less than this part of it."""
NO_GRIP = 1e-30
"""Springs below this stiffness hold nothing; N/m."""


@ti.func
def tilted(before, normal):
    """Return the tilt: the direction midway between ``before`` and ``normal``, both unit vectors, is along
    normal + tilt."""
    along = before.dot(normal)
    return (before - along * normal) / (1.0 + along)


@ti.func
def carried(remembered, normal, tilt, turn):
    """Return a vector that is remembered as it turns with the contact in a step.

    tilt : the normal midway in the step is along normal + tilt, with tilt across the normal. turn : half the
    angle (rad) by which the mean of both bodies turns about the normal in the step.

    Midway between both normals the vector goes from one plane to the other along the normal of then, which
    keeps its length; about the normal it turns by 2 arctan(turn).
    """
    known = remembered - remembered.dot(normal) * (normal + tilt)
    share = 2.0 / (1.0 + turn * turn)
    return known + share * turn * (normal.cross(known) - turn * known)


@ti.func
def midway(slip, opening, normal, tilt, turn):
    """Return a velocity (m/s) of surfaces past each other midway in a step as the contact has turned it since
    then, to second order in the step.

    The part across the normal of then becomes the part across that of now, turned by half of the step's turn.
    opening : the speed along the normal that is returned. tilt, turn : see ``carried``.
    """
    along = slip.dot(normal)
    return slip + (opening - along) * normal - along * tilt + turn * normal.cross(slip)


@ti.func
def projected(remembered, normal):
    """Return a vector that is remembered as LAMMPS turns it: into the plane of contact, with its length."""
    out, size = remembered.dot(normal), remembered.norm_sqr()
    known, flat = remembered - out * normal, size - out * out
    # Not beside 0: the smallest numbers are taken for it by processors, and not by all compilers.
    if out * out > TURN * size and flat > TURN * size:
        known *= ti.sqrt(size / flat)
    return known


@ti.func
def slipping(elastic, drag, limit):
    """Return the sum of an elastic force and a drag, cut to a limit, and what elastic force that leaves."""
    grip, known = elastic + drag, elastic
    square = grip.norm_sqr()
    if square > limit * limit:
        grip *= limit / ti.sqrt(square)
        known = grip - drag
    return grip, known


@ti.func
def unloaded(stiffness, before):
    """Return the part of an elastic force that a spring holds which was stiffer ``before``: at constant force
    more would come back than was put in."""
    return ti.min(stiffness / ti.max(before, NO_GRIP), 1.0)
