"""The hyperbolic tangent over its argument."""

from tisim.backend.taichi import ti
from tisim.numerics import elementary

TERMS = 9
"""Terms of the continued fraction; up to x = 1 the next one is below rounding in f64."""


@ti.func
def tanh_ratio(x):
    """Return tanh(x) / x for x >= 0, and 1 at 0: to rounding, without overflow.

    For x < 1 the exponentials cancel, so it uses Lambert's continued fraction tanh x = x / (1 + x^2 / (3 +
    x^2 / (5 + ...))), which has no cancellation (NIST Digital Library of Mathematical Functions, 4.39.1).
    """
    ratio = 0.0 * x
    if x < 1.0:
        square, rest = x * x, 0.0 * x + (2.0 * TERMS + 1.0)
        for k in ti.static(range(TERMS - 1, -1, -1)):
            rest = (2.0 * k + 1.0) + square / rest
        ratio = 1.0 / rest
    else:
        small = elementary.exp(-2.0 * x)
        ratio = (1.0 - small) / (1.0 + small) / x
    return ratio
