"""Flow curves: laws of shear stress against shear rate, fitted with confidence intervals."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import curve_fit
from scipy.stats import norm
from scipy.stats import t as student

from tisim.errors import must
from tisim.numerics.statistics import CONFIDENCE


class Estimate(NamedTuple):
    """A fitted value and the half-width of its confidence interval."""

    value: float
    half: float


class BinghamFit(NamedTuple):
    """A fitted Bingham fluid: yield stress (Pa) and plastic viscosity (Pa s)."""

    yield_stress: Estimate
    plastic_viscosity: Estimate

    def stress(self, rate: np.ndarray) -> np.ndarray:
        """Return the shear stress (Pa) at shear rates (1/s)."""
        return self.yield_stress.value + self.plastic_viscosity.value * np.asarray(rate)


class HerschelBulkleyFit(NamedTuple):
    """A fitted Herschel-Bulkley fluid: yield stress (Pa), consistency (Pa s^n) and exponent n."""

    yield_stress: Estimate
    consistency: Estimate
    exponent: Estimate

    def stress(self, rate: np.ndarray) -> np.ndarray:
        """Return the shear stress (Pa) at shear rates (1/s)."""
        power = np.asarray(rate, float) ** self.exponent.value
        return np.asarray(self.yield_stress.value + self.consistency.value * power)


class BiviscousFit(NamedTuple):
    """A fitted bi-viscous fluid: viscosity at rest (Pa s), yield stress (Pa) and plastic viscosity (Pa s)."""

    rest_viscosity: Estimate
    yield_stress: Estimate
    plastic_viscosity: Estimate

    def stress(self, rate: np.ndarray) -> np.ndarray:
        """Return the shear stress (Pa) at shear rates (1/s)."""
        x = np.asarray(rate, float)
        return _biviscous(x, *(one.value for one in self))


def fit_bingham(
    rate: np.ndarray,
    stress: np.ndarray,
    error: np.ndarray | None = None,
    above: float = 0.0,
    confidence: float = CONFIDENCE,
) -> BinghamFit:
    """Return the least-squares fit of a Bingham fluid to shear stresses (Pa) at shear rates (1/s).

        tau = tau_y + eta_p rate

    error : standard errors of the stresses, Pa, for example of means over runs; the confidence intervals then
        follow from them. Without it, all stresses are taken as equally accurate, their error is estimated
        from the residuals, and the intervals use Student's t.
    above : rates up to this (1/s) are left out; L21 fits above 200 1/s, where a curve is straight.

    Source: E. C. Bingham, Fluidity and Plasticity (1922); L21 section 2.3.
    """
    x, y, sigma = _taken(rate, stress, error, above, 2)

    def law(x: np.ndarray, yields: float, viscosity: float) -> np.ndarray:
        return yields + viscosity * x

    values, covariance = _fitted(law, x / x.max(), y, sigma, np.polyfit(x / x.max(), y, 1)[::-1])
    scale = np.array([1.0, 1 / x.max()])
    return BinghamFit(
        *_estimates(scale * values, covariance * np.outer(scale, scale), len(x), sigma, confidence)
    )


def fit_herschel_bulkley(
    rate: np.ndarray,
    stress: np.ndarray,
    error: np.ndarray | None = None,
    above: float = 0.0,
    confidence: float = CONFIDENCE,
) -> HerschelBulkleyFit:
    """Return the least-squares fit of a Herschel-Bulkley fluid to shear stresses (Pa) at shear rates (1/s).

        tau = tau_y + K rate^n

    Arguments as for ``fit_bingham``. The confidence intervals are first-order in the errors; they are
    inaccurate if the range of rates is narrow or the exponent is poorly determined.

    Source: W. H. Herschel, R. Bulkley, Kolloid-Z. 39 (1926) 291.
    """
    x, y, sigma = _taken(rate, stress, error, above, 3)
    must(bool((x > 0).all()), "rate", "above 0", x.min())
    largest, scaled = x.max(), x / x.max()

    def law(x: np.ndarray, yields: float, thickness: float, exponent: float) -> np.ndarray:
        return np.asarray(yields + thickness * x**exponent)

    def best(exponent: float) -> tuple[float, np.ndarray]:
        columns = np.column_stack([np.ones_like(scaled), scaled**exponent])
        line = np.linalg.lstsq(columns, y, rcond=None)[0]
        return float(((columns @ line - y) ** 2).sum()), np.array([*line, exponent])

    # For a given exponent the other parameters are known, so a scan of exponents gives a good initial guess.
    _, start = min((best(n) for n in np.geomspace(0.1, 4.0, 40)), key=lambda one: one[0])
    (yields, thickness, exponent), covariance = _fitted(law, scaled, y, sigma, start)
    # The fitted coefficient is K rate^n at the largest rate.
    factor = largest**-exponent
    turn = np.array([[1, 0, 0], [0, factor, -thickness * factor * np.log(largest)], [0, 0, 1]])
    values = np.array([yields, thickness * factor, exponent])
    return HerschelBulkleyFit(*_estimates(values, turn @ covariance @ turn.T, len(x), sigma, confidence))


def fit_biviscous(
    rate: np.ndarray,
    stress: np.ndarray,
    error: np.ndarray | None = None,
    above: float = 0.0,
    confidence: float = CONFIDENCE,
) -> BiviscousFit:
    """Return the least-squares fit of a bi-viscous fluid to shear stresses (Pa) at shear rates (1/s).

        tau = min(eta_0 rate, tau_y + eta_p rate)

    The fluid creeps with the viscosity eta_0 up to the rate tau_y / (eta_0 - eta_p), and flows as a Bingham
    fluid above it. At least one rate must be below this rate and two above it. Arguments as for
    ``fit_bingham``. The confidence intervals take it as known on which line each point lies. They are too
    narrow if the noise hides this: 91 to 93 instead of 95 % of those of eta_0 contain the truth in a test in
    which the noise is larger than the distance of the two lines at the nearest point.

    Source: L21 section 1.3.2, after R. Stanway et al., Smart Mater. Struct. 5 (1996) 464.
    """
    x, y, sigma = _taken(rate, stress, error, above, 3)
    must(bool((x > 0).all()), "rate", "above 0", x.min())
    weights = 1 / (np.ones_like(y) if sigma is None else sigma)
    order, unit = np.argsort(x), x.max()

    def best(below: int) -> tuple[float, np.ndarray, np.ndarray]:
        """For this number of points below the yield stress: the weighted sum of squares, the parameters of
        the two lines, and their covariance for a noise of 1."""
        lines, slow, fast = np.zeros((len(x), 3)), order[:below], order[below:]
        lines[slow, 0], lines[fast, 1], lines[fast, 2] = x[slow] / unit, 1.0, x[fast] / unit
        weighted = lines * weights[:, None]
        values = np.linalg.lstsq(weighted, y * weights)[0]
        squares = ((_biviscous(x / unit, *values) - y) * weights) ** 2
        return float(squares.sum()), values, np.linalg.inv(weighted.T @ weighted)

    # For a given number of points on each line the fit is linear, so all of these numbers are tried.
    squares, values, covariance = min((best(k) for k in range(1, len(x) - 1)), key=lambda one: one[0])
    if sigma is None:
        covariance = covariance * squares / (len(x) - 3)
    scale = np.array([1 / unit, 1.0, 1 / unit])
    return BiviscousFit(
        *_estimates(scale * values, covariance * np.outer(scale, scale), len(x), sigma, confidence)
    )


def _biviscous(x: np.ndarray, rest: float, yields: float, plastic: float) -> np.ndarray:
    return np.minimum(rest * x, yields + plastic * x)


def _taken(
    rate: np.ndarray, stress: np.ndarray, error: np.ndarray | None, above: float, parameters: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Return the rates, stresses and errors to be fitted."""
    x, y = np.asarray(rate, float), np.asarray(stress, float)
    must(x.shape == y.shape and x.ndim == 1, "stress", f"of the shape of rate, {x.shape}", y.shape)
    sigma = None if error is None else np.broadcast_to(np.asarray(error, float), x.shape)
    must(sigma is None or bool((sigma > 0).all()), "error", "above 0", error)
    chosen = x > above
    number = int(chosen.sum())
    must(number > parameters, "rates", f"more than {parameters} above {above:g} 1/s", number)
    return x[chosen], y[chosen], None if sigma is None else sigma[chosen]


def _fitted(
    law: Callable[..., np.ndarray],
    x: np.ndarray,
    y: np.ndarray,
    sigma: np.ndarray | None,
    start: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the best-fit parameters and their covariance."""
    scale = float(np.abs(y).max()) or 1.0
    units = np.array([scale, scale, *np.ones(len(start) - 2)])
    errors = None if sigma is None else sigma / scale
    values, covariance = curve_fit(
        lambda x, *values: law(x, *(units * values)) / scale,
        x, y / scale, start / units, errors, absolute_sigma=sigma is not None,
        xtol=1e-14, ftol=1e-14, gtol=1e-14,
    )  # fmt: skip
    return units * values, np.outer(units, units) * covariance


def _estimates(
    values: np.ndarray, covariance: np.ndarray, number: int, sigma: np.ndarray | None, confidence: float
) -> list[Estimate]:
    """Return values with the half-widths of their confidence intervals."""
    part = 0.5 + confidence / 2
    width = norm.ppf(part) if sigma is not None else student.ppf(part, number - len(values))
    halves = width * np.sqrt(np.diag(covariance))
    return [Estimate(float(value), float(half)) for value, half in zip(values, halves, strict=True)]
