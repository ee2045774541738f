"""Calibration: the 95 % interval of each gene from measurements, and genes that cannot be distinguished.

It needs a problem whose objective is the Misfit of measured quantities. The responses of the quantities to
the genes, from the designs of the search, give the likelihood of the genes (optimize.analysis.likelihood): the
estimate of each gene, its 95 % interval and the correlations. The interval is a likelihood interval: it is
valid if the uncertainties of the measurements are right and their errors are normal and independent. It
includes the error of the responses, which is large where few designs were run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as chi2_distribution

from tisim.errors import Words, must
from tisim.optimize.analysis.likelihood import ONE_GENE_95, Evidence, Likelihood
from tisim.optimize.outcome import Outcome
from tisim.optimize.problem.feasibility import excess
from tisim.optimize.problem.gene_values import Value, brief
from tisim.optimize.problem.genes import Searched
from tisim.optimize.problem.problem import Problem
from tisim.optimize.problem.statistic import Misfit

Array = NDArray[np.float64]

UNTOLD = 1.0
"""A direction is undetermined if chi^2 grows less than this along it within the ranges of the genes."""
_ALMOST_ALL = 0.95
"""A gene is undetermined if its interval covers a larger part of its range than this."""
_TOGETHER = 0.9
"""Correlations of two estimates from this magnitude on are mentioned in the remarks."""
_COARSE = 0.7
"""Runs at the end of an interval are proposed if the error of a response there is larger than this, in
uncertainties of the measurement."""
_LITTLE = 0.05
"""A gene with a smaller share in the undetermined directions than this is not listed with them."""
_UNLIKELY = 0.01
"""If a chi^2 this large or larger has a lower probability, a remark says that the measurements are not
met."""


@dataclass(frozen=True)
class GeneEstimate:
    """The estimate of a gene and its 95 % interval, in the unit of the gene.

    estimate : the most likely value.
    low, high : ends of the 95 % interval.
    open_low, open_high : whether the interval extends to that end of the gene's range, and possibly beyond;
        it is then a one-sided bound.
    estimate_part, low_part, high_part : positions of these values within the range, 0..1, on the gene's
        scale.
    """

    name: str
    unit: str
    estimate: float
    low: float
    high: float
    open_low: bool
    open_high: bool
    estimate_part: float
    low_part: float
    high_part: float

    @property
    def part(self) -> float:
        """The part of the range that the interval covers, on the gene's scale."""
        return self.high_part - self.low_part

    @property
    def told(self) -> bool:
        """Whether the interval is narrower than the range."""
        return not (self.open_low and self.open_high) and self.part < _ALMOST_ALL

    @property
    def words(self) -> str:
        """The kind of interval, in words."""
        if not self.told:
            return "not told: its whole range"
        if self.open_low:
            return "from one side: at most"
        return "from one side: at least" if self.open_high else ""


@dataclass(frozen=True)
class Calibration:
    """The result of a calibration.

    genes : estimates of the numeric genes, in the order of the genome. Empty if too few designs are near the
        least misfit.
    choices : for each gene that is a choice, the choices of all designs whose chi^2 is less than 3.84 above
        the least.
    correlation : of the estimates, shape (genes, genes); NaN for an undetermined gene.
    chi2 : the least chi^2, of ``measurements`` quantities; the variances contain the errors of the responses.
    designs : number of designs that the responses are known from.
    missing : number of further designs near the least misfit that are needed for intervals.
    wanted : designs proposed for running: that number; or the ends of intervals that are wide because few
        designs were run there.
    remarks : sentences on genes that cannot be distinguished, and on reasons to doubt the intervals.
    """

    genes: tuple[GeneEstimate, ...]
    choices: dict[str, tuple[Value, ...]]
    correlation: Array
    chi2: float
    measurements: int
    designs: int
    missing: int
    wanted: tuple[dict[str, Any], ...]
    remarks: tuple[str, ...]


