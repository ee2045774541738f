"""Comparison of search methods on a problem with several objectives, by the hypervolumes of their fronts.

Each search gives a front, whose designs are run again from held-out starts. The hypervolume is the part of a
box that these means dominate: 0 for no design, and 1 for a design that is best in every objective. The box is
the same for all searches of a comparison: from the best value of each objective among all designs of all
fronts to the worst value, and a tenth of this range beyond.

Source: E. Zitzler and L. Thiele, PPSN V, LNCS 1498 (1998) 292-301; the margin of a tenth: H. Ishibuchi and
others, Evol. Comput. 26 (2018) 411-440.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from deap.benchmarks.tools import hypervolume
from numpy.typing import NDArray
from rich.table import Table

from tisim.console import plain_table
from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.outcome import Outcome
from tisim.optimize.problem.feasibility import excess
from tisim.optimize.problem.problem import Problem
from tisim.optimize.surrogate.ranking import spread

MOST_DESIGNS = 16
"""Largest number of designs of a front that are run again; of more, those spread over it are."""
MARGIN = 0.1
"""Distance of the reference point from the worst values, over the range of each objective."""
HYPERVOLUME_NOTE = (
    "hypervolume: part of the box around all fronts, and a tenth beyond their worst values, that a front "
    "dominates; median, lowest, highest: of the searches, from held-out (fresh) starts; claimed: median by "
    "the searches' own estimates"
)
VIOLATIONS_NOTE = "violated: designs whose mean violates a constraint, which do not count"
Points = NDArray[np.float64]


@dataclass(frozen=True)
class FrontResult:
    """The result of one search.

    claimed, fresh : costs of the designs of its front, from the search and from held-out starts, (designs,
        objectives).
    excesses : total violation of the constraints of the result by each design, from the held-out starts.
    """

    method: str
    repeat: int
    evaluations: int
    claimed: Points
    fresh: Points
    excesses: Points

    @property
    def violated(self) -> int:
        """Return the number of designs that violate a constraint."""
        return int(np.count_nonzero(self.excesses))

    @property
    def allowed(self) -> Points:
        """Return the costs from held-out starts of the designs that violate no constraint."""
        return self.fresh[(self.excesses == 0) & np.isfinite(self.fresh).all(axis=1)]


def front_result(method: str, repeat: int, outcome: Outcome, fresh_ensemble: Ensemble) -> FrontResult:
    """Return the result of a search whose hall is not empty."""
    problem = outcome.problem
    costs = np.array([[one.mean for one in each.estimates] for each in outcome.hall])
    chosen = spread(costs, MOST_DESIGNS)
    designs = [problem.genome.decode(outcome.hall[k]) for k in chosen]
    estimates = fresh_ensemble.estimate(designs)
    assert all(one is not None for one in estimates)  # this ensemble has no budget
    return FrontResult(
        method,
        repeat,
        outcome.evaluations + outcome.hits,
        costs[chosen],
        np.array([[one.mean for one in each or ()] for each in estimates]),
        np.array(
            [excess(problem.result_constraints, fresh_ensemble.limits(one, held_out=True)) for one in designs]
        ),
    )


def hypervolumes(results: Sequence[FrontResult]) -> list[tuple[float, float]]:
    """Return the hypervolume of each front from held-out starts, and by the estimates of its search."""
    every = np.concatenate([one.allowed for one in results])
    if not len(every):
        return [(0.0, 0.0)] * len(results)
    low, span = every.min(axis=0), np.ptp(every, axis=0)
    # If all designs agree in an objective, it does not count.
    unit = np.where(span > 0, span, 1.0)
    return [(_volume((one.allowed - low) / unit), _volume((one.claimed - low) / unit)) for one in results]


def _volume(scaled: Points) -> float:
    """Return the part of the box from 0 to 1 + MARGIN in each objective that costs dominate."""
    reference = np.full(scaled.shape[1], 1.0 + MARGIN)
    inside = np.maximum(scaled[(scaled < reference).all(axis=1)], 0.0)
    if not len(inside):
        return 0.0
    # DEAP maximises, and reads fitness.wvalues.
    front = [SimpleNamespace(fitness=SimpleNamespace(wvalues=tuple(-one))) for one in inside]
    return float(hypervolume(front, reference) / reference.prod())


def table(problem: Problem, results: Sequence[FrontResult]) -> Table:
    """Return a table with a line for each method, the largest median first."""
    verdicts = ("violated",) if problem.result_constraints else ()
    grid = plain_table(
        "method", "searches", "runs each", "designs", *verdicts, "median", "lowest", "highest", "claimed"
    )
    names = ", ".join(objective.label for objective in problem.objectives)
    grid.title, grid.title_justify = f"hypervolume of {names}", "left"
    grid.caption, grid.caption_justify = HYPERVOLUME_NOTE, "left"
    if verdicts:
        grid.caption = f"{HYPERVOLUME_NOTE}; {VIOLATIONS_NOTE}"
    volumes = np.array(hypervolumes(results))
    rows: dict[str, list[int]] = {}
    for k, one in enumerate(results):
        rows.setdefault(one.method, []).append(k)
    for method, mine in sorted(rows.items(), key=lambda item: -float(np.median(volumes[item[1], 0]))):
        fresh, claimed = volumes[mine].T
        runs = sorted({results[k].evaluations for k in mine})
        each = str(runs[0]) if len(runs) == 1 else f"{runs[0]}..{runs[-1]}"
        designs = sum(len(results[k].fresh) for k in mine)
        counts = [str(sum(results[k].violated for k in mine))] if verdicts else []
        numbers = np.median(fresh), fresh.min(), fresh.max(), np.median(claimed)
        grid.add_row(method, str(len(mine)), each, str(designs), *counts, *(f"{one:.4f}" for one in numbers))
    return grid


def as_csv(problem: Problem, results: Sequence[FrontResult]) -> bytes:
    """Return a CSV file with a line for each design of each front, and all digits."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    labels = [objective.label for objective in problem.objectives]
    writer.writerow(
        (
            "method",
            "repeat",
            "runs",
            "hypervolume",
            "hypervolume claimed",
            *(f"{label}, fresh starts" for label in labels),
            *(f"{label}, claimed" for label in labels),
            *(("violation",) if problem.result_constraints else ()),
        )
    )
    signs = np.array([objective.sign for objective in problem.objectives])
    for one, volumes in zip(results, hypervolumes(results), strict=True):
        for fresh, claimed, over in zip(one.fresh * signs, one.claimed * signs, one.excesses, strict=True):
            last = (float(over),) if problem.result_constraints else ()
            writer.writerow(
                (one.method, one.repeat, one.evaluations, *volumes, *fresh.tolist(), *claimed.tolist(), *last)
            )
    return text.getvalue().encode()
