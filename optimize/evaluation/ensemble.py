"""Fitness of designs averaged over random starts: few for each, more for those that compete to be best."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from pydantic import Field, model_validator
from tisim.optimize.evaluation.estimate import FitnessEstimate, converged_after
from tisim.optimize.evaluation.runs import Evaluator, Runs, Sample
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.problem import Problem
from tisim.optimize.problem.statistic import Others
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.record import canonical

from tisim.components.component import Checked
from tisim.errors import must
from tisim.numerics.skewed import Moments, shared_skewness
from tisim.numerics.statistics import CONFIDENCE, half_width

Design = Mapping[str, Any]
Report = Callable[[float], None]
LOOKED_AT = 2
"""Designs that are run from two starts, to see whether these differ."""
FRESH = 10**6
"""The number of the first start that only reports use. None of a search is as large."""


class EnsembleSettings(Checked):
    """How many random starts a fitness is averaged over.

    min_starts : starts of every design, more where the statistic of an objective needs more (10 for a 0.9
    quantile). tolerance : TOL of Z04 Eq. 8.1: starts are added, ``block`` in each call of the evaluator,
    until the mean changes by less than this part of it, max_starts at most. None: no more are added.
    common_starts : start k is the same for every design, so that designs are compared on equal terms; False:
    each design has starts of its own; None: what is best for the method.
    race : starts that a generation spends on telling the best designs apart (0: none).
    select : starts that each of the best designs gets once the search has ended, before the best is chosen.
    confirm : fresh starts of each of the best designs after that, from which they are reported (0: none, and
    no intervals); more where the interval of a statistic needs more. Of max_evaluations an eighth is kept for
    both, if they need as much, and a quarter for several objectives; where that does not suffice, fewer
    designs are reported.
    """

    min_starts: int = Field(2, ge=1)
    max_starts: int = Field(48, ge=1)
    tolerance: float | None = Field(None, gt=0, lt=1)
    block: int = Field(2, ge=1)
    common_starts: bool | None = None
    race: int = Field(0, ge=0)
    select: int = Field(4, ge=0)
    confirm: int = Field(16, ge=0)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.ensemble.block=2``."""
        return "search.ensemble"

    @model_validator(mode="after")
    def _ordered(self) -> EnsembleSettings:
        must(
            self.min_starts <= self.max_starts,
            "min_starts",
            f"<= max_starts = {self.max_starts}",
            self.min_starts,
        )
        return self