def calibration(outcome: Outcome) -> Calibration:
    """Return the calibration of the genes by the measurements, from all designs of a search.

    Genes that are choices are fixed at the choices of the best design, of those that satisfy the constraints
    of the result by their means if there are any. InputError if the objective is not a
    Misfit, or the search has no design.
    """
    problem = outcome.problem
    measured = problem.measured
    rule = "a Misfit in a problem that is calibrated"
    must(measured is not None, "statistic of the objective", rule, problem.objectives[0].statistic)
    must(outcome.best is not None, "search", "one with a design that has not failed", Words("none"))
    assert measured is not None
    measurements = len(measured.quantities)
    points, evidence = _evidence(outcome, measured)
    genome = problem.genome
    numbers = [k for k, gene in enumerate(genome.searched) if gene.kind != "category"]
    others = [k for k in range(len(genome)) if k not in numbers]
    allowed = _allowed(outcome)
    best = points[allowed][int(np.argmin(evidence.chi2[allowed]))]
    same = np.all(points[:, others] == best[others], axis=1)
    choices = _choices(problem, points[allowed], evidence.chi2[allowed], others)
    near = evidence.of(same, numbers)
    missing = near.missing if numbers else 0
    if missing or not numbers:
        remarks = [f"Too few designs are near the least misfit: {missing} more are needed."] if missing else []
        wanted = _wanted(problem, points[same], near.chi2, numbers, missing)
        return Calibration((), choices, np.empty((0, 0)), float(evidence.chi2.min()),
                           measurements, 0, missing, wanted, tuple(remarks))  # fmt: skip
    likelihood = Likelihood(near)
    searched = [genome.searched[k] for k in numbers]
    ends = [likelihood.interval(k) for k in range(len(numbers))]
    estimates = tuple(
        _estimate(gene, *(float(at[k]) for at in (likelihood.best, *ends[k])))
        for k, gene in enumerate(searched)
    )
    unknown, wide = _unknown(measured, likelihood, ends)
    wanted = []
    for end in wide:
        at = best.copy()
        at[numbers] = end
        wanted.append(genome.decode(at))
    return Calibration(
        genes=estimates,
        choices=choices,
        correlation=_correlation(likelihood),
        chi2=likelihood.chi2,
        measurements=measurements,
        designs=likelihood.designs,
        missing=0,
        wanted=tuple(wanted),
        remarks=(
            *_remarks(measurements, likelihood, searched, estimates),
            *unknown,
            *_violating(outcome, evidence),
        ),
    )


def _allowed(outcome: Outcome) -> NDArray[np.bool_]:
    """Return which designs satisfy the constraints of the result by their means; all if none does."""
    constraints = outcome.problem.result_constraints
    found = np.array([not excess(constraints, outcome.limits.get(one, ())) for one in outcome.estimates])
    return found if found.any() else ~found


def _violating(outcome: Outcome, evidence: Evidence) -> list[str]:
    """Return a remark if designs of a small chi^2 violate a constraint of the result."""
    constraints = outcome.problem.result_constraints
    near = evidence.chi2 < evidence.chi2.min() + ONE_GENE_95
    close = [one for one, is_near in zip(outcome.estimates, near, strict=True) if is_near]
    out = sum(excess(constraints, outcome.limits.get(one, ())) > 0 for one in close)
    words = (
        f"{out} of the {len(close)} designs with a chi^2 of less than {ONE_GENE_95:.2f} above the least "
        "violate a constraint: the intervals follow from the measurements alone and may contain such designs."
    )
    return [words] if out else []


def _evidence(outcome: Outcome, measured: Misfit) -> tuple[Array, Evidence]:
    """Return the points of the designs that did not fail, and their chi^2."""
    points = outcome.problem.genome.canonical(list(outcome.estimates))
    off = [measured.off(outcome.quantities[point]) for point in outcome.estimates]
    return points, Evidence.of_quantities(points, off, bool(outcome.settings.ensemble.common_starts))


def _estimate(gene: Searched, best: float, low: float, high: float) -> GeneEstimate:
    at, bottom, top = (float(gene.decode(u)) for u in (best, low, high))
    return GeneEstimate(gene.name, gene.unit, at, bottom, top, low <= 0.0, high >= 1.0, best, low, high)


def _unknown(
    measured: Misfit, likelihood: Likelihood, ends: Sequence[tuple[Array, Array]]
) -> tuple[list[str], list[Array]]:
    """Return a remark if intervals are wide because few designs were run at their ends, and these ends."""
    points = [end for pair in ends for end in pair]
    errors = np.array([likelihood.unknown(point) for point in points])
    wide = np.any(errors > _COARSE, axis=1)
    if not np.any(wide):
        return [], []
    worst = int(np.argmax(errors.max(axis=0)))
    quantity = tuple(measured.quantities)[worst]
    words = (
        f"Few designs were run near the ends of the intervals, where {quantity} is known to "
        f"{errors[:, worst].max():.2g} uncertainties of its measurement: runs there would narrow the intervals."
    )
    return [words], [point for point, is_wide in zip(points, wide, strict=True) if is_wide]


def _choices(
    problem: Problem, points: Array, chi2: Array, others: Sequence[int]
) -> dict[str, tuple[Value, ...]]:
    """Return for each gene that is a choice the choices of all designs close to the least chi^2."""
    good = points[chi2 < chi2.min() + ONE_GENE_95]
    genes = [(problem.genome.searched[k], k) for k in others]
    return {gene.name: tuple(dict.fromkeys(gene.decode(u) for u in good[:, k])) for gene, k in genes}


def _wanted(
    problem: Problem, points: Array, chi2: Array, numbers: Sequence[int], count: int
) -> tuple[dict[str, Any], ...]:
    """Return new designs around the best one, spread like the best of the designs that were run."""
    if not count:
        return ()
    least = np.argsort(chi2, kind="stable")
    best = points[least[: 2 * len(numbers) + 1]]
    width = np.maximum(best[:, numbers].std(axis=0), 0.02)
    rng = np.random.default_rng(len(points))
    drawn = np.tile(best[0], (count, 1))
    drawn[:, numbers] = np.clip(drawn[:, numbers] + width * rng.standard_normal((count, len(numbers))), 0, 1)
    return tuple(problem.genome.decode(u) for u in drawn)


