"""Sizes of superparamagnetic particles from the magnetisation curve of their dispersion (B16 section 7.2.3).

Each particle is a single domain of the moment mu = 4/3 pi r^3 m_sat, and follows Langevin's law without
hysteresis. The dispersion is so dilute that moments do not interact. With the part dM of the saturation
magnetisation that belongs to particles of radius r,

    M(H) = integral L(x) dM(r),    L(x) = coth x - 1/x,    x = mu_0 mu H / (kT)

Radii are magnetic radii: those of spheres of the material with the same moment. A dead layer at the surface
makes them smaller than the radii that a microscope shows. Arguments that all functions share: ``material`` is
the saturation magnetisation m_sat of the material, 4.46e5 A/m for magnetite, and ``temperature`` is T, K.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self

import numpy as np
from scipy.constants import Boltzmann, mu_0
from scipy.optimize import curve_fit, lsq_linear
from scipy.stats import norm
from scipy.stats import t as student

from tisim.analysis.flow_curves import Estimate
from tisim.errors import must
from tisim.numerics.statistics import CONFIDENCE

FARTHEST_DEVIATION = 9.0
"""The distribution of ln mu is summed up to this number of standard deviations from its middle, and on by as
much as factors of x or 1/x move it."""
TERMS = 9
"""Terms of the continued fraction of Langevin's function; the next one is below rounding."""
RESOLVED, CLASSES = (1.0, 3.0), 40
"""Range of the classes: x of the smallest in the strongest field, and of the largest in the weakest one; and
the number of classes."""
POINT_DISTANCE, POINT_RATIO = 0.5, 0.3
"""Distance of two points of the sum, in standard deviations of ln mu and in ln mu, at most: the trapezoidal
rule then has an error below 1e-12, because L(exp(ln x)) is analytic within pi/2 of the real axis."""


class LognormalRadii(NamedTuple):
    """A lognormal distribution of radii, by number. median : m. width : standard deviation of ln r."""

    median: float
    width: float

    @property
    def mean(self) -> float:
        """Return the mean radius, m."""
        return self.median * math.exp(self.width**2 / 2)

    @property
    def volume_mean(self) -> float:
        """Return the mean radius by volume, <r^4> / <r^3>, m."""
        return self.median * math.exp(3.5 * self.width**2)

    @property
    def polydispersity(self) -> float:
        """Return the standard deviation over the mean."""
        return math.sqrt(math.expm1(self.width**2))

    @classmethod
    def of_mean(cls, mean: float, polydispersity: float) -> Self:
        """Return the distribution of this mean radius (m) and this standard deviation over the mean."""
        must(mean > 0, "mean", "above 0", mean)
        must(polydispersity >= 0, "polydispersity", "at least 0", polydispersity)
        return cls(mean / math.sqrt(1 + polydispersity**2), math.sqrt(math.log1p(polydispersity**2)))


class LognormalFit(NamedTuple):
    """A fitted lognormal distribution: saturation magnetisation of the dispersion (A/m), median radius (m),
    standard deviation of ln r, and from them the mean radius (m) and the standard deviation over the mean."""

    saturation: Estimate
    median: Estimate
    width: Estimate
    mean: Estimate
    polydispersity: Estimate

    @property
    def radii(self) -> LognormalRadii:
        """Return the fitted distribution."""
        return LognormalRadii(self.median.value, self.width.value)


class RadiusClasses(NamedTuple):
    """A distribution of radii in classes. radius : m. saturation : of the particles of each class, A/m.
    number : of these particles per volume of the dispersion, 1/m^3."""

    radius: np.ndarray
    saturation: np.ndarray
    number: np.ndarray

    @property
    def volume_mean(self) -> float:
        """Return the mean radius by volume, <r^4> / <r^3>, m."""
        return float(np.average(self.radius, weights=self.saturation))


def magnetic_radius(susceptibility: float, saturation: float, material: float, temperature: float) -> float:
    """Return the radius (m) of equal particles with this initial susceptibility.

        r^3 = chi_i / M_sat  9 kT / (4 pi mu_0 m_sat)

    susceptibility : dM/dH at H = 0. saturation : M_sat of the dispersion, A/m. For particles of several sizes
    it is (<r^6> / <r^3>)^(1/3), which is dominated by the largest.

    Source: B16 Eq. (7.8).
    """
    for name, value in (("susceptibility", susceptibility), ("saturation", saturation)):
        must(value > 0, name, "above 0", value)
    moment = 3 / _alignment(temperature) * susceptibility / saturation
    return _radius(moment, material)


def lognormal_magnetisation(
    field: np.ndarray, saturation: float, radii: LognormalRadii, material: float, temperature: float
) -> np.ndarray:
    """Return the magnetisation M(H) (A/m) of particles with a lognormal distribution of radii, to 1e-12.

    field : H, A/m. saturation : M_sat of the dispersion, A/m.

    Source: B16 Eqs (7.5), (7.6), (7.9).
    """
    x, weights = _points(np.asarray(field, float), radii, material, temperature)
    return saturation * (_langevin(x) @ weights)


