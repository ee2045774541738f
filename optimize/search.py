"""A search runs generations of a method until a stopping rule ends it, and stores everything in its cache
file.

A search is a function of its problem, settings and evaluator settings. It is resumed by running it again with
the same cache file: finished evaluations are read from the file, and the search continues as if it had never
stopped.
"""

from __future__ import annotations

import copy
import math
import re
import time
from collections.abc import Callable
from dataclasses import replace

from tisim.errors import RunError
from tisim.optimize.beginning import NOTHING, Beginning
from tisim.optimize.conclusion.conclusion import concluded, proven, reserve
from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.evaluation.runs import Evaluator
from tisim.optimize.generation_log import OwnStatistics, statistics
from tisim.optimize.hall_of_fame import hall_of_fame
from tisim.optimize.methods.base import find
from tisim.optimize.methods.individual import Individual
from tisim.optimize.outcome import Outcome, Progress, Stopped
from tisim.optimize.problem.feasibility import penalised, violated
from tisim.optimize.problem.problem import Problem
from tisim.optimize.search_records import searches, store
from tisim.optimize.settings import Settings, fit, identity
from tisim.optimize.storage.cache import Cache

MOST_ALIKE = 60
"""A search ends if its first designs, this number or more, have all failed for the same reason."""
MOST_REFUSED = 200
"""It ends if this number or more have all been refused, for whatever reasons."""


class _OutOfTime(Exception):
    """The wall-clock budget ran out during a generation."""


