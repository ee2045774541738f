"""Sensitivity: the effect of each gene around the best design, and over its whole range.

Both are computed from a Gaussian process (optimize.surrogate) through the designs of the search. Around the
best design, one gene moves at a time. Over the whole range, the variance of an objective is divided among the
genes. The first-order index of a gene is the part that it explains alone; the total index is the part that
would be left if all other genes were known. The intervals come from functions drawn from the process.

Source: I. M. Sobol', Math. Comput. Simul. 55 (2001) 271-280; A. Saltelli and others, Comput. Phys. Commun.
181 (2010) 259-270.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.stats import qmc, sobol_indices, uniform

from tisim.errors import Words, must
from tisim.optimize.methods.individual import Individual
from tisim.optimize.outcome import Outcome
from tisim.optimize.problem.gene_values import Value
from tisim.optimize.problem.genome import Genome
from tisim.optimize.surrogate.draws import Draws
from tisim.optimize.surrogate.gaussian_process import GaussianProcess
from tisim.optimize.surrogate.noise import all_exact, costs_and_noise
from tisim.optimize.surrogate.selection import MOST_LEARNED, representative

Array = NDArray[np.float64]

MOVES = (-0.1, -0.01, 0.01, 0.1)
"""Moves of a gene from the best design, as fractions of its range."""
LEAST_Q2 = 0.5
"""Indices are reported if the surrogate predicts at least this part of the variance of left-out designs."""
_SAMPLES = 1024
"""Number of points in each of the two sample sets for the indices, a power of two; half of it for the
intervals."""
_DRAWN, _SETS, _RESAMPLED = 4, 3, 8
"""Number of functions drawn from a process; number of such draws, with their own points, from the process of
all designs; number of processes refitted to resampled designs."""
_NEAR, _SHORT = 5, 0.05
"""Number of designs near the best one that show how rough the objective is there; moves shorter than this
fraction of a range are short."""
_NORMAL_95 = 1.96
"""Half width of the 95 % interval of a normal variable, in standard deviations."""


@dataclass(frozen=True)
class Between:
    """A number and its 95 % interval."""

    value: float
    low: float
    high: float


UNKNOWN = Between(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class GeneSensitivity:
    """The effect of a gene on an objective.

    at : the gene's value in the best design.
    changes : change of the objective when the gene moves by a fraction of its range, by that fraction (-0.1,
        -0.01, 0.01, 0.1). It is unknown for a choice, and if the move does not change the value: at an end of
        the range, or for an integer.
    first, total : Sobol' indices over the whole range; unknown if the surrogate predicts too little.
    """

    name: str
    unit: str
    at: Value
    changes: Mapping[float, Between]
    first: Between
    total: Between


@dataclass(frozen=True)
class Sensitivity:
    """The effects of all genes on one objective.

    label : the objective, with its unit.
    genes : the searched genes.
    designs : number of designs that the surrogate is fitted to.
    q2 : predictive power of the surrogate, 0 to 1: the part of the variance over all ranges, without noise,
        that it predicts for each design from the others.
    doubt : "" or in words that the best design violates constraints of the result, or may do so; the changes
        are those around this design.
    """

    objective: str
    unit: str
    label: str
    genes: tuple[GeneSensitivity, ...]
    designs: int
    q2: Between
    doubt: str = ""

    @property
    def trusted(self) -> bool:
        """Whether the surrogate predicts enough of the variance for indices."""
        return self.q2.value >= LEAST_Q2


def least_designs(genome: Genome) -> int:
    """Return the smallest number of designs for an analysis."""
    return max(8, len(genome) + 2)


def sensitivity(outcome: Outcome) -> tuple[Sensitivity, ...]:
    """Return the effect of each gene on each objective, from the designs of a search.

    InputError if fewer than max(8, genes + 2) designs did not fail.
    """
    genome = outcome.problem.genome
    least = least_designs(genome)
    must(len(outcome.estimates) >= least, "search", f"of {least} designs or more that have not failed",
         Words(f"{len(outcome.estimates)}"))  # fmt: skip
    assert outcome.best is not None
    best = genome.canonical(list(outcome.best))
    points, costs, noise = _known(outcome)
    found = []
    for k, objective in enumerate(outcome.problem.objectives):
        model = GaussianProcess(genome.features(points), objective.sign * costs[:, k], noise[:, k])
        others = [_resampled(model, k) for k in range(_RESAMPLED)]
        q2 = _predicted(model, genome)
        unknown = [UNKNOWN] * len(genome)
        first, total = _indices(model, others, genome) if q2.value >= LEAST_Q2 else (unknown, unknown)
        genes = tuple(
            GeneSensitivity(
                name=gene.name,
                unit=gene.unit,
                at=gene.decode(float(best[j])),
                changes=_changes(model, others, genome, best, j),
                first=first[j],
                total=total[j],
            )
            for j, gene in enumerate(genome.searched)
        )
        named = objective.name, objective.unit, objective.label
        found.append(Sensitivity(*named, genes, len(points), q2, outcome.doubt))
    return tuple(found)


def _known(outcome: Outcome) -> tuple[Array, Array, Array]:
    """Return points, costs and variances of the costs of the designs that a surrogate is fitted to."""
    individuals = []
    for point, estimates in outcome.estimates.items():
        individual = Individual(point, len(estimates))
        individual.know(estimates)
        individuals.append(individual)
    costs, noise = costs_and_noise(individuals)
    chosen = representative(costs, MOST_LEARNED, all_exact(individuals))
    points = outcome.problem.genome.canonical([list(individual) for individual in individuals])
    return points[chosen], costs[chosen], noise[chosen]


def _predicted(model: GaussianProcess, genome: Genome) -> Between:
    """Return the part of the variance over all ranges that the process predicts for left-out designs.

    Each design is weighted by the part of the unit cube to which it is the nearest: most designs of a search
    lie close together, and are predicted well by their neighbours. The noise of a mean cannot be predicted,
    and is subtracted from both variances. The interval is that for a ratio of two weighted sums.

    Source: W. G. Cochran, Sampling Techniques, 3rd ed. (1977), Eq. 6.13.
    """
    drawn = qmc.Sobol(len(genome), rng=np.random.default_rng(3)).random_base2(12)
    _, nearest = cKDTree(model.points).query(genome.features(drawn))
    weight = np.bincount(nearest, minlength=len(model.points)) / len(drawn)
    missed = (model.left_out()[0] / model.scale) ** 2 - model.noise
    there = (model.values - weight @ model.values) ** 2 - model.noise
    if weight @ there <= 0.0:
        return Between(0.0, 0.0, 1.0)
    ratio = float(weight @ missed / (weight @ there))
    half = _NORMAL_95 * math.sqrt(float(weight**2 @ (missed - ratio * there) ** 2)) / float(weight @ there)
    value, low, high = np.clip([1.0 - ratio, 1.0 - ratio - half, 1.0 - ratio + half], 0.0, 1.0)
    return Between(float(value), float(low), float(high))


def _changes(
    model: GaussianProcess, others: list[GaussianProcess], genome: Genome, best: Array, j: int
) -> dict[float, Between]:
    """Return the changes of an objective when gene j moves from the best design.

    The half width of an interval is 1.96 times the root mean square deviation of the other processes'
    functions from the value, times the factor of ``_roughness``.
    """
    gene = genome.searched[j]
    if gene.kind == "category":
        return dict.fromkeys(MOVES, UNKNOWN)
    moved = np.tile(best, (len(MOVES), 1))
    moved[:, j] = np.clip(best[j] + np.array(MOVES), 0.0, 1.0)
    moved = genome.canonical(moved)
    at = genome.features(np.vstack([best, moved]))
    change, _ = _differences(model, at)
    means, variances = zip(*(_differences(one, at) for one in others), strict=True)
    half = _NORMAL_95 * np.sqrt(np.mean((np.array(means) - change) ** 2 + np.array(variances), axis=0))
    half *= _roughness(model, at[0])
    # At the end of a range the move is cut short.
    whole = np.abs(np.abs(moved[:, j] - best[j]) - np.abs(MOVES)) < 1e-9
    whole |= (gene.kind != "real") & (moved[:, j] != best[j])
    return {
        move: Between(float(c), float(c - h), float(c + h)) if there else UNKNOWN
        for move, c, h, there in zip(MOVES, change, half, whole, strict=True)
    }


def _roughness(model: GaussianProcess, best: Array) -> Array:
    """Return the factor by which each interval of ``_changes`` is widened, (moves,).

    A process has the same length scales and the same variance everywhere. Where the function is steeper than
    elsewhere, as in a narrow minimum, the process is too sure. Its leave-one-out residuals show this: in
    units of their own standard deviations they are larger than 1. The factor is the root of the mean square
    of these residuals for the designs nearest to the best one, and 1 or more. A move that is short against
    the distance of the designs depends on the steepest place among them: its factor is the largest of the
    residuals.

    Source: GPML section 5.4.2; inflation of the variance by residuals: R. T. Birge, Phys. Rev. 40 (1932)
    207-227.
    """
    residuals, deviations = model.left_out()
    distances = np.linalg.norm((model.points - best) / model.parameters.lengths, axis=1)
    near = np.argsort(distances, kind="stable")[:_NEAR]
    squares = (residuals[near] / deviations[near]) ** 2
    short = np.abs(MOVES) < _SHORT
    return np.sqrt(np.maximum(np.where(short, squares.max(), squares.mean()), 1.0))


def _differences(model: GaussianProcess, at: Array) -> tuple[Array, Array]:
    """Return mean and variance of the process at all points but the first, relative to the first."""
    means, _ = model.predict(at)
    explained = model.half_solved(at)
    joint = model.covariance(at, at) - explained.T @ explained
    variance = joint[0, 0] + np.diag(joint)[1:] - 2.0 * joint[0, 1:]
    return means[1:] - means[0], model.scale**2 * np.maximum(variance, 0.0)


def _indices(
    model: GaussianProcess, others: list[GaussianProcess], genome: Genome
) -> tuple[list[Between], list[Between]]:
    """Return the first-order and total indices of each gene.

    Values are means over functions drawn from the process. The half width of an interval is 1.96 times the
    root mean square deviation of the other processes' functions from the value.
    """
    whole = np.concatenate([_drawn(model, genome, [k, 0], _SAMPLES) for k in range(_SETS)])
    value = whole.mean(axis=0)
    drawn = np.concatenate([_drawn(other, genome, [k, 1], _SAMPLES // 2) for k, other in enumerate(others)])
    half = _NORMAL_95 * np.sqrt(((drawn - value) ** 2).mean(axis=0))
    first, total = (
        [Between(float(v), float(v - h), float(v + h)) for v, h in zip(*pair, strict=True)]
        for pair in zip(value, half, strict=True)
    )
    return first, total


def _drawn(model: GaussianProcess, genome: Genome, seed: list[int], samples: int) -> Array:
    """Return the indices of functions drawn from a process, shape (functions, 2, genes)."""
    rng = np.random.default_rng([*seed, 7])
    drawn = Draws(model, _DRAWN, rng)
    found = sobol_indices(
        func=lambda u: drawn(genome.features(u.T)), n=samples, dists=[uniform()] * len(genome), rng=rng
    )
    indices = np.stack([found.first_order, found.total_order], axis=-2)
    return np.asarray(indices.reshape(_DRAWN, 2, len(genome)))


def _resampled(model: GaussianProcess, k: int) -> GaussianProcess:
    """Return a process fitted to a bootstrap sample of the designs; each drawn design is used once.

    A single process treats its length scales as known, and its intervals are too narrow.

    Source: B. Efron, Ann. Statist. 7 (1979) 1-26.
    """
    count = len(model.points)
    chosen = np.unique(np.random.default_rng([k, 2]).integers(count, size=count))
    values = model.centre + model.scale * model.values[chosen]
    noise = model.scale**2 * model.noise[chosen]
    return GaussianProcess(model.points[chosen], values, noise, start=model.parameters, iterations=10)


def columns(found: tuple[Sensitivity, ...]) -> dict[str, list[Any]]:
    """Return the columns of sensitivity.csv: a row for each gene and objective."""
    rows = [(one, gene) for one in found for gene in one.genes]
    table: dict[str, list[Any]] = {
        "objective": [one.label for one, _ in rows],
        "gene": [gene.name for _, gene in rows],
        "unit": [gene.unit for _, gene in rows],
        "best": [gene.at for _, gene in rows],
    }
    for move in MOVES:
        _spread(table, f"change at {100 * move:+g} % of the range", [gene.changes[move] for _, gene in rows])
    _spread(table, "first-order index", [gene.first for _, gene in rows])
    _spread(table, "total index", [gene.total for _, gene in rows])
    table["designs"] = [one.designs for one, _ in rows]
    _spread(table, "Q2 left out", [one.q2 for one, _ in rows])
    return table


def _spread(table: dict[str, list[Any]], heading: str, of: list[Between]) -> None:
    table[heading] = [one.value for one in of]
    table[f"{heading}, 95 % low"] = [one.low for one in of]
    table[f"{heading}, 95 % high"] = [one.high for one in of]
