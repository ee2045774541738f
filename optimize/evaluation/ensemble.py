"""Fitness of designs averaged over random starts: few for each, more for those that compete to be best."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from optimize.evaluation.estimate import FitnessEstimate, converged_after
from optimize.evaluation.runs import Evaluator, Runs, Sample
from optimize.problem.problem import Problem
from optimize.storage.cache import Cache
from optimize.storage.record import canonical
from tisim.components.component import Checked
from tisim.errors import must
from tisim.numerics.skewed import Moments, shared_skewness
from tisim.numerics.statistics import CONFIDENCE, half_width

Design = Mapping[str, Any]
Report = Callable[[float], None]
LOOKED_AT = 2
"""Designs that are run from two starts, to see whether these end in different states."""
EQUAL_STARTS, DIFFERENT_DESIGNS = 60, 3
"""What leaves no state is taken to be without noise when so many starts have repeated the costs of their
designs, and so many of these costs are different. Of an outcome of 1 run in 20 none is among 60 in 5 % of
cases; when each of two runs may have it, in 0.2 %."""
FRESH = 10**6
"""The number of the first start that only reports use. None of a search is as large."""


class EnsembleSettings(Checked):
    """How many random starts a fitness is averaged over.

    min_starts : starts of every design. tolerance : TOL of Z04 Eq. 8.1: starts are added, ``block`` in each
    call of the evaluator, until the mean changes by less than this part of it, max_starts at most. None: no
    more are added. common_starts : start k is the same for every design, so that designs are compared on
    equal terms; False: each design has starts of its own; None: what is best for the method.
    race : starts that a generation spends on telling the best designs apart (0: none).
    select : starts that each of the best designs gets once the search has ended, before the best is chosen.
    confirm : fresh starts of each of the best designs after that, from which they are reported (0: none, and
    no intervals). Of max_evaluations an eighth is kept for both, of several objectives a quarter; where that
    does not suffice, fewer designs are reported.
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
    at the designs that run, None before. runs : counts them. An estimate is a tuple, one FitnessEstimate of
    the cost for each objective.
    """

    def __init__(
        self,
        problem: Problem,
        evaluator: Evaluator,
        cache: Cache,
        settings: EnsembleSettings,
        seed: int,
    ) -> None:
        self.settings, self.objectives = settings, len(problem.objectives)
        self.runs = Runs(problem, evaluator, cache, seed, settings.common_starts is not False)
        self.budget = math.inf
        self.exhausted = False
        self.repeatable: bool | None = True if problem.deterministic else None
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
        if self.repeatable is None and settings.min_starts > 1:
            self._look(different)
        least = 1 if self.repeatable else settings.min_starts
        most = settings.max_starts if settings.tolerance and not self.repeatable else least
        largest_fraction = 0.0
        while running := [sample for sample in different if sample.open]:
            goals = {s: len(s.costs) + settings.block if len(s.costs) >= least else least for s in running}
            goals = {s: min(max(goal, len(s.costs)), most) for s, goal in goals.items()}
            afforded = self._afforded(running, goals)
            finished = sum(1.0 if not s.open else len(s.costs) / most for s in different)
            share = sum(goals[s] - len(s.costs) for s in afforded) / most

            def report(fraction: float, finished: float = finished, share: float = share) -> None:
                nonlocal largest_fraction
                largest_fraction = max(largest_fraction, (finished + share * fraction) / len(different))
                if progress is not None:
                    progress(largest_fraction)

            for sample in running[len(afforded) :]:
                sample.open = False
            self.runs.add([(s, range(len(s.costs), goals[s])) for s in afforded], report)
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
        tolerance, least = self.settings.tolerance, self.settings.min_starts
        converged = converged_after(sample.costs, tolerance, least) if tolerance else None
        sample.used = converged or len(sample.costs)
        sample.converged = converged is not None or bool(self.repeatable)
        sample.open = converged is None and len(sample.costs) < most

    def look(self) -> None:
        """Find out whether all starts of a design give the same run, where that is not known yet."""
        if self.repeatable is None:
            self._look([sample for sample in self._known.values() if sample.costs and not sample.reason])

    def _look(self, samples: Sequence[Sample]) -> None:
        """Run the first designs from two starts each, and see whether these end in the same state, to the
        last bit, after the same work. What leaves no state, as a plain function, is judged by its costs: rare
        outcomes are equal by chance, too."""
        group = samples[:LOOKED_AT]
        additions = [(sample, range(len(sample.costs), 2)) for sample in group]
        if sum(len(starts) for _, starts in additions) > self.budget - self.requested:
            return
        self.runs.add(additions)
        looked = [sample for sample in group if not sample.reason]
        if any(len(set(sample.costs[:2])) > 1 for sample in looked):
            self.repeatable = False
        elif looked and all(None not in sample.ends for sample in looked):
            self.repeatable = all(len(set(sample.ends[:2])) == 1 for sample in looked)
        else:
            self._judge_costs(self._known.values())

    def _judge_costs(self, samples: Iterable[Sample]) -> None:
        """Say whether starts matter, by the costs of those that there are, where these tell. A start that all
        designs have in common is one repeat, whatever their number."""
        several = [sample for sample in samples if len(sample.costs) > 1 and not sample.reason]
        if any(len(set(sample.costs)) > 1 for sample in several):
            self.repeatable = False
            return
        own = [len(one.costs) - 1 for one in several if one.own or not self.runs.common]
        common = [len(one.costs) - 1 for one in several if not one.own and self.runs.common]
        repeats = sum(own) + max(common, default=0)
        if repeats >= EQUAL_STARTS and len({sample.costs[0] for sample in several}) >= DIFFERENT_DESIGNS:
            self.repeatable = True

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
            additions = [(s, range(len(s.costs), goal)) for s, goal in goals.items()]
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
        additions = [(s, range(len(s.costs), len(s.costs) + starts)) for s in dict.fromkeys(samples)]
        self.runs.add(additions, progress or (lambda fraction: None))
        for sample, _ in additions:
            sample.used = len(sample.costs)
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
        if self.repeatable is None:
            self._judge_costs((*self._known.values(), *samples))
        for sample in samples:
            sample.used, sample.converged = len(sample.costs), bool(self.repeatable)
        good = [sample for sample in samples if not sample.reason]
        skewness = [
            shared_skewness([_column(sample, k) for sample in good], noise[k] if noise else None)
            for k in range(self.objectives)
        ]
        ranges = [self._range(good, k) for k in range(self.objectives)]
        return [self._summary(sample, skewness, ranges, confidence) for sample in samples]

    def constraint_means(self, design: Design) -> tuple[float, ...]:
        """Return the mean of each constraint of the result over the starts of a design that has run."""
        limited = self._sample(design).limited
        return tuple(float(np.mean(column)) for column in zip(*limited, strict=True))

    def _sample(self, design: Design) -> Sample:
        return self._known.setdefault(canonical(dict(design)), Sample(design))

    def _afforded(self, running: list[Sample], goals: Mapping[Sample, int]) -> list[Sample]:
        """Return those of the samples, from the first, whose starts the budget can pay."""
        left = self.budget - self.requested
        for count, sample in enumerate(running):
            left -= goals[sample] - len(sample.costs)
            if left < 0:
                self.exhausted = True
                return running[:count]
        return running

    def _unbeaten(self, samples: Sequence[Sample]) -> list[Sample]:
        good = [sample for sample in dict.fromkeys(samples) if not sample.reason]
        return [one for one in good if not any(_beats(other, one) for other in good)]

    def _summary(
        self,
        sample: Sample,
        skewness: Sequence[float | None] | None = None,
        ranges: Sequence[float] | None = None,
        confidence: float = CONFIDENCE,
    ) -> tuple[FitnessEstimate, ...]:
        if sample.reason:
            return (FitnessEstimate.failed(len(sample.costs), sample.reason),) * self.objectives
        columns = [_column(sample, k) for k in range(self.objectives)]
        if self.repeatable:
            return tuple(FitnessEstimate.certain(column[0]) for column in columns)
        return tuple(
            FitnessEstimate.of(
                column,
                sample.converged,
                _may_occur(column, sorted(seen), ranges[k] if ranges else math.inf),
                skewness[k] if skewness else None,
                confidence,
            )
            for k, (column, seen) in enumerate(zip(columns, self.runs.seen, strict=True))
        )

    def _range(self, samples: Sequence[Sample], objective: int) -> float:
        """Return the largest difference between two starts of one design that has been seen."""
        columns = [_column(one, objective) for one in (*self._known.values(), *samples) if one.used]
        return max((max(column) - min(column) for column in columns), default=0.0)


def _column(sample: Sample, objective: int) -> list[float]:
    """Return the costs of an objective that its estimate stands on."""
    return [costs[objective] for costs in sample.costs[: sample.used]]


def _may_occur(column: Sequence[float], seen: Sequence[float], most: float) -> Sequence[float]:
    """Return values that may occur beside equal ones of a design: those that differ by no more than ``most``
    from them, between the least and the largest of all designs. Where only two are known at all, these; where
    no difference between starts is known, all."""
    if len(seen) < 3 or not most:
        return seen
    return max(seen[0], column[0] - most), min(seen[-1], column[0] + most)


def _beats(one: Sample, other: Sample) -> bool:
    """Return whether one is better in every objective, its 95 % confidence interval of the difference above
    0."""
    n = min(one.used, other.used)
    if n < 2:
        return False
    lead = np.array(other.costs[:n]) - np.array(one.costs[:n])
    return bool(np.all(np.mean(lead, axis=0) > half_width(lead)))