def _remarks(
    measurements: int,
    likelihood: Likelihood,
    genes: Sequence[Searched],
    estimates: Sequence[GeneEstimate],
) -> list[str]:
    """Return remarks on genes that cannot be distinguished, and on reasons to doubt the intervals."""
    remarks = []
    growth, directions = likelihood.growth()
    correlation = likelihood.correlation
    free = growth < UNTOLD
    if np.any(free):
        remarks += _untold(directions[:, free], float(growth[free].max()), genes)
    known = {one.name for one in estimates if one.told}
    for i, one in enumerate(genes):
        for j, other in enumerate(genes[:i]):
            rho = correlation[i, j]
            if abs(rho) > _TOGETHER and {one.name, other.name} <= known:
                more = "less" if rho < 0 else "more"
                remarks.append(
                    f"{other.name} and {one.name} are hard to distinguish: more of one fits with {more} of "
                    f"the other (correlation {rho:.2f})."
                )
    freedom = max(measurements - len(genes), 1)
    if chi2_distribution.sf(likelihood.chi2, freedom) < _UNLIKELY:
        remarks.append(
            f"The model does not meet all measurements: the least chi^2 is {likelihood.chi2:.3g} of "
            f"{measurements} quantities. The intervals are valid only if it can."
        )
    return remarks


def _correlation(likelihood: Likelihood) -> Array:
    """Return the correlations of the estimates, NaN for a gene that is undetermined by itself.

    Such a gene fits equally well at any value, and its small correlations with others are due to chance.
    """
    growth, directions = likelihood.growth()
    alone = (directions[:, growth < UNTOLD] ** 2).sum(axis=1) > 1.0 - _LITTLE
    correlation = likelihood.correlation
    correlation[alone, :] = correlation[:, alone] = math.nan
    return correlation


def _untold(directions: Array, grown: float, genes: Sequence[Searched]) -> list[str]:
    """Return sentences that name the genes, or combinations of genes, that are undetermined.

    directions : shape (genes, directions), of the unit cube; chi^2 changes by ``grown`` or less along them.
    """
    parts = (directions**2).sum(axis=1)
    change = f"chi^2 changes by {grown:.2g} or less"
    alone = [gene.name for gene, part in zip(genes, parts, strict=True) if part > 1.0 - _LITTLE]
    told = [f"The measurements do not determine {_listed(alone)}: {change} over the range."] if alone else []
    mixed = [k for k, part in enumerate(parts) if _LITTLE <= part <= 1.0 - _LITTLE]
    if len(mixed) < 2:
        return told
    names = _listed([genes[k].name for k in mixed])
    if directions.shape[1] - len(alone) > 1:
        return [*told, f"{names} cannot be distinguished: {change} along several combinations of them."]
    one = directions[mixed, int(np.argmax((directions[mixed] ** 2).sum(axis=0)))]
    up = [genes[k].name for k, part in zip(mixed, one, strict=True) if part * one[0] > 0]
    down = [genes[k].name for k, part in zip(mixed, one, strict=True) if part * one[0] < 0]
    goes = f"for more {_listed(up)} with less {_listed(down)}" if down else "if all increase together"
    return [*told, f"{names} cannot be distinguished: {change} {goes}."]


def _listed(names: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def columns(result: Calibration) -> dict[str, list[Any]]:
    """Return the columns of calibration.csv: a row for each gene, and its correlations with all."""
    genes = result.genes
    table: dict[str, list[Any]] = {
        "gene": [one.name for one in genes],
        "unit": [one.unit for one in genes],
        "estimate": [one.estimate for one in genes],
        "95 % low": [one.low for one in genes],
        "95 % high": [one.high for one in genes],
        "part of its range": [one.part for one in genes],
        "interval": [one.words or "from both sides" for one in genes],
    }
    for k, one in enumerate(genes):
        table[f"correlation with {one.name}"] = [float(row[k]) for row in result.correlation]
    return table


def summary(result: Calibration) -> str:
    """Return one line on the data of the estimate."""
    if not math.isfinite(result.chi2) or not result.designs:
        return "no intervals"
    return (
        f"least chi^2 {result.chi2:.3g} of {result.measurements} measured quantities, by "
        f"{result.designs} designs"
    )


def shown(one: GeneEstimate) -> tuple[str, str, str]:
    """Return estimate and interval ends of a gene as text: "-" for no estimate, an open end in brackets."""
    low, high = brief(one.low), brief(one.high)
    estimate = brief(one.estimate) if one.told else "-"
    return estimate, f"[{low}]" if one.open_low else low, f"[{high}]" if one.open_high else high
