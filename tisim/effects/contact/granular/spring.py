"""Springs that remember how far surfaces have moved past each other, and slip: what several parts share."""

from __future__ import annotations

from tisim.backend.taichi import ti

TURN = 1e-12
"""What a pair remembers turns with it; its square is not corrected by less than this part of it."""
NO_GRIP = 1e-30
"""Springs below this stiffness hold nothing; N/m."""


@ti.func
def turned(remembered, normal):
    """Return a vector that is remembered as it turns with the pair: into the plane of contact, with its
    size."""
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
def eased(stiffness, before):
    """Return the part of an elastic force that a spring holds which was stiffer ``before``: at constant force
    more would come back than was put in."""
    return ti.min(stiffness / ti.max(before, NO_GRIP), 1.0)
