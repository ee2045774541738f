"""The genetic search: generations, their log, stopping rules, and what is left in the cache file.

A search is a function of its problem, settings and evaluator settings. Resuming is therefore running it again
on the same cache file: every finished evaluation comes from there, the rest follows as if never stopped.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from deap import tools

from optimize.breeding import Breeder, Individual
from optimize.cache import Cache
from optimize.ensemble import Ensemble, Evaluator
from optimize.outcome import Outcome, Progress, Stopped
from optimize.problem import Problem
from optimize.settings import Settings, identity
from optimize.stored import searches, store


class _OutOfTime(Exception):
    """The wall-clock budget is spent in the middle of a generation."""


def search(
    problem: Problem,
    evaluator: Evaluator,
    cache: Cache,
    settings: Settings | None = None,
    *,
    on_generation: Callable[[Progress], None] | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Outcome:
    """Minimise the problem's fitness over its genome (Z04 sections 7 and 8).

    on_generation is called after each generation, on_progress as evaluations finish. After each generation
    settings, versions, logbook and hall of fame are in the cache file, below Outcome.name.
    KeyboardInterrupt ends the search cleanly and is reported in Outcome.stopped.
    Raises InputError for operators that cannot work on the genome, RunError if the disk is full.
    """
    return _Search(problem, evaluator, cache, settings or Settings(), on_generation, on_progress).run()


def _successful(function: Callable[[Any], Any], otherwise: float) -> Callable[[Any], float]:
    """The statistic over the designs that did not fail."""

    def statistic(values: Any) -> float:
        finite = [value for value in values if math.isfinite(value)]
        return float(function(finite)) if finite else otherwise

    return statistic


class _Search:
    def __init__(
        self,
        problem: Problem,
        evaluator: Evaluator,
        cache: Cache,
        settings: Settings,
        on_generation: Callable[[Progress], None] | None,
        on_progress: Callable[[Progress], None] | None,
    ) -> None:
        self.problem, self.cache, self.settings = problem, cache, settings
        self.on_generation, self.on_progress = on_generation, on_progress
        self.ensemble = Ensemble(problem, evaluator, cache, settings.ensemble, settings.seed)
        self.breeder = Breeder(len(problem.genome), settings, settings.seed)
        self.hall = tools.HallOfFame(settings.hall_of_fame)
        self.ranked: list[Individual] = []
        self.statistics = tools.Statistics(lambda string: string.fitness.values[0])
        self.statistics.register("best", _successful(np.min, math.inf))
        self.statistics.register("mean", _successful(np.mean, math.nan))
        self.statistics.register("std", _successful(np.std, math.nan))
        self.outcome = Outcome(problem, settings, identity(problem, settings, evaluator.settings))
        self.began = time.monotonic()

    def run(self) -> Outcome:
        if self.outcome.name not in searches(self.cache):
            self._store()  # from now on the file is known to be of this search
        try:
            self._generations()
            self._confirm()
        except KeyboardInterrupt:
            self.outcome.stopped = "interrupted"
        except _OutOfTime:
            self.outcome.stopped = "wall clock"
        self._store()
        return self.outcome

    def _confirm(self) -> None:
        """Run the best designs again from fresh starts, and rank them by that."""
        if not self.settings.ensemble.confirm or not self.hall or self._out_of_time():
            return
        ranked = list(self.hall)
        last = len(self.outcome.logbook) - 1
        designs = [self.problem.genome.decode(string) for string in ranked]
        found = self.ensemble.confirm(designs, lambda fraction: self._report(last, 1.0))
        for string, estimate in zip(ranked, found, strict=True):
            string.confirmed = estimate
        order = sorted(range(len(ranked)), key=lambda k: found[k].mean)
        self.ranked = [ranked[k] for k in order]

    def _generations(self) -> None:
        population = self.breeder.first()
        for generation in range(self.settings.generations + 1):
            box = float(self.breeder.box.width.mean())
            asked = self.ensemble.evaluations + self.ensemble.hits
            fresh = self._estimate(population, generation)
            self.hall.update([string for string in population if string.fitness.values[0] < math.inf])
            every = self.settings.recentre_every
            recentred = bool(every and generation and generation % every == 0 and self.hall)
            if recentred:
                self.breeder.recentre(self.hall[0])
            self.outcome.logbook.record(
                gen=generation,
                designs=fresh,
                starts=self.ensemble.evaluations + self.ensemble.hits - asked,
                failed=sum(string.fitness.values[0] == math.inf for string in population),
                box=box,
                recentred=recentred,
                **self.statistics.compile(population),
            )
            self._store()
            if self.on_generation is not None:
                self.on_generation(self._progress(generation, 1.0))
            self.outcome.stopped = self._stop(generation)
            if self.outcome.stopped:
                return
            population = self.breeder.following(population)

    def _estimate(self, population: list[Individual], generation: int) -> int:
        """Estimate the strings whose fitness is not known yet; return how many they were."""

        fresh = [string for string in population if not string.fitness.valid]
        designs = [self.problem.genome.decode(string) for string in fresh]
        found = self.ensemble.estimate(designs, lambda fraction: self._report(generation, fraction))
        for string, estimate in zip(fresh, found, strict=True):
            string.estimate = estimate
            string.fitness.values = (estimate.mean,)
        return len(fresh)

    def _report(self, generation: int, fraction: float) -> None:
        if self.on_progress is not None:
            self.on_progress(self._progress(generation, fraction))
        if self._out_of_time():
            raise _OutOfTime

    def _stop(self, generation: int) -> Stopped:
        best = self.outcome.logbook.select("best")
        wish = self.settings
        if wish.target is not None and best[-1] <= wish.target:
            return "target"
        if wish.patience is not None and generation - best.index(min(best)) >= wish.patience:
            return "patience"
        asked = self.ensemble.evaluations + self.ensemble.hits
        if wish.max_evaluations is not None and asked >= wish.max_evaluations:
            return "evaluations"
        if generation == wish.generations:
            return "generations"
        return "wall clock" if self._out_of_time() else ""

    def _out_of_time(self) -> bool:
        budget = self.settings.wall_clock_s
        return budget is not None and time.monotonic() - self.began >= budget

    def _progress(self, generation: int, fraction: float) -> Progress:
        best = self.hall[0] if self.hall else None
        return Progress(
            generation=generation,
            generations=self.settings.generations,
            fraction=fraction,
            best_fitness=best.fitness.values[0] if best else math.inf,
            best_design=self.problem.genome.decode(best) if best else None,
            evaluations=self.ensemble.evaluations,
            hits=self.ensemble.hits,
            elapsed_s=time.monotonic() - self.began,
        )

    def _store(self) -> None:
        """Bring the outcome up to date and put it into the cache file."""
        out = self.outcome
        out.hall = self.ranked or list(self.hall)
        out.evaluations, out.hits = self.ensemble.evaluations, self.ensemble.hits
        out.elapsed_s = time.monotonic() - self.began
        store(self.cache, out)
