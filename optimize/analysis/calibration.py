"""Calibration: the 95 % interval of each gene from measurements, and genes that cannot be distinguished.

It needs a problem whose objective is the Misfit of measured quantities. The responses of the quantities to
the genes, from the designs of the search, give the likelihood of the genes (optimize.analysis.likelihood):
the estimate of each gene, its 95 % interval and the correlations. The interval is valid if the uncertainties
of the measurements are right and their errors are normal and independent. It includes the error of the
responses, which is large where few designs were run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tisim.errors import Words, must
from tisim.optimize.analysis.evidence import Evidence
from tisim.optimize.analysis.likelihood import ONE_GENE_95, Likelihood
from tisim.optimize.analysis.remarks import few_runs, remarks_on, undetermined
from tisim.optimize.outcome import Outcome
from tisim.optimize.problem.feasibility import excess
from tisim.optimize.problem.gene_values import Value, brief
from tisim.optimize.problem.genes import Searched
from tisim.optimize.problem.problem import Problem
from tisim.optimize.problem.statistic import Misfit

Array = NDArray[np.float64]

_ALMOST_ALL = 0.95
"""A gene is undetermined if its interval covers a larger part of its range than this."""


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
        words = f"Too few designs are near the least misfit: {missing} more are needed."
        wanted = _wanted(problem, points[same], near.chi2, numbers, missing)
        return Calibration((), choices, np.empty((0, 0)), float(evidence.chi2.min()),
                           measurements, 0, missing, wanted, (words,) if missing else ())  # fmt: skip
    likelihood = Likelihood(near)
    searched = [genome.searched[k] for k in numbers]
    ends = [likelihood.interval(k) for k in range(len(numbers))]
    estimates = tuple(
        _estimate(gene, *(float(at[k]) for at in (likelihood.best, *ends[k])))
        for k, gene in enumerate(searched)
    )
    known = [one.name for one in estimates if one.told]
    few, wide = few_runs(likelihood, tuple(measured.quantities), [end for pair in ends for end in pair])
    to_run = np.tile(best, (len(wide), 1))
    to_run[:, numbers] = np.reshape(wide, (len(wide), len(numbers)))
    return Calibration(
        genes=estimates,
        choices=choices,
        correlation=_correlation(likelihood),
        chi2=likelihood.chi2,
        measurements=measurements,
        designs=likelihood.designs,
        missing=0,
        wanted=tuple(genome.decode(point) for point in to_run),
        remarks=(
            *remarks_on(likelihood, [gene.name for gene in searched], known),
            *few,
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


def _correlation(likelihood: Likelihood) -> Array:
    """Return the correlations of the estimates, NaN for a gene that is undetermined by itself.

    Such a gene fits equally well at any value, and its small correlations with others are due to chance.
    """
    alone, correlation = undetermined(likelihood), likelihood.correlation
    correlation[alone, :] = correlation[:, alone] = math.nan
    return correlation


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