def search(
    problem: Problem,
    evaluator: Evaluator,
    cache: Cache,
    settings: Settings | None = None,
    beginning: Beginning = NOTHING,
    *,
    on_generation: Callable[[Progress], None] | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Outcome:
    """Search for the problem's best design, or its front, over its genome.

    beginning : designs that are run first, and known values of others.
    on_generation : called after each generation.
    on_progress : called as evaluations finish.

    After each generation settings, versions, logbook and hall of fame are written to the cache file, below
    Outcome.name. KeyboardInterrupt ends the search cleanly and is reported in Outcome.stopped.
    Raises InputError if the method does not support the problem, RunError if the disk is full.
    """
    settings = settings or Settings()
    return _Search(problem, evaluator, cache, settings, beginning, on_generation, on_progress).run()


class _Search:
    """A running search: its method, hall of fame, budget and outcome so far."""

    def __init__(
        self,
        problem: Problem,
        evaluator: Evaluator,
        cache: Cache,
        settings: Settings,
        beginning: Beginning,
        on_generation: Callable[[Progress], None] | None,
        on_progress: Callable[[Progress], None] | None,
    ) -> None:
        fit(problem, settings, beginning)
        self.problem, self.cache, self.settings = problem, cache, settings
        self.on_generation, self.on_progress = on_generation, on_progress
        self.ensemble = Ensemble(problem, evaluator, cache, settings.ensemble, settings.seed)
        self.method = find(settings.method)(
            problem.genome, len(problem.objectives), settings.options, settings.seed
        )
        self.hall = hall_of_fame(problem, settings.hall_of_fame)
        self.statistics = OwnStatistics(problem, settings.statistics)
        self.known: dict[tuple[float, ...], Individual] = {}
        self.ranked: list[Individual] | None = None
        self.tried: set[tuple[float, ...]] = set()  # designs that were checked and did not meet the target
        self.stagnation = 0
        self.learned = copy.deepcopy(beginning.learned)  # individuals with known values that were not run
        identified = identity(problem, settings, evaluator.settings, beginning)
        self.outcome = Outcome(problem, settings, identified, beginning)
        self.began = time.monotonic()

    def run(self) -> Outcome:
        if self.outcome.name not in searches(self.cache):
            self._store()  # from now on the file contains this search
        try:
            self._generations()
            self._conclude()
        except KeyboardInterrupt:
            self.outcome.stopped = "interrupted"
        except _OutOfTime:
            self.outcome.stopped = "wall clock"
        decode = self.problem.genome.decode
        self.outcome.quantities = {one: self.ensemble.values(decode(one)) for one in self.outcome.estimates}
        self._store()
        return self.outcome

    def _conclude(self) -> None:
        """Choose the best of all known designs, and evaluate them with held-out starts."""
        if not self.hall.individuals or self._out_of_time():
            return
        self.ensemble.budget = self._budget
        last = len(self.outcome.logbook) - 1
        met = self.known[tuple(self.hall.individuals[0])] if self.outcome.stopped == "target" else None
        self.ranked = concluded(
            self.problem, self.settings, self.ensemble, list(self.known.values()),
            lambda fraction: self._report(last, 1.0), met,
        )  # fmt: skip
        for individual in self.known.values():  # further starts have changed some, or made them fail
            known = self.outcome.failures if individual.failed else self.outcome.estimates
            known[tuple(individual)] = individual.estimates
            if individual.failed:
                self.outcome.estimates.pop(tuple(individual), None)

    @property
    def _budget(self) -> float:
        most = self.settings.max_evaluations
        return math.inf if most is None else most

    def _generations(self) -> None:
        for generation in range(self.settings.generations + 1):
            width = self.method.width
            self.ensemble.budget = self._budget - reserve(self.problem, self.settings, self.ensemble)
            requested_before = self.ensemble.requested
            first = [] if generation else self._begin()
            asked = self.method.ask()
            fresh = len(first) + self._estimate(asked, generation)
            asked = [individual for individual in asked if individual.fitness.valid]
            kept = set(map(id, asked))
            population = [*asked, *(individual for individual in first if id(individual) not in kept)]
            better = self.hall.update(population)
            self._race(population, generation)
            if not self.ensemble.exhausted:  # else this last generation is incomplete
                self.method.tell(asked, self.hall.individuals)
            self.stagnation = 0 if better else self.stagnation + 1
            self.outcome.logbook.record(
                gen=generation,
                designs=fresh,
                starts=self.ensemble.requested - requested_before,
                failed=sum(individual.failed for individual in population),
                box=width,
                recentred=self.method.moved and not self.ensemble.exhausted,
                **statistics(self.problem, population, self.hall.individuals),
            )
            self.statistics.add(self.outcome.logbook, population)
            self._store()
            reasons = [individual.estimates[0].reason for individual in population if individual.estimates]
            failed = not self.hall.individuals and reasons
            if self.on_generation is not None:
                progress = self._progress(generation, 1.0)
                self.on_generation(replace(progress, failure=reasons[0]) if failed else progress)
            self.outcome.stopped = self._stop(generation)
            if failed:
                self._give_up()
            if self.outcome.stopped:
                return

    def _give_up(self) -> None:
        """Raise RunError if no design has succeeded and enough have failed to expect the same of the others.
        Refusals count in the same way whether a scene, a function or a constraint makes them."""
        reasons = [
            re.sub(r"^start \d+ \(seed \d+\): ", "", estimates[0].reason)
            for estimates in self.outcome.failures.values()
        ]
        kinds = {re.sub(r"[-+]?\d+(\.\d*)?(e[-+]?\d+)?", "N", reason) for reason in reasons}
        refused = all(kind.startswith("infeasible: ") for kind in kinds)
        most = MOST_ALIKE if len(kinds) == 1 else MOST_REFUSED if refused else math.inf
        ended = refused and self.outcome.stopped not in ("", "wall clock")
        if len(reasons) >= most or ended:
            raise RunError(
                f"search must find a design that succeeds; received {len(reasons)} that failed, the first as "
                f"{reasons[0]}. Change the ranges of the genes, or start from a design that succeeds "
                "(--start-from FILE, starting_designs=)"
            )

    def _begin(self) -> list[Individual]:
        """Run the starting designs as far as the budget allows, and tell the method their values and the
        known ones. If a design has both, the one with more starts is used."""
        first = self.outcome.beginning.first(self.problem)
        if first:
            self._estimate(first, 0, part=0.0)
        first = [individual for individual in first if individual.fitness.valid]
        individuals = {tuple(individual): individual for individual in first}
        for individual in self.learned:
            ran = individuals.setdefault(tuple(individual), individual)
            if individual.estimates[0].starts > ran.estimates[0].starts:
                individuals[tuple(individual)] = individual
        if individuals:
            self.method.learn(list(individuals.values()) if self.method.takes_experiments else first)
        return first

    def _estimate(self, population: list[Individual], generation: int, part: float = 1.0) -> int:
        """Estimate the individuals of unknown fitness as far as the budget allows; return their number.

        part : the fraction of the generation that they are, for the progress report.
        """
        fresh = [individual for individual in population if not individual.fitness.valid]
        designs = [self.problem.genome.decode(individual) for individual in fresh]
        new_estimates = self.ensemble.estimate(
            designs, lambda fraction: self._report(generation, part * fraction)
        )
        for individual, estimates in zip(fresh, new_estimates, strict=True):
            if estimates is not None:
                individual.know(estimates)
                known = self.outcome.failures if individual.failed else self.outcome.estimates
                known[tuple(individual)] = estimates
                self.known.setdefault(tuple(individual), individual)
                self.outcome.generations.setdefault(tuple(individual), generation)
        self._constrain(fresh)
        return sum(individual.fitness.valid for individual in fresh)

    def _constrain(self, fresh: list[Individual]) -> None:
        """Rank designs that violate a constraint of the result after all feasible ones, by the size of the
        violation."""
        constraints = self.problem.result_constraints
        ran = [individual for individual in self.known.values() if not individual.failed]
        known = [*(individual for individual in self.learned if not individual.failed), *ran]
        if not constraints or not known:
            return
        for individual in (*ran, *(one for one in fresh if one.fitness.valid and not one.failed)):
            individual.limit(constraints, self.ensemble.limits(self.problem.genome.decode(individual)))
        costs = [[estimate.mean for estimate in individual.estimates] for individual in known]
        ordered = penalised(costs, [individual.violation for individual in known])
        by_point = dict(zip(map(tuple, known), ordered.tolist(), strict=True))
        for individual in (*known, *(one for one in fresh if tuple(one) in by_point)):
            individual.fitness.values = tuple(by_point[tuple(individual)])

    def _race(self, population: list[Individual], generation: int) -> None:
        """Spend more starts on the designs of the hall of fame, and rank it by the new estimates."""
        if not self.settings.ensemble.race:
            return
        racing = self.hall.individuals
        designs = [self.problem.genome.decode(individual) for individual in racing]
        raced = self.ensemble.race(designs, lambda fraction: self._report(generation, 1.0))
        by_point = {tuple(individual): estimates for individual, estimates in zip(racing, raced, strict=True)}
        self.outcome.estimates |= by_point
        known = [self.known[point] for point in by_point if point in self.known]
        for individual in (*racing, *population, *known):
            if tuple(individual) in by_point:
                individual.know(by_point[tuple(individual)])
        self._constrain([*racing, *population])
        self.hall.update(population)

    def _report(self, generation: int, fraction: float) -> None:
        if self.on_progress is not None:
            self.on_progress(self._progress(generation, fraction))
        if self._out_of_time():
            raise _OutOfTime

    def _stop(self, generation: int) -> Stopped:
        settings = self.settings
        if settings.target is not None and self.hall.individuals:
            (goal,) = self.problem.costs([settings.target])
            leader = self.hall.individuals[0]
            met = not leader.violation and leader.fitness.values[0] <= goal
            if met and tuple(leader) not in self.tried:
                self.ensemble.budget = self._budget
                known = list(self.known.values())
                met = proven(self.problem, settings, self.ensemble, known, leader, goal, len(self.tried))
                self.tried.add(tuple(leader))
                if met:
                    return "target"
        if settings.patience is not None and self.stagnation >= settings.patience:
            return "patience"
        if self.ensemble.exhausted or self.ensemble.requested >= self.ensemble.budget:
            return "evaluations"
        if generation == settings.generations:
            return "generations"
        return "wall clock" if self._out_of_time() else ""

    def _out_of_time(self) -> bool:
        budget = self.settings.wall_clock_s
        return budget is not None and time.monotonic() - self.began >= budget

    def _progress(self, generation: int, fraction: float) -> Progress:
        hall = self.hall.individuals
        of_hall = [tuple(individual.fitness.values) for individual in hall]
        words = violated(self.problem.result_constraints, hall[0].limits) if hall else ""
        if words:  # the fitness is the violation
            of_hall = [tuple(estimate.mean for estimate in hall[0].estimates)]
        costs = [min(column) for column in zip(*of_hall, strict=True)]
        return Progress(
            generation=generation,
            generations=self.settings.generations,
            fraction=fraction,
            best=self.problem.costs(costs) if hall else (),
            designs=len(hall),
            best_design=None if self.problem.several or not hall else self.problem.genome.decode(hall[0]),
            evaluations=self.ensemble.runs.evaluations,
            hits=self.ensemble.runs.hits,
            elapsed_s=time.monotonic() - self.began,
            violated=words,
        )

    def _store(self) -> None:
        """Update the outcome and write it to the cache file."""
        out = self.outcome
        out.hall.fill(self.hall.individuals if self.ranked is None else self.ranked)
        out.evaluations, out.hits = self.ensemble.runs.evaluations, self.ensemble.runs.hits
        out.elapsed_s = time.monotonic() - self.began
        out.limits = {one: individual.limits for one, individual in self.known.items()}
        out.held_out = {
            point: (individual.confirmed, individual.confirmed_limits)
            for point, individual in self.known.items()
            if individual.confirmed
        }
        store(self.cache, out)
