"""Fitness of designs averaged over random starts: few starts for each design, more for the best
candidates."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from tisim.numerics.skewed import Moments, shared_skewness
from tisim.numerics.statistics import CONFIDENCE, half_width
from tisim.optimize.evaluation.ensemble_settings import LOOKED_AT, EnsembleSettings, fewest_starts
from tisim.optimize.evaluation.estimate import FitnessEstimate, converged_after, may_occur
from tisim.optimize.evaluation.limits import held_out_limits, limits_of_search
from tisim.optimize.evaluation.runs import Evaluator, Runs, Sample
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.problem import Problem
from tisim.optimize.problem.statistic import Others
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.record import canonical

Design = Mapping[str, Any]
Report = Callable[[float], None]
FRESH = 10**6
"""The number of the first held-out start, used only for reports. Starts of a search have smaller numbers."""


class Ensemble:
    """Estimates the objectives of designs, and remembers each estimated design.

    budget : limit on the number of requested runs (inf: no limit).
    exhausted : whether the budget has cut an estimate short.
    repeatable : whether all starts of a design give the same run, so that one is enough. Determined from the
        first designs; None before.
    runs : runs and counts the evaluations.
    min_starts : starts of every design: the setting, or more if the statistics of the objectives need more.

    An estimate is a tuple with the FitnessEstimate of the cost of each objective.
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
        self.min_starts = fewest_starts(problem, settings)
        self._known: dict[bytes, Sample] = {}

    @property
    def requested(self) -> int:
        """The number of different runs requested."""
        return self.runs.evaluations + self.runs.hits

    def estimate(
        self, designs: Sequence[Design], progress: Report | None = None
    ) -> list[tuple[FitnessEstimate, ...] | None]:
        """Return the estimates of each design, in order; None if the budget ended before its first block.

        progress : called with the finished fraction, which never decreases. A design with any failed start
            has cost +inf.
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
        """Decide whether a sample has all its starts."""
        if sample.reason:
            sample.open = False
            return
        tolerance, least = self.settings.tolerance, self.min_starts
        converged = converged_after(self._running(sample), tolerance, least) if tolerance else None
        sample.used = converged or len(sample.values)
        sample.converged = converged is not None or bool(self.repeatable)
        sample.open = converged is None and len(sample.values) < most

    def look(self) -> None:
        """Determine whether all starts of a design give the same run, if that is not known yet."""
        if self.repeatable is None:
            self._look([sample for sample in self._known.values() if sample.values and not sample.reason])

    def _look(self, samples: Sequence[Sample]) -> None:
        """Run the first designs from two starts each, and compare their final states bit by bit, and their
        work.

        Runs without a final state, such as a function of design and seed, are never considered repeatable:
        equal values may be due to chance.
        """
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
        """Spend starts on the designs that may still be the best; return all estimates afterwards.

        Every round gives one more block of starts, up to max_starts, to each remaining design. A design is
        dropped when another one is significantly better in every objective: the 95 % confidence interval of
        the mean paired difference is above 0.

        Source: racing with paired t tests: O. Maron and A. W. Moore, NIPS 6 (1994) 59-66; M. Birattari et
        al., GECCO (2002) 11-18 (there "tNo-Race": no correction for repeated tests).
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
        """Add this number of starts to each design; return the estimates afterwards."""
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
    ) -> list[tuple[tuple[FitnessEstimate, ...], tuple[FitnessEstimate, ...]]]:
        """Return the estimates of each design from held-out starts, which are its own and not used elsewhere:
        of its objectives, and of the constraints of its result.

        The values of a selected design are biased by lucky starts; held-out starts remove this bias. The
        skewness of the noise is estimated from all designs together, because rare outcomes occur in only some
        of them.

        starts : number of held-out starts. first : number of the first one.
        noise : moments of the noise of each cost, as known from the search.
        confidence : of the intervals.
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
        estimates = [self._summary(sample, skewness, ranges, confidence) for sample in samples]
        return list(zip(estimates, self._held_out_limits(samples, confidence), strict=True))

    def limits(self, design: Design, *, held_out: bool = False) -> tuple[FitnessEstimate, ...]:
        """Return the estimate of each result constraint from the starts of a design that has run.

        held_out : whether these starts have not chosen the design, so that intervals hold; otherwise there is
            none unless all starts are the same.
        """
        sample = self._sample(design)
        if held_out:
            return self._held_out_limits([sample], CONFIDENCE)[0]
        return limits_of_search(sample, bool(self.repeatable))

    def _held_out_limits(
        self, samples: Sequence[Sample], confidence: float
    ) -> list[tuple[FitnessEstimate, ...]]:
        constraints, searched = self.runs.problem.result_constraints, list(self._known.values())
        return held_out_limits(constraints, samples, searched, bool(self.repeatable), confidence)

    def values(self, design: Design) -> np.ndarray:
        """Return the quantities of each start in a design's estimate, shape (starts, quantities)."""
        sample = self._sample(design)
        return np.array(sample.values[: sample.used], dtype=float).reshape(sample.used, -1)

    def _sample(self, design: Design) -> Sample:
        return self._known.setdefault(canonical(dict(design)), Sample(design))

    def _afforded(self, running: list[Sample], goals: Mapping[Sample, int]) -> list[Sample]:
        """Return the leading samples whose starts fit into the budget."""
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
        """Return whether one is better in every objective: the 95 % interval of the difference is above 0."""
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
        """Return the costs from the first 1, 2, ... starts, (starts, objectives)."""
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
            further = may_occur(one.pseudo_costs(part), costs, ranges[k] if ranges else math.inf)
            others = Others(further, skewness[k] if skewness else None)
            estimates.append(FitnessEstimate.of(one, part, sample.converged, others, confidence))
        return tuple(estimates)

    def _costs(self, sample: Sample) -> list[np.ndarray]:
        """Return for each objective the costs of the starts in a design's estimate."""
        parts = self._of_objectives(sample.values[: sample.used])
        return [one.pseudo_costs(part) for one, part in parts]

    def _ranges(self, by_design: Sequence[Sequence[np.ndarray]]) -> list[float]:
        """Return for each objective the largest difference between two starts of one design."""
        columns = zip(*by_design, strict=True)
        return [max(float(np.ptp(costs)) for costs in column if len(costs)) for column in columns]
