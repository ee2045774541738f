"""Langevin's function."""

from tisim.backend.taichi import ti
from tisim.numerics import elementary

TERMS = 9
"""Terms of the continued fraction; up to x = 1 the next one is below rounding in f64."""


@ti.func
def langevin_ratio(x):
    """Return L(x) / x with L(x) = coth x - 1/x, for x >= 0, and 1/3 at 0: to rounding, without overflow.

    For x < 1, coth x and 1/x cancel, so it uses the continued fraction L(x) = x / (3 + x^2 / (5 + x^2 / (7
    + ...))), which has no cancellation (NIST Digital Library of Mathematical Functions, 10.33.1, for I_3/2 /
    I_1/2).
    """
    ratio = 0.0 * x
    if x < 1.0:
        square, rest = x * x, 0.0 * x + (2.0 * TERMS + 1.0)
        for k in ti.static(range(TERMS - 1, 0, -1)):
            rest = (2.0 * k + 1.0) + square / rest
        ratio = 1.0 / rest
    else:
        small = elementary.exp(-2.0 * x)
        ratio = (1.0 - 1.0 / x + 2.0 * small / (1.0 - small)) / x
    return ratio
