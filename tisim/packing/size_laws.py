"""Size distributions: equal, uniform, normal, lognormal, Weibull, and a sieve curve."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator
from scipy import special

from tisim.components.component import option, parameter
from tisim.components.ranges import LEAST
from tisim.errors import Words, must
from tisim.packing.sizes import By, SizeDistribution

NODES = 1000
"""Number of nodes of a curve at equal intervals of log radius, and of additional nodes at equal intervals of
the passing fraction."""


class EqualSizes(SizeDistribution):
    """All grains have the same radius."""

    by: By = option("quantity of the distribution: number, volume or mass; no effect here", "number")
    radius: float = parameter("m", "radius of the grains", examples=[1e-3], gt=0)

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        return np.full(2, self.radius), np.array([0.0, 1.0])


class TruncatedSizes(SizeDistribution):
    """Contract of a size law that is truncated to an interval of radii and renormalised."""

    contract: ClassVar[bool] = True

    smallest: float = parameter("m", "radius of the smallest grain", examples=[5e-4], gt=0)
    largest: float = parameter("m", "radius of the largest grain", examples=[2e-3], gt=0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        must(self.largest > self.smallest, f"{self.label}.largest", "above smallest", self.largest)
        low, high = self.cumulative(np.array([self.smallest, self.largest]))
        rule = "so that the law has sizes between smallest and largest"
        must(high - low > 1e-9, self.label, rule, Words(f"{high - low:.3g} of it"))
        return self

    def cumulative(self, radius: np.ndarray) -> np.ndarray:
        """Return the fraction of grains up to a radius, by the law without bounds."""
        raise NotImplementedError(f"{type(self).__name__} must define cumulative")

    def quantile(self, part: np.ndarray) -> np.ndarray:
        """Return the radius (m) up to which a fraction, above 0 and below 1, of the grains lies, by the law
        without bounds."""
        raise NotImplementedError(f"{type(self).__name__} must define quantile")

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.cumulative(np.array([self.smallest, self.largest]))
        even = self.quantile(low + (high - low) * np.arange(1, NODES) / NODES)
        scale = np.geomspace(self.smallest, self.largest, NODES + 1)
        radius = np.unique(np.clip(np.concatenate([even, scale]), self.smallest, self.largest))
        passing = self.cumulative(radius)
        return radius, (passing - passing[0]) / (passing[-1] - passing[0])


class UniformSizes(TruncatedSizes):
    """Uniform distribution of radii between two bounds, by number or by volume."""

    def cumulative(self, radius: np.ndarray) -> np.ndarray:
        return (radius - self.smallest) / (self.largest - self.smallest)

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array([self.smallest, self.largest]), np.array([0.0, 1.0])


class NormalSizes(TruncatedSizes):
    """Normal distribution of radii, q(r) ~ exp(-(r - mean)^2 / (2 deviation^2)), between two bounds."""

    mean: float = parameter("m", "mean radius without the bounds", examples=[1e-3], gt=0)
    deviation: float = parameter(
        "m", "standard deviation of the radius without the bounds", examples=[2e-4], gt=0
    )

    def cumulative(self, radius: np.ndarray) -> np.ndarray:
        return np.asarray(special.ndtr((radius - self.mean) / self.deviation))

    def quantile(self, part: np.ndarray) -> np.ndarray:
        return np.asarray(self.mean + self.deviation * special.ndtri(part))


class LognormalSizes(TruncatedSizes):
    """Lognormal distribution of radii, between two bounds.

        q(ln r) ~ exp(-ln(r / median)^2 / (2 ln(ratio)^2))

    Without bounds, the distributions by number and by volume both have this form with the same ratio; the
    median by volume is larger by the factor exp(3 ln(ratio)^2).

    Source: T. Hatch, S. P. Choate, J. Franklin Inst. 207 (1929) 369.
    """

    median: float = parameter("m", "median radius without the bounds", examples=[1e-3], gt=0)
    ratio: float = parameter(
        "", "geometric standard deviation: the radius at 84.1 % over the median", examples=[1.3], gt=1
    )

    def cumulative(self, radius: np.ndarray) -> np.ndarray:
        return np.asarray(special.ndtr(np.log(radius / self.median) / np.log(self.ratio)))

    def quantile(self, part: np.ndarray) -> np.ndarray:
        return np.asarray(self.median * np.exp(np.log(self.ratio) * special.ndtri(part)))


class WeibullSizes(TruncatedSizes):
    """Weibull distribution of radii between two bounds; by volume it is the Rosin-Rammler distribution.

        passing(r) = 1 - exp(-(r / scale)^shape)

    Source: P. Rosin, E. Rammler, J. Inst. Fuel 7 (1933) 29; W. Weibull, J. Appl. Mech. 18 (1951) 293.
    """

    scale: float = parameter(
        "m", "radius at a passing fraction of 63.2 %, without the bounds", examples=[1e-3], gt=0
    )
    shape: float = parameter("", "exponent, larger for narrower distributions", examples=[4.0], gt=0)

    def cumulative(self, radius: np.ndarray) -> np.ndarray:
        return np.asarray(-np.expm1(-((radius / self.scale) ** self.shape)))

    def quantile(self, part: np.ndarray) -> np.ndarray:
        return np.asarray(self.scale * (-np.log1p(-part)) ** (1 / self.shape))


class SieveCurve(SizeDistribution):
    """Sizes from a sieve curve: diameters of openings, and the fraction that passes each.

    Nothing passes the first sieve, and everything the last. In between, the curve is linear in the diameter.
    """

    diameters: tuple[float, ...] = parameter(
        "m", "diameters of the openings, increasing", examples=[(1e-3, 2e-3, 4e-3)]
    )
    passing: tuple[float, ...] = parameter(
        "", "fraction that passes each, from 0 to 1", examples=[(0.0, 0.4, 1.0)]
    )

    @model_validator(mode="after")
    def _sound(self) -> Self:
        where, n = self.label, len(self.diameters)
        must(n > 1, f"{where}.diameters", "of two sieves or more", n)
        rising = self.diameters[0] >= LEAST and bool((np.diff(self.diameters) > 0).all())
        must(rising, f"{where}.diameters", "above 0 and rising", self.diameters)
        must(len(self.passing) == n, f"{where}.passing", f"{n}, one for each sieve", len(self.passing))
        whole = self.passing[0] == 0 and self.passing[-1] == 1 and bool((np.diff(self.passing) >= 0).all())
        must(whole, f"{where}.passing", "from 0 to 1, never falling", self.passing)
        return self

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        return np.asarray(self.diameters) / 2, np.asarray(self.passing)
