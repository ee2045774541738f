"""The hyperbolic tangent over its argument."""

from tisim.backend.taichi import ti
from tisim.numerics import elementary
from tisim.numerics.double_double import series

TANH_UPPER = (34459425.0, 4729725.0, 135135.0, 990.0, 1.0)
TANH_LOWER = (34459425.0, 16216200.0, 945945.0, 13860.0, 45.0)
"""Coefficients of x^2 of numerator and denominator: nine terms of Lambert's continued fraction, tanh(x)/x = 1
/ (1 + x^2 / (3 + x^2 / (5 + ...))) (NIST Digital Library of Mathematical Functions, 4.39.1). Up to x = 1 the
next term is below rounding in f64."""


@ti.func
def tanh_ratio(x):
    """Return tanh(x) / x for x >= 0, and 1 at 0: to rounding, without overflow.

    For x < 1 the exponentials cancel, so it uses a quotient of polynomials with positive coefficients, which
    has no cancellation.
    """
    ratio = 0.0 * x
    if x < 1.0:
        ratio = series(x * x, ti.static(TANH_UPPER)) / series(x * x, ti.static(TANH_LOWER))
    else:
        small = elementary.exp(-2.0 * x)
        ratio = (1.0 - small) / (1.0 + small) / x
    return ratio
