"""Estimates of the constraints of the result, from the starts of designs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tisim.numerics.skewed import shared_skewness
from tisim.optimize.evaluation.estimate import FitnessEstimate, may_occur
from tisim.optimize.evaluation.runs import Sample
from tisim.optimize.problem.constraint import InequalityConstraint
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.statistic import Others


def limits_of_search(sample: Sample, repeatable: bool) -> tuple[FitnessEstimate, ...]:
    """Return the estimate of each constraint from the starts of a design, in the constraint's unit.

    It has no interval unless all starts are the same, because these starts also choose the design.

    repeatable : whether all starts of a design give the same run.
    """
    return tuple(_without_interval(column, repeatable) for column in zip(*sample.limited, strict=True))


def _without_interval(values: Sequence[float], repeatable: bool) -> FitnessEstimate:
    if repeatable:
        return FitnessEstimate.certain(values[0])
    std = float(np.std(values, ddof=1)) if len(values) > 1 else math.nan
    return FitnessEstimate(float(np.mean(values)), std, math.nan, math.nan, len(values), False)


def held_out_limits(
    constraints: Sequence[InequalityConstraint],
    samples: Sequence[Sample],
    searched: Sequence[Sample],
    repeatable: bool,
    confidence: float,
) -> list[tuple[FitnessEstimate, ...]]:
    """Return the estimates of the constraints for each sample of held-out starts, with intervals.

    The skewness is shared by all samples, and values that a sample does not have may occur if others have
    them. If a start of a sample has failed, its values are not known, which counts as a violation.

    searched : the samples of the search. confidence : of the intervals.
    """
    columns: list[list[FitnessEstimate]] = [[] for _ in samples]
    for k, constraint in enumerate(constraints):
        by_sample = [np.array([row[k] for row in sample.limited]) for sample in samples]
        good = [values for values, one in zip(by_sample, samples, strict=True) if not one.reason]
        known = [np.array([row[k] for row in one.limited]) for one in searched if one.limited]
        skewness = shared_skewness(good)
        seen = np.unique(np.concatenate([[], *good, *known])).tolist()
        most = max((float(np.ptp(values)) for values in [*good, *known]), default=0.0)
        mean = Objective(constraint.name, float)
        for column, values, sample in zip(columns, by_sample, samples, strict=True):
            if sample.reason:
                failed = FitnessEstimate.failed(len(values), sample.reason)
                column.append(replace(failed, mean=math.nan))
            elif repeatable:
                column.append(FitnessEstimate.certain(float(values[0])))
            else:
                others = Others(may_occur(values, seen, most), skewness)
                column.append(FitnessEstimate.of(mean, values, False, others, confidence))
    return [tuple(column) for column in columns]
