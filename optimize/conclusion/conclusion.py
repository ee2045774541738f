"""The end of a search: the best designs are chosen from all known ones, and evaluated with held-out starts.

The best of many noisy means is partly lucky, so the values by which a design is chosen are biased. The search
therefore has three separate stages. During the search, many designs get few starts each. Then the best of
them by posterior mean get some more starts, and are ranked again. Finally, reported values and intervals are
computed from held-out starts, which were used in neither stage. They also show whether a design satisfies the
constraints of the result.
"""

from __future__ import annotations

from collections.abc import Sequence

from tisim.optimize.conclusion.constrained import constrained
from tisim.optimize.conclusion.front import front_of
from tisim.optimize.conclusion.held_out import HeldOut, Report, noise_of
from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.feasibility import feasible
from tisim.optimize.problem.problem import Problem
from tisim.optimize.settings import Settings, fresh_starts, reserved
from tisim.optimize.surrogate.ranking import best

_PROOF = 2 * 10**6
"""The number of the first start that is used to check whether a design meets a target."""
_STARTS_OF_PROOF = 16
WRONGLY_MET = 0.05
"""Upper limit of the probability that a search stops at a design that does not meet its target, if none
does."""


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
    noise = noise_of(problem, settings, ensemble, known) if options.confirm else None
    held_out = HeldOut(problem, ensemble, noise, report)
    if problem.several:
        if ensemble.repeatable:
            return _exact(problem, best(problem.genome, known, len(known)), ensemble)
        return front_of(held_out, known, fresh)
    count, constraints = settings.hall_of_fame, problem.result_constraints
    if ensemble.repeatable:
        return _exact(problem, _first(met, best(problem.genome, known, count)), ensemble)
    candidates = best(problem.genome, known, count, constraints)
    if 3 * options.select * len(candidates) <= held_out.left:
        _know(problem, candidates, ensemble, options.select)
    chosen = _first(met, best(problem.genome, known, count, constraints))
    if constraints and fresh and chosen:
        ran = [individual for individual in known if not individual.failed]
        return constrained(held_out, ran, chosen, count, fresh)
    if fresh:
        chosen = chosen[: int(max(1, min(count, held_out.left // fresh)))]
    held_out.confirm(chosen, int(min(fresh, held_out.left)))
    return chosen


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
    if ensemble.budget - ensemble.requested < _STARTS_OF_PROOF:
        return False
    chance = WRONGLY_MET / ((tried + 1) * (tried + 2))
    noise = noise_of(problem, settings, ensemble, known)
    (((estimate,), limits),) = ensemble.fresh(
        [problem.genome.decode(leader)], _STARTS_OF_PROOF, _PROOF, noise=noise, confidence=1.0 - 2.0 * chance
    )
    return estimate.high <= goal and feasible(problem.result_constraints, limits) is True


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
    return (
        chosen
        if met is None or met.failed
        else [met, *(one for one in chosen if one is not met)][: len(chosen)]
    )