class Ensemble:
    """Estimates the objectives of designs; each design is known once it has been estimated.

    budget : most runs that may be asked for (inf: no end); exhausted : it has cut an estimate short.
    repeatable : whether all starts of a design give the same run, so that one is enough; found out by looking
    at the first designs, None before. runs : counts them. min_starts : of every design: those asked for, or
    what the statistics of the objectives need. An estimate is a tuple, one FitnessEstimate of the cost for
    each objective.
    """

    def __init__(
        self,
        problem: Problem,
        evaluator: Evaluator,
        cache: Cache,
        settings: EnsembleSettings,
        seed: int,
    ) -> None:
        self.settings, self.objectives = settings, problem.objectives
        self.runs = Runs(problem, evaluator, cache, seed, settings.common_starts is not False)
        self.budget = math.inf
        self.exhausted = False
        self.repeatable: bool | None = True if problem.deterministic else None
        self.min_starts = max(settings.min_starts, *(one.statistic.fewest_starts for one in self.objectives))
        self._known: dict[bytes, Sample] = {}

    @property
    def requested(self) -> int:
        """The number of different runs that have been requested."""
        return self.runs.evaluations + self.runs.hits

    def estimate(
        self, designs: Sequence[Design], progress: Report | None = None
    ) -> list[tuple[FitnessEstimate, ...] | None]:
        """Return the estimates of each design, in order; None where the budget was spent before its first
        block.

        progress is called with the finished fraction, never decreasing. A design with any failed start has
        cost +inf.
        """
        settings = self.settings
        samples = [self._sample(design) for design in designs]
        different = list(dict.fromkeys(samples))
        if self.repeatable is None and self.min_starts > 1:
            self._look(different)
        least = 1 if self.repeatable else self.min_starts
        most = settings.max_starts if settings.tolerance and not self.repeatable else least
        largest_fraction = 0.0
        while running := [sample for sample in different if sample.open]:
            goals = {s: len(s.values) + settings.block if len(s.values) >= least else least for s in running}
            goals = {s: min(max(goal, len(s.values)), most) for s, goal in goals.items()}
            afforded = self._afforded(running, goals)
            finished = sum(1.0 if not s.open else len(s.values) / most for s in different)
            share = sum(goals[s] - len(s.values) for s in afforded) / most

            def report(fraction: float, finished: float = finished, share: float = share) -> None:
                nonlocal largest_fraction
                largest_fraction = max(largest_fraction, (finished + share * fraction) / len(different))
                if progress is not None:
                    progress(largest_fraction)

            for sample in running[len(afforded) :]:
                sample.open = False
            self.runs.add([(s, range(len(s.values), goals[s])) for s in afforded], report)
            for sample in afforded:
                self._judge(sample, most)
        if progress is not None:
            progress(1.0)
        return [self._summary(sample) if sample.used or sample.reason else None for sample in samples]

    def _judge(self, sample: Sample, most: int) -> None:
        """Say whether a sample has all the starts that it is to have."""
        if sample.reason:
            sample.open = False
            return
        tolerance, least = self.settings.tolerance, self.min_starts
        converged = converged_after(self._running(sample), tolerance, least) if tolerance else None
        sample.used = converged or len(sample.values)
        sample.converged = converged is not None or bool(self.repeatable)
        sample.open = converged is None and len(sample.values) < most

    def look(self) -> None:
        """Find out whether all starts of a design give the same run, where that is not known yet."""
        if self.repeatable is None:
            self._look([sample for sample in self._known.values() if sample.values and not sample.reason])

    def _look(self, samples: Sequence[Sample]) -> None:
        """Run the first designs from two starts each, and see whether these end in the same state, to the
        last bit, after the same work. Of what leaves no state, as a function of design and seed, equal values
        do not tell: rare outcomes are equal by chance, too."""
        additions = [(sample, range(len(sample.values), 2)) for sample in samples[:LOOKED_AT]]
        if sum(len(starts) for _, starts in additions) > self.budget - self.requested:
            return
        self.runs.add(additions)
        if looked := [sample for sample, _ in additions if not sample.reason]:
            ends = [set(sample.ends[:2]) for sample in looked]
            self.repeatable = all(len(end) == 1 and None not in end for end in ends)

    def race(
        self, designs: Sequence[Design], progress: Report | None = None
    ) -> list[tuple[FitnessEstimate, ...]]:
        """Spend starts on those of the designs that may still be the best; all their estimates afterwards.

        Every round gives a block of starts more, up to max_starts, to each design that no other one beats
        surely: by the 95 % confidence interval of the mean difference, start by start, in every objective.
        Racing with paired t tests: O. Maron and A. W. Moore, NIPS 6 (1994) 59-66; M. Birattari et al., GECCO
        (2002) 11-18 (there "tNo-Race": no correction for repeated tests).
        """
        samples = [self._sample(design) for design in designs]
        racing = self._unbeaten(samples)
        purse = self.settings.race
        while len(racing) > 1:
            goals = {s: min(s.used + self.settings.block, self.settings.max_starts) for s in racing}
            additions = [(s, range(len(s.values), goal)) for s, goal in goals.items()]
            price = sum(len(starts) for _, starts in additions)
            if (
                price > purse
                or price > self.budget - self.requested
                or all(s.used == goals[s] for s in racing)
            ):
                break
            self.runs.add(additions, progress or (lambda fraction: None))
            purse -= price
            for sample, goal in goals.items():
                sample.used = goal
            racing = self._unbeaten(racing)
        return [self._summary(sample) for sample in samples]

    def more(
        self, designs: Sequence[Design], starts: int, progress: Report | None = None
    ) -> list[tuple[FitnessEstimate, ...]]:
        """Give each of these designs that number of starts more; their estimates afterwards."""
        samples = [self._sample(design) for design in designs]
        additions = [(s, range(len(s.values), len(s.values) + starts)) for s in dict.fromkeys(samples)]
        self.runs.add(additions, progress or (lambda fraction: None))
        for sample, _ in additions:
            sample.used = len(sample.values)
        return [self._summary(sample) for sample in samples]

    def fresh(
        self,
        designs: Sequence[Design],
        starts: int,
        first: int = FRESH,
        progress: Report | None = None,
        noise: Sequence[Moments] | None = None,
        confidence: float = CONFIDENCE,
    ) -> list[tuple[FitnessEstimate, ...]]:
        """Return the estimates of each design from that number of starts that nothing else has used, and that
        are its own.

        A winner has won by being good and by being lucky in its starts; this is without the luck. Designs
        tell each other how skewed noise is: rare outcomes have come to some of them. first : the number of
        the first start. noise : what the search knows of the noise of each cost. confidence : of intervals.
        """
        samples = [Sample(design, own=True) for design in designs]
        additions = [(sample, range(first, first + starts)) for sample in samples]
        self.runs.add(additions, progress or (lambda fraction: None))
        for sample in samples:
            sample.used, sample.converged = len(sample.values), bool(self.repeatable)
        good = [sample for sample in samples if not sample.reason]
        by_design = [self._costs(sample) for sample in good]
        skewness = [
            shared_skewness([costs[k] for costs in by_design], noise[k] if noise else None)
            for k in range(len(self.objectives))
        ]
        searched = [self._costs(sample) for sample in self._known.values() if sample.used]
        ranges = self._ranges([*searched, *by_design])
        return [self._summary(sample, skewness, ranges, confidence) for sample in samples]

    def constraint_means(self, design: Design) -> tuple[float, ...]:
        """Return the mean of each constraint of the result over the starts of a design that has run."""
        limited = self._sample(design).limited
        return tuple(float(np.mean(column)) for column in zip(*limited, strict=True))

    def values(self, design: Design) -> np.ndarray:
        """Return the quantities of each start that the estimate of a design stands on, (starts,
        quantities)."""
        sample = self._sample(design)
        return np.array(sample.values[: sample.used], dtype=float).reshape(sample.used, -1)

    def _sample(self, design: Design) -> Sample:
        return self._known.setdefault(canonical(dict(design)), Sample(design))

    def _afforded(self, running: list[Sample], goals: Mapping[Sample, int]) -> list[Sample]:
        """Return those of the samples, from the first, whose starts the budget can pay."""
        left = self.budget - self.requested
        for count, sample in enumerate(running):
            left -= goals[sample] - len(sample.values)
            if left < 0:
                self.exhausted = True
                return running[:count]
        return running

    def _unbeaten(self, samples: Sequence[Sample]) -> list[Sample]:
        good = [sample for sample in dict.fromkeys(samples) if not sample.reason]
        return [one for one in good if not any(self._beats(other, one) for other in good)]

    def _beats(self, one: Sample, other: Sample) -> bool:
        """Return whether one is better in every objective, its 95 % confidence interval of the difference
        above 0."""
        n = min(one.used, other.used)
        if n < 2:
            return False
        lead = self._pseudo_costs(other, n) - self._pseudo_costs(one, n)
        return bool(np.all(np.mean(lead, axis=0) > half_width(lead)))

    def _pseudo_costs(self, sample: Sample, starts: int) -> np.ndarray:
        """Return a cost for each of the first starts and each objective, (starts, objectives)."""
        parts = self._of_objectives(sample.values[:starts])
        return np.column_stack([one.pseudo_costs(part) for one, part in parts])

    def _running(self, sample: Sample) -> np.ndarray:
        """Return the costs by the first 1, 2, ... starts, (starts, objectives)."""
        parts = self._of_objectives(sample.values)
        counts = range(1, len(sample.values) + 1)
        return np.array([[one.cost(part[:n]) for one, part in parts] for n in counts])

    def _of_objectives(self, values: Sequence[tuple[float, ...]]) -> list[tuple[Objective, np.ndarray]]:
        """Return each objective with its own columns of the values of starts."""
        columns = np.array(values, dtype=float).reshape(len(values), -1)
        ends = np.cumsum([len(one.quantities) for one in self.objectives])[:-1]
        return list(zip(self.objectives, np.split(columns, ends, axis=1), strict=True))

    def _summary(
        self,
        sample: Sample,
        skewness: Sequence[float | None] | None = None,
        ranges: Sequence[float] | None = None,
        confidence: float = CONFIDENCE,
    ) -> tuple[FitnessEstimate, ...]:
        if sample.reason:
            return (FitnessEstimate.failed(len(sample.values), sample.reason),) * len(self.objectives)
        if self.repeatable:
            parts = self._of_objectives(sample.values[:1])
            return tuple(FitnessEstimate.certain(one.cost(part)) for one, part in parts)
        seen = dict(zip(self.runs.problem.quantities, self.runs.seen, strict=True))
        estimates = []
        for k, (one, part) in enumerate(self._of_objectives(sample.values[: sample.used])):
            costs = sorted(one.sign * value for value in seen[one.quantities[0]])
            may_occur = _may_occur(one.pseudo_costs(part), costs, ranges[k] if ranges else math.inf)
            others = Others(may_occur, skewness[k] if skewness else None)
            estimates.append(FitnessEstimate.of(one, part, sample.converged, others, confidence))
        return tuple(estimates)

    def _costs(self, sample: Sample) -> list[np.ndarray]:
        """Return for each objective a cost of each start that the estimate of a design stands on."""
        parts = self._of_objectives(sample.values[: sample.used])
        return [one.pseudo_costs(part) for one, part in parts]

    def _ranges(self, by_design: Sequence[Sequence[np.ndarray]]) -> list[float]:
        """Return for each objective the largest difference between two starts of one design."""
        columns = zip(*by_design, strict=True)
        return [max(float(np.ptp(costs)) for costs in column if len(costs)) for column in columns]


def _may_occur(costs: np.ndarray, seen: Sequence[float], most: float) -> Sequence[float]:
    """Return costs that may occur beside equal ones of a design: those that differ by no more than ``most``
    from them, between the least and the largest of all designs. Where only two are known at all, these; where
    no difference between starts is known, all."""
    if len(seen) < 3 or not most:
        return seen
    return max(seen[0], float(costs[0]) - most), min(seen[-1], float(costs[0]) + most)
