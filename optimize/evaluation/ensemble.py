"""Fitness of designs averaged over random starts until the running mean converges (Z04 Eq. 8.1).

Designs that compete for the first place can be given more starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from pydantic import Field, model_validator

from optimize.evaluation.estimate import FitnessEstimate, converged_after
from optimize.evaluation.runs import Evaluator, Runs, Sample
from optimize.problem.problem import Problem
from optimize.storage.cache import Cache
from optimize.storage.record import canonical
from tisim.components.component import Checked
from tisim.errors import must
from tisim.numerics.statistics import half_width

Design = Mapping[str, float]
Report = Callable[[float], None]


class EnsembleSettings(Checked):
    """How many random starts a fitness is averaged over.

    tolerance : TOL of Z04 Eq. 8.1. block : starts per evaluator call (the first block has min_starts if
    that is more). min_starts, max_starts : bounds of the number of starts. common_starts : start k is the
    same for every design, so that designs are compared on equal terms; False draws each design's own.
    race : starts that a generation spends, beyond Eq. 8.1, on telling the best designs apart (0: none).
    confirm : fresh starts from which the best designs are run again once the search has ended (0: not).
    """

    tolerance: float = Field(5e-4, gt=0, lt=1)
    block: int = Field(6, ge=1)
    min_starts: int = Field(4, ge=1)
    max_starts: int = Field(48, ge=1)
    common_starts: bool = True
    race: int = Field(0, ge=0)
    confirm: int = Field(0, ge=0)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.ensemble.block=2``."""
        return "search.ensemble"

    def once(self) -> EnsembleSettings:
        """Return the settings for a problem of which all starts of a design give the same."""
        return self.model_copy(update={"min_starts": 1, "max_starts": 1, "block": 1})

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

    budget : most runs that estimates and races may ask for (None: no end); exhausted : it has cut one short.
    runs : counts them. An estimate is a tuple, one FitnessEstimate of the cost for each
    objective.
    """

    def __init__(
        self,
        problem: Problem,
        evaluator: Evaluator,
        cache: Cache,
        settings: EnsembleSettings,
        seed: int,
        budget: int | None = None,
    ) -> None:
        self.settings = settings.once() if problem.deterministic else settings
        self.objectives = len(problem.objectives)
        self.runs = Runs(problem, evaluator, cache, seed, settings.common_starts)
        self.budget = math.inf if budget is None else budget
        self.exhausted = False
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
        size = max(settings.block, settings.min_starts)
        first, largest_fraction = 0, 0.0
        while running := [sample for sample in different if sample.open]:
            last = min(first + size, settings.max_starts)
            afforded = self._afforded(running, last - first)
            finished_designs = sum(
                1.0 if not sample.open else first / settings.max_starts for sample in different
            )
            share = len(afforded) * (last - first) / settings.max_starts

            def report(
                fraction: float, finished_designs: float = finished_designs, share: float = share
            ) -> None:
                nonlocal largest_fraction
                largest_fraction = max(
                    largest_fraction, (finished_designs + share * fraction) / len(different)
                )
                if progress is not None:
                    progress(largest_fraction)

            for sample in running[len(afforded) :]:
                sample.open = False
            self.runs.add([(sample, range(first, last)) for sample in afforded], report)
            for sample in afforded:
                if sample.reason:
                    sample.open = False
                    continue
                converged = converged_after(sample.costs, settings.tolerance, settings.min_starts)
                sample.used, sample.converged = converged or len(sample.costs), converged is not None
                sample.open = converged is None and last < settings.max_starts
            first, size = last, settings.block
        if progress is not None:
            progress(1.0)
        return [self._summary(sample) if sample.used or sample.reason else None for sample in samples]

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

    def confirm(
        self, designs: Sequence[Design], progress: Report | None = None
    ) -> list[tuple[FitnessEstimate, ...]]:
        """Return the estimates of each design from `confirm` starts that no other has used; the budget is not
        asked.

        A winner has won by being good and by being lucky in its starts; this is without the luck.
        """
        samples = [Sample(design) for design in designs]
        first = self.settings.max_starts
        starts = range(first, first + self.settings.confirm)
        self.runs.add([(sample, starts) for sample in samples], progress or (lambda fraction: None))
        for sample in samples:
            sample.used, sample.converged = len(sample.costs), True
        return [self._summary(sample) for sample in samples]

    def _sample(self, design: Design) -> Sample:
        return self._known.setdefault(canonical(dict(design)), Sample(design))

    def _afforded(self, running: list[Sample], starts: int) -> list[Sample]:
        room = (self.budget - self.requested) // starts
        if room < len(running):
            self.exhausted = True
            return running[: int(room)]
        return running

    def _unbeaten(self, samples: Sequence[Sample]) -> list[Sample]:
        good = [sample for sample in dict.fromkeys(samples) if not sample.reason]
        return [one for one in good if not any(_beats(other, one) for other in good)]

    def _summary(self, sample: Sample) -> tuple[FitnessEstimate, ...]:
        if sample.reason:
            failed = FitnessEstimate(math.inf, math.nan, math.nan, len(sample.costs), False, sample.reason)
            return (failed,) * self.objectives
        columns = zip(*sample.costs[: sample.used], strict=True)
        return tuple(FitnessEstimate.of(column, sample.converged) for column in columns)


def _beats(one: Sample, other: Sample) -> bool:
    """Return whether one is better in every objective, its 95 % confidence interval of the difference above
    0."""
    n = min(one.used, other.used)
    if n < 2:
        return False
    lead = np.array(other.costs[:n]) - np.array(one.costs[:n])
    return bool(np.all(np.mean(lead, axis=0) > half_width(lead)))