def chantrell_radii(
    susceptibility: float, saturation: float, intercept: float, material: float, temperature: float
) -> LognormalRadii:
    """Return the lognormal distribution that the two ends of a magnetisation curve determine.

        3 chi_i H_0 / M_sat = exp(9 w^2),    mu_v = kT/mu_0 sqrt(3 chi_i / (M_sat H_0))

    susceptibility : dM/dH at H = 0. saturation : M_sat, A/m. intercept : H_0 (A/m), where the line M = M_sat
    (1 - H_0/H), which the curve approaches in strong fields, meets 0. w : standard deviation of ln r. mu_v :
    moment of the median by volume, whose radius is exp(3 w^2) times the median by number.

    Source: R. W. Chantrell, J. Popplewell, S. W. Charles, IEEE Trans. Magn. 14 (1978) 975.
    """
    for name, value in (("susceptibility", susceptibility), ("saturation", saturation)):
        must(value > 0, name, "above 0", value)
    ratio = 3 * susceptibility * intercept / saturation
    must(ratio >= 1, "3 susceptibility intercept / saturation", "at least 1, as for equal particles", ratio)
    square = math.log(ratio) / 9
    moment = math.sqrt(3 * susceptibility / (saturation * intercept)) / _alignment(temperature)
    return LognormalRadii(_radius(moment, material) * math.exp(-3 * square), math.sqrt(square))


def fit_lognormal_radii(
    field: np.ndarray,
    magnetisation: np.ndarray,
    material: float,
    temperature: float,
    error: np.ndarray | None = None,
    confidence: float = CONFIDENCE,
) -> LognormalFit:
    """Return the least-squares fit of a lognormal distribution of radii to a magnetisation curve.

    field : H (A/m), of any sign. magnetisation : M(H), A/m, without linear contributions such as the
        diamagnetism of the liquid.
    error : standard errors of the magnetisation, A/m; the confidence intervals then follow from them. Without
        it, all values are taken as equally accurate, their error is estimated from the residuals, and the
        intervals use Student's t.

    The intervals are first-order in the errors. They are too wide or too narrow if the interval of the width
    includes 0: the curve then hardly distinguishes a narrow distribution from equal particles.

    Source: B16 Eqs (7.5), (7.6), (7.9).
    """
    h, m, sigma = _curve(field, magnetisation, error, 3)
    weights = 1 / (np.ones_like(m) if sigma is None else sigma)

    def shape(log_radius: float, width: float) -> np.ndarray:
        return lognormal_magnetisation(
            h, 1.0, LognormalRadii(math.exp(log_radius), width), material, temperature
        )

    def best(log_radius: float, width: float) -> tuple[float, np.ndarray]:
        """For a distribution, the weighted sum of squares and the parameters; M_sat enters linearly."""
        y = weights * shape(log_radius, width)
        size = float(y @ (weights * m) / (y @ y))
        return float(((weights * m - size * y) ** 2).sum()), np.array([size, log_radius, width])

    # The radii whose moments the fields align: x from 0.03 at the strongest to 30 at the weakest field.
    strong, weak = np.abs(h).max(), np.abs(h[h != 0]).min()
    unit = _alignment(temperature)
    low, high = (math.log(_radius(x / (unit * at), material)) for x, at in ((0.03, strong), (30.0, weak)))
    grid = [(r, w) for r in np.linspace(low - 1.0, high, 40) for w in (0.1, 0.3, 0.5, 0.7)]
    _, start = min((best(*one) for one in grid), key=lambda one: one[0])
    scale = float(np.abs(m).max())
    (size, log_radius, width), covariance = curve_fit(
        lambda _, size, log_radius, width: size * shape(log_radius, width),
        h, m / scale, start / [scale, 1.0, 1.0], None if sigma is None else sigma / scale,
        absolute_sigma=sigma is not None, xtol=1e-14, ftol=1e-14, gtol=1e-14,
    )  # fmt: skip
    # The law is even in the width.
    radii = LognormalRadii(math.exp(log_radius), abs(width))
    values = [scale * size, radii.median, radii.width, radii.mean, radii.polydispersity]
    spread = radii.polydispersity
    turn = np.array([
        [scale, 0.0, 0.0], [0.0, radii.median, 0.0], [0.0, 0.0, 1.0],
        [0.0, radii.mean, radii.mean * width],
        [0.0, 0.0, width * (1 + spread**2) / spread if spread > 0 else 1.0],
    ])  # fmt: skip
    variances = np.einsum("ia,ab,ib->i", turn, covariance, turn)
    part = 0.5 + confidence / 2
    times = norm.ppf(part) if sigma is not None else student.ppf(part, len(h) - 3)
    halves = times * np.sqrt(variances)
    return LognormalFit(
        *(Estimate(float(one), float(half)) for one, half in zip(values, halves, strict=True))
    )


