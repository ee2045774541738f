"""The end of a search: the best designs are chosen from all known ones, and evaluated with held-out starts.

The best of many noisy means is partly lucky, so the values by which a design is chosen are biased. The search
therefore has three separate stages. During the search, many designs get few starts each. Then the best of
them by posterior mean get some more starts, and are ranked again. Finally, reported values and intervals are
computed from held-out starts, which were used in neither stage. They also show whether a design satisfies the
constraints of the result.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from tisim.numerics.skewed import Moments
from tisim.numerics.statistics import CONFIDENCE
from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.hall_of_fame import not_dominated
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.feasibility import excess, feasible
from tisim.optimize.problem.problem import Problem
from tisim.optimize.settings import Settings, fresh_starts, reserved
from tisim.optimize.surrogate.noise import moments
from tisim.optimize.surrogate.ranking import best

FEWEST_FRESH = 4
"""Held-out starts of each design of a front, if the budget does not allow more."""
_PROOF = 2 * 10**6
"""The number of the first start that is used to check whether a design meets a target."""
_STARTS_OF_PROOF = 16
WRONGLY_MET = 0.05
"""Upper limit of the probability that a search stops at a design that does not meet its target, if none
does."""
Report = Callable[[float], None]
Noise = Sequence[Moments] | None


def reserve(problem: Problem, settings: Settings, ensemble: Ensemble) -> int:
    """Return the number of runs that are reserved for the end of a search.

    It is an eighth of the budget for one objective, or less if the reported designs need less; a quarter with
    constraints of the result, where the first design may fail; a quarter for a front; 0 if all starts of a
    design are the same.
    """
    most = settings.max_evaluations
    return 0 if most is None or ensemble.repeatable else reserved(problem, settings, most)


def concluded(
    problem: Problem, settings: Settings, ensemble: Ensemble, known: Sequence[Individual], report: Report,
    met: Individual | None = None,
) -> list[Individual]:  # fmt: skip
    """Return the designs that a search reports, best first, after their held-out starts.

    known : all designs that have run; the ones that did not fail are candidates.
    met : the design that has met the target, which is reported first.

    The budget of the ensemble is not exceeded.
    """
    options = settings.ensemble
    fresh = fresh_starts(problem, settings)
    if options.select or options.confirm:
        ensemble.look()
    noise = _noise(problem, settings, ensemble, known) if options.confirm else None
    if problem.several:
        return _front(problem, ensemble, known, fresh, report, noise)
    count, constraints = settings.hall_of_fame, problem.result_constraints
    if ensemble.repeatable:
        return _exact(problem, _first(met, best(problem.genome, known, count)), ensemble)
    candidates = best(problem.genome, known, count, constraints)
    if 3 * options.select * len(candidates) <= _left(ensemble):
        _know(problem, candidates, ensemble, options.select)
    if fresh:
        count = int(max(1, min(count, _left(ensemble) // fresh)))
    chosen = _first(met, best(problem.genome, known, count, constraints))
    starts = int(min(fresh, _left(ensemble)))
    _confirm(problem, chosen, ensemble, starts, report, noise)
    if not constraints or not chosen or not chosen[0].confirmed:
        return chosen
    groups = [(chosen, starts)]
    others = [one for one in best(problem.genome, known, 2 * settings.hall_of_fame, constraints, allowed=True)
              if all(one is not other for other in chosen)]  # fmt: skip
    while others and all(_excess(problem, one) for group, _ in groups for one in group):
        starts = int(min(fresh, _left(ensemble)))
        following = others.pop(0)
        if starts >= FEWEST_FRESH:
            _confirm(problem, [following], ensemble, starts, report, noise)
        if not following.confirmed:
            break
        groups.append(([following], starts))
    return _feasible_first(problem, settings, ensemble, groups, report, noise)


def _feasible_first(
    problem: Problem,
    settings: Settings,
    ensemble: Ensemble,
    groups: Sequence[tuple[Sequence[Individual], int]],
    report: Report,
    noise: Noise,
) -> list[Individual]:
    """Return designs in their order, but with those in front that satisfy the constraints by their held-out
    starts; the others follow, ordered by the size of the violation.

    groups : designs that were confirmed together, and their number of held-out starts.

    The designs in front are selected by these starts, so the intervals are corrected like intervals of a
    front.
    """
    tried = [one for group, _ in groups for one in group]
    good = sum(not _excess(problem, one) for one in tried)
    if 0 < good < len(tried):
        confidence = 1.0 - (1.0 - CONFIDENCE) * good / len(tried)
        for group, starts in groups:
            _confirm(problem, group, ensemble, starts, report, noise, confidence)
    return sorted(tried, key=lambda one: _excess(problem, one))[: settings.hall_of_fame]


def _excess(problem: Problem, individual: Individual) -> float:
    """Return the total violation of a design, by its held-out starts if it has any."""
    return excess(problem.result_constraints, individual.reported_limits)


def _front(
    problem: Problem,
    ensemble: Ensemble,
    known: Sequence[Individual],
    confirm: int,
    report: Report,
    noise: Noise,
) -> list[Individual]:
    """Return the front, in which no design is dominated according to the means of held-out starts. If none
    of its designs satisfies the constraints of the result, it is the one with the least violation.

    confirm : held-out starts of each design.

    The remaining designs are selected by the same means, and so are biased again. If r of m intervals remain,
    they get the confidence 1 - 0.05 r / m, so that 95 % of them contain the true value.

    Source: Y. Benjamini and D. Yekutieli, J. Am. Stat. Assoc. 100 (2005) 71-81.
    """
    constraints = problem.result_constraints
    if ensemble.repeatable:
        return _exact(problem, best(problem.genome, known, len(known)), ensemble)
    front = best(problem.genome, known, len(known), constraints)
    if not confirm or not front:
        return front
    left = _left(ensemble)
    if not math.isinf(left):
        fewest = max(FEWEST_FRESH, *(one.statistic.fewest_starts for one in problem.objectives))
        confirm = max(min(confirm, int(left) // len(front)), min(confirm, fewest))
        front = best(problem.genome, known, max(1, int(left) // confirm), constraints)
    _confirm(problem, front, ensemble, confirm, report, noise)
    if not front[0].confirmed:
        return front
    good = [one for one in front if not _excess(problem, one)]
    left_over = not_dominated(good or [min(front, key=lambda one: _excess(problem, one))])
    confidence = 1.0 - (1.0 - CONFIDENCE) * len(left_over) / len(front)
    _confirm(problem, front, ensemble, confirm, report, noise, confidence)
    return left_over


def proven(
    problem: Problem,
    settings: Settings,
    ensemble: Ensemble,
    known: Sequence[Individual],
    leader: Individual,
    goal: float,
    tried: int,
) -> bool:
    """Return whether a design meets a goal, a cost, with confidence: its upper interval end is at most the
    goal, and its intervals of the constraints of the result lie within their bounds.

    The interval is computed from starts that only this check uses.

    known : all designs that have run.
    tried : number of designs that failed this check before. With many checks, some would succeed by chance;
        the k-th has an error probability of 0.05 / (k (k + 1)), which gives at most 0.05 in total.
    """
    ensemble.look()
    if ensemble.repeatable:
        return leader.fitness.values[0] <= goal
    if _left(ensemble) < _STARTS_OF_PROOF:
        return False
    chance = WRONGLY_MET / ((tried + 1) * (tried + 2))
    noise = _noise(problem, settings, ensemble, known)
    (((estimate,), limits),) = ensemble.fresh(
        [problem.genome.decode(leader)], _STARTS_OF_PROOF, _PROOF, noise=noise, confidence=1.0 - 2.0 * chance
    )
    return estimate.high <= goal and feasible(problem.result_constraints, limits) is True


def _confirm(
    problem: Problem,
    chosen: Sequence[Individual],
    ensemble: Ensemble,
    starts: int,
    report: Report,
    noise: Noise,
    confidence: float = CONFIDENCE,
) -> None:
    """Run the held-out starts of designs, if they are enough for the statistics and the budget allows them,
    or they are cached."""
    again = bool(chosen) and bool(chosen[0].confirmed)
    too_few = starts < max(one.statistic.fewest_starts for one in problem.objectives)
    if not starts or too_few or (starts * len(chosen) > _left(ensemble) and not again):
        return
    designs = [problem.genome.decode(individual) for individual in chosen]
    fresh = ensemble.fresh(designs, starts, progress=report, noise=noise, confidence=confidence)
    for individual, (estimates, limits) in zip(chosen, fresh, strict=True):
        individual.confirmed, individual.confirmed_limits = estimates, limits


def _noise(problem: Problem, settings: Settings, ensemble: Ensemble, known: Sequence[Individual]) -> Noise:
    """Return the moments of the noise of each cost, if they can be estimated.

    They cannot with common starts, because then the noise is the same for all designs.
    """
    if ensemble.repeatable or settings.ensemble.common_starts:
        return None
    return moments(problem.genome, known)


def _know(problem: Problem, candidates: Sequence[Individual], ensemble: Ensemble, starts: int) -> None:
    designs = [problem.genome.decode(individual) for individual in candidates]
    for individual, estimates in zip(candidates, ensemble.more(designs, starts), strict=True):
        individual.know(estimates)
        individual.limit(problem.result_constraints, ensemble.limits(problem.genome.decode(individual)))


def _exact(problem: Problem, chosen: list[Individual], ensemble: Ensemble) -> list[Individual]:
    """Mark designs as exact if several of their starts were run before all starts proved to be the same."""
    _know(problem, [one for one in chosen if not all(e.exact for e in one.estimates)], ensemble, 0)
    return chosen


def _first(met: Individual | None, chosen: list[Individual]) -> list[Individual]:
    """Return these designs with the one that met the target in front, and the same number in total."""
    return chosen if met is None else [met, *(one for one in chosen if one is not met)][: len(chosen)]


def _left(ensemble: Ensemble) -> float:
    return ensemble.budget - ensemble.requested
