"""Superquadrics as shapes of particles."""

from __future__ import annotations

from typing import Self

import numpy as np
from pydantic import model_validator
from scipy.special import gamma, logsumexp

from tisim.components.component import Vector, parameter
from tisim.errors import must
from tisim.shapes.particle_shape import ParticleShape, check_thickness, positive

SHARPEST_EXPONENT = 20.0
"""Up to this exponent the narrow phase is tested; a superball of exponent 20 fills 97 % of its cube."""
NEAR_TWO = 1e-8
"""Exponents closer to 2 count as 2 in the bounding radius, which then is right to a part in 1e8."""
ROOT_ROUNDS = 100
"""Largest number of Newton iterations for the root of a sum of powers; up to ten are usual."""


class SuperquadricShape(ParticleShape):
    """A superquadric: a sphere or an ellipsoid for exponents of 2, which approaches a box for large ones.

        |x/a_1|^g_1 + |y/a_2|^g_2 + |z/a_3|^g_3 = 1                                          (4.3)
        V = a_1 a_2 a_3 e_1 e_2 e_3 G(e_1/2) G(e_2/2) G(e_3/2) / G(1 + e_1/2 + e_2/2 + e_3/2)    (4.21)

    with e_k = 2/g_k, and Euler's function G(n + 1) = n!. The moments of inertia are (4.29) to (4.31) over the
    volume. The bounding radius of equal exponents g > 2 is

        r = (a_1^q + a_2^q + a_3^q)^(1/q),    q = 2 g/(g - 2)                                 (4.38)

    Source: R. J. Baars, thesis (Utrecht University, 2016), chapter 4.
    """

    semi_axes: Vector = parameter("m", "semi-axes a_1, a_2 and a_3", examples=[(1e-3, 1e-3, 1e-3)])
    exponents: Vector = parameter("", "exponents g_1, g_2 and g_3, from 2 to 20", examples=[(4.0, 4.0, 4.0)])

    @model_validator(mode="after")
    def _is_strictly_convex(self) -> Self:
        positive(f"{self.label}.semi_axes", self.semi_axes)
        allowed = all(2 <= one <= SHARPEST_EXPONENT for one in self.exponents)
        rule = f"three numbers from 2 to {SHARPEST_EXPONENT:g}"
        must(allowed, f"{self.label}.exponents", rule, self.exponents)
        check_thickness(self)
        return self

    @classmethod
    def of(cls, shape: ParticleShape) -> Self | None:
        """Return the superquadric with the form of a shape, such as a sphere; None if there is none."""
        known = shape.superquadric()
        return None if known is None else cls(semi_axes=known[0], exponents=known[1])

    def volume(self) -> float:
        return self._integral(np.zeros(3))

    def moments(self) -> np.ndarray:
        square = np.square(self.semi_axes) * [self._integral(one) for one in np.eye(3)] / self.volume()
        # Without differences, which would cancel for thin shapes.
        moments: np.ndarray = np.roll(square, -1) + np.roll(square, 1)
        return moments

    def _integral(self, power: np.ndarray) -> float:
        """Return the integral of (x/a_1)^(2 p_1) (y/a_2)^(2 p_2) (z/a_3)^(2 p_3) over the solid (m^3), which
        (4.21) and the terms of (4.29) have in common."""
        half = (1 + 2 * power) / self.exponents
        scale = np.prod(2 * np.array(self.semi_axes) / self.exponents)
        return float(scale * np.prod(gamma(half)) / gamma(1 + half.sum()))

    def half_extents(self) -> np.ndarray:
        return np.array(self.semi_axes)

    def bounding_radius(self) -> float:
        """Return the radius (m) of the smallest sphere around the shape, (4.38) for equal exponents.

        With y_k = |x_k/a_k|^g_k, r^2 = sum_k a_k^2 y_k^(2/g_k) is largest if its derivatives are equal: y_k =
        (2 a_k^2/(g_k m))^(g_k/(g_k - 2)), with m such that their sum is 1. Along axes of exponent 2 the
        derivative is a_k^2. If m is below the largest of these, that axis takes the rest of the sum.
        """
        square, g = np.square(self.semi_axes), np.array(self.exponents)
        sharp = g > 2 + NEAR_TWO
        log_m = -np.inf
        if sharp.any():
            powers, logs = g[sharp] / (g[sharp] - 2), np.log(2 * square / g)[sharp]
            log_m = float(power_sum_root(powers, logs))
        if not sharp.all():
            log_m = max(log_m, float(np.log(square[~sharp].max())))
        if not sharp.any():
            return float(np.exp(log_m / 2))
        y = np.exp(powers * (logs - log_m))
        rest = max(1 - y.sum(), 0.0) * np.exp(log_m)
        return float(np.sqrt((square[sharp] * y ** (2 / g[sharp])).sum() + rest))

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the points (m) of the shape that are farthest along directions, shape (..., 3) each.

        The normal (4.6) is parallel to the direction n at |x_k/a_k| = (a_k |n_k|/(g_k m))^(1/(g_k - 1)), with
        the multiplier m for which the point is on the surface.
        """
        n, a, g = np.asarray(direction, float), self.half_extents(), np.array(self.exponents)
        with np.errstate(divide="ignore"):
            logs = np.log(np.abs(a * n) / g)
        u = np.exp((logs - power_sum_root(g / (g - 1), logs)[..., None]) / (g - 1))
        farthest: np.ndarray = a * np.sign(n) * u
        return farthest

    def contains(self, points: np.ndarray) -> np.ndarray:
        with np.errstate(over="ignore"):
            level = (np.abs(points / self.half_extents()) ** self.exponents).sum(axis=-1)
        within: np.ndarray = level <= 1
        return within

    def superquadric(self) -> tuple[Vector, Vector]:
        return self.semi_axes, self.exponents


def power_sum_root(powers: np.ndarray, logs: np.ndarray) -> np.ndarray:
    """Return t with sum_k exp(p_k (l_k - t)) = 1, over the last axis.

    The logarithm of the sum is convex and decreasing in t, and not negative at the largest l_k, so Newton's
    method from there converges monotonically.
    """
    t: np.ndarray = logs.max(axis=-1)
    for _ in range(ROOT_ROUNDS):
        terms = powers * (logs - t[..., None])
        value = logsumexp(terms, axis=-1)
        share = np.exp(terms - value[..., None])
        step = value / (powers * share).sum(axis=-1)
        t = t + step
        if (np.abs(step) <= 4 * np.finfo(float).eps * np.maximum(np.abs(t), 1)).all():
            break
    return t