def fit_radius_classes(
    field: np.ndarray,
    magnetisation: np.ndarray,
    material: float,
    temperature: float,
    error: np.ndarray | None = None,
    radius: np.ndarray | None = None,
) -> RadiusClasses:
    """Return the non-negative numbers of particles in classes of radii that fit a magnetisation curve best.

    field, magnetisation, error : as for ``fit_lognormal_radii``. radius : of each class, m. By default there
    are 40 classes, from the radius at which x is 1 in the strongest field to that at which x is 3 in the
    weakest field other than 0. Smaller particles only add a straight line to the curve, and larger ones only
    a step at 0: their radii cannot be told from it.

    No form of the distribution is assumed, and nothing smooths it: noise makes it a few narrow peaks, whose
    places say little (B16 uses MINORIM, another inversion without smoothing). The saturation and the mean by
    volume are reliable. Means by number are not, because the smallest particles hardly change the curve.

    Source: B16 Eq. (7.9); P. B. Stark, R. L. Parker, Comput. Stat. 10 (1995) 129.
    """
    h, m, sigma = _curve(field, magnetisation, error, 0)
    unit = _alignment(temperature)
    if radius is None:
        size = np.abs(h[h != 0])
        ends = zip(RESOLVED, (size.max(), size.min()), strict=True)
        smallest, largest = (_radius(x / (unit * at), material) for x, at in ends)
        r = np.geomspace(smallest, largest, CLASSES)
    else:
        r = np.asarray(radius, float)
        must(
            r.ndim == 1 and len(r) > 0 and bool((r > 0).all()), "radius", "an array of radii above 0", radius
        )
    weights = 1 / (np.ones_like(m) if sigma is None else sigma)
    moments = _moment(r, material)
    columns = _langevin(unit * np.outer(h, moments))
    scale = float(np.abs(m).max()) or 1.0
    fitted = lsq_linear(
        columns * weights[:, None], weights * m / scale, (0.0, np.inf), "bvls", max_iter=100 * len(r)
    )
    saturation = scale * np.maximum(fitted.x, 0.0)
    return RadiusClasses(r, saturation, saturation / moments)


def _points(
    field: np.ndarray, radii: LognormalRadii, material: float, temperature: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return x at each field (..., points), and the parts of M_sat at the points.

    By volume, ln mu is normal, with the standard deviation 3 w, about the moment of the radius exp(3 w^2)
    times the median.
    """
    must(radii.median > 0, "radii.median", "above 0", radii.median)
    must(radii.width >= 0, "radii.width", "at least 0", radii.width)
    deviation = 3 * radii.width
    distance = min(POINT_DISTANCE, POINT_RATIO / deviation) if deviation > 0 else POINT_DISTANCE
    last = math.ceil((FARTHEST_DEVIATION + deviation) / distance)
    z = distance * np.arange(-last, last + 1)
    weights = np.exp(-(z**2) / 2)
    middle = _moment(radii.median, material) * math.exp(9 * radii.width**2)
    moments = middle * np.exp(deviation * z)
    x = _alignment(temperature) * field[..., None] * moments
    return x, weights / weights.sum()


def _langevin(x: np.ndarray) -> np.ndarray:
    """Return L(x) = coth x - 1/x, to 1e-14 of itself.

    Up to |x| = 1, where the terms cancel, it uses the continued fraction x / (3 + x^2 / (5 + x^2 / (7 +
    ...))).
    """
    size = np.abs(x)
    square, rest = np.minimum(size, 1.0) ** 2, 2.0 * TERMS + 1
    for k in range(TERMS - 1, 0, -1):
        rest = (2.0 * k + 1) + square / rest
    large = np.maximum(size, 1.0)
    return np.where(size < 1.0, x / rest, np.sign(x) * (1 / np.tanh(large) - 1 / large))


def _alignment(temperature: float) -> float:
    """Return mu_0 / (kT), the factor of a moment and a field in x, m/(A^2 m^2)."""
    must(temperature > 0, "temperature", "above 0", temperature)
    return float(mu_0 / (Boltzmann * temperature))


def _moment(radius: np.ndarray | float, material: float) -> np.ndarray:
    """Return the moment (A m^2) of particles of a magnetic radius (m)."""
    must(material > 0, "material", "above 0", material)
    return np.asarray(4 / 3 * np.pi * np.asarray(radius) ** 3 * material)


def _radius(moment: float, material: float) -> float:
    """Return the magnetic radius (m) of a particle of a moment (A m^2)."""
    must(material > 0, "material", "above 0", material)
    return float(np.cbrt(3 * moment / (4 * np.pi * material)))


def _curve(
    field: np.ndarray, magnetisation: np.ndarray, error: np.ndarray | None, parameters: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Return the arrays of a curve, checked."""
    h, m = np.asarray(field, float), np.asarray(magnetisation, float)
    must(h.shape == m.shape and h.ndim == 1, "magnetisation", f"of the shape of field, {h.shape}", m.shape)
    must(
        bool(np.isfinite(h).all() and np.isfinite(m).all()), "field and magnetisation", "finite", "nan or inf"
    )
    sigma = None if error is None else np.broadcast_to(np.asarray(error, float), h.shape)
    must(sigma is None or bool((sigma > 0).all()), "error", "above 0", error)
    number = int((h != 0).sum())
    must(number > parameters, "fields", f"more than {parameters} other than 0", number)
    return h, m, sigma
