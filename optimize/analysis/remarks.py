"""Remarks on a calibration: genes that cannot be distinguished, and reasons to doubt the intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as chi2_distribution

from tisim.optimize.analysis.likelihood import Likelihood

Array = NDArray[np.float64]

_UNTOLD = 1.0
"""A direction is undetermined if chi^2 grows less than this along it within the ranges of the genes."""
_TOGETHER = 0.9
"""Correlations of two estimates from this magnitude on are mentioned in the remarks."""
_COARSE = 0.7
"""Runs at the end of an interval are proposed if the error of a response there is larger than this, in
uncertainties of the measurement."""
_EQUAL = 1e-6
"""Errors count as equal up to this relative difference."""
_LITTLE = 0.05
"""A gene with a smaller share in the undetermined directions than this is not listed with them."""
_UNLIKELY = 0.01
"""If a chi^2 this large or larger has a lower probability, a remark says that the measurements are not
met."""


def remarks_on(likelihood: Likelihood, names: Sequence[str], known: Sequence[str]) -> list[str]:
    """Return sentences on genes that cannot be distinguished, and on measurements that are not met.

    names : of the genes. known : those whose intervals are narrower than their ranges.
    """
    remarks = []
    growth, directions = likelihood.growth()
    correlation = likelihood.correlation
    free = growth < _UNTOLD
    if np.any(free):
        remarks += _untold(directions[:, free], float(growth[free].max()), names)
    for i, one in enumerate(names):
        for j, other in enumerate(names[:i]):
            rho = correlation[i, j]
            if abs(rho) > _TOGETHER and one in known and other in known:
                more = "less" if rho < 0 else "more"
                remarks.append(
                    f"{other} and {one} are hard to distinguish: more of one fits with {more} of "
                    f"the other (correlation {rho:.2f})."
                )
    measurements = len(likelihood.responses)
    freedom = max(measurements - len(names), 1)
    if chi2_distribution.sf(likelihood.chi2, freedom) < _UNLIKELY:
        remarks.append(
            f"The model does not meet all measurements: the least chi^2 is {likelihood.chi2:.3g} of "
            f"{measurements} quantities. The intervals are valid only if it can."
        )
    return remarks


def undetermined(likelihood: Likelihood) -> NDArray[np.bool_]:
    """Return which genes are undetermined by themselves, shape (genes,)."""
    growth, directions = likelihood.growth()
    return np.asarray((directions[:, growth < _UNTOLD] ** 2).sum(axis=1) > 1.0 - _LITTLE)


def few_runs(
    likelihood: Likelihood, quantities: Sequence[str], points: Sequence[Array]
) -> tuple[list[str], list[Array]]:
    """Return a sentence if intervals are wide because few designs were run at their ends, and these ends.

    quantities : names of the measured quantities. points : the ends of all intervals.
    """
    errors = np.array([likelihood.unknown(point) for point in points])
    wide = np.any(errors > _COARSE, axis=1)
    if not np.any(wide):
        return [], []
    # Errors of noise-free quantities are equal to rounding: the first one is named.
    largest = errors.max(axis=0)
    worst = int(np.argmax(largest > (1.0 - _EQUAL) * largest.max()))
    words = (
        "Few designs were run near the ends of the intervals: the error of the simulated "
        f"{quantities[worst]} is up to {errors[:, worst].max():.2g} of the measured uncertainty there. Runs "
        "there would narrow the intervals."
    )
    return [words], [point for point, is_wide in zip(points, wide, strict=True) if is_wide]


def _untold(directions: Array, grown: float, names: Sequence[str]) -> list[str]:
    """Return sentences that name the genes, or combinations of genes, that are undetermined.

    directions : shape (genes, directions), of the unit cube; chi^2 changes by ``grown`` or less along them.
    """
    parts = (directions**2).sum(axis=1)
    change = f"chi^2 changes by {grown:.2g} or less"
    alone = [name for name, part in zip(names, parts, strict=True) if part > 1.0 - _LITTLE]
    told = [f"The measurements do not determine {_listed(alone)}: {change} over the range."] if alone else []
    mixed = [k for k, part in enumerate(parts) if _LITTLE <= part <= 1.0 - _LITTLE]
    if len(mixed) < 2:
        return told
    together = _listed([names[k] for k in mixed])
    if directions.shape[1] - len(alone) > 1:
        return [*told, f"{together} cannot be distinguished: {change} along several combinations of them."]
    one = directions[mixed, int(np.argmax((directions[mixed] ** 2).sum(axis=0)))]
    up = [names[k] for k, part in zip(mixed, one, strict=True) if part * one[0] > 0]
    down = [names[k] for k, part in zip(mixed, one, strict=True) if part * one[0] < 0]
    goes = f"for more {_listed(up)} with less {_listed(down)}" if down else "if all increase together"
    return [*told, f"{together} cannot be distinguished: {change} {goes}."]


def _listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
