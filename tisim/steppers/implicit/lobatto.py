"""The coefficients of Lobatto's collocation methods.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section IV.5, Lobatto IIIA:
the stages are the zeros of d^(s-2)/dx^(s-2) (x^(s-1) (x-1)^(s-1)), the first at the beginning of the step and
the last at its end; a quantity at each stage follows from the polynomial through its rates at all of them.
With two stages this is the trapezoidal rule.
"""

from __future__ import annotations

from itertools import pairwise
from math import factorial

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre


def nodes(stages: int) -> np.ndarray:
    """Return where the stages are, in parts of the step, from 0 to 1."""
    inner = np.sort(Legendre.basis(stages - 1).deriv().roots().real)
    return np.concatenate([[0.0], (inner + 1.0) / 2.0, [1.0]])


def lagrange(c: np.ndarray) -> list[Polynomial]:
    """Return the polynomials that are 1 at one node and 0 at all others."""
    polynomials = []
    for j, here in enumerate(c):
        others = np.delete(c, j)
        polynomials.append(Polynomial.fromroots(others) / np.prod(here - others))
    return polynomials


def integrals(stages: int) -> np.ndarray:
    """Return a_ij: a quantity at stage i is that at stage 0 plus dt sum_j a_ij rate_j (Hairer and Wanner
    IV.5)."""
    c = nodes(stages)
    return np.array([[basis.integ()(here) for basis in lagrange(c)] for here in c])


def highest(stages: int) -> np.ndarray:
    """Return the coefficients d_j of an estimate of error: of position, dt^2 |sum_j d_j acceleration_j|.

    sum_j acceleration_j prod_k 1/(c_j - c_k) is the coefficient of the highest power in the polynomial of the
    acceleration. A polynomial through all nodes but the last is without it, and off by it times
    prod_(k<s-1) (c - c_k); in position at the end by at most the integral of (1 - c) |prod|.
    """
    c = nodes(stages)
    return bound(c) * np.array([1.0 / np.prod(here - np.delete(c, j)) for j, here in enumerate(c)])


def bound(c: np.ndarray) -> float:
    """Return the integral of (1 - x) |prod_(k<s-1) (x - c_k)| from 0 to 1."""
    rest = Polynomial.fromroots(c[:-1]) * Polynomial([1.0, -1.0])
    # |rest| has no sign changes between nodes.
    return float(sum(abs(rest.integ()(b) - rest.integ()(a)) for a, b in pairwise(c)))


def leading(stages: int) -> tuple[float, float]:
    """Return l and p of the leading term of the error, in position dt^2 a (l e)^p, where e is the estimate by
    ``highest`` over dt^2 a, and a the largest acceleration.

    The method multiplies a motion of rate k by the (s - 1, s - 1) approximant of Pade to exp(k dt), which is
    off by c (k dt)^(2s - 1), c = ((s - 1)!)^2/((2s - 2)! (2s - 1)!) (Hairer and Wanner, section IV.3); in
    position, by a/k^2 times that. The estimate tells the derivative of order s - 1: e = m (k dt)^(s - 1)/
    (s - 1)! with m = ``bound``.
    """
    n = stages - 1
    pade, power = factorial(n) ** 2 / (factorial(2 * n) * factorial(2 * n + 1)), (2 * n - 1) / n
    return float(factorial(n) / bound(nodes(stages)) * pade ** (1 / power)), power
