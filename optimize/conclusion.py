"""How a search ends: the best designs are chosen from all it knows, and reported from starts that are new.

The best of many noisy means is good by luck, too, so that what chooses a design flatters it. Three things are
kept apart. The search has few starts of many designs. Those of them that are best by posterior mean are given
some starts more, and ranked again. Values and intervals that are reported are of fresh starts, which have had
no part in either.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.hall_of_fame import not_dominated
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.problem import Problem
from tisim.optimize.settings import Settings
from tisim.optimize.surrogate.noise import moments
from tisim.optimize.surrogate.ranking import best

from tisim.numerics.skewed import Moments
from tisim.numerics.statistics import CONFIDENCE

FEWEST_FRESH = 4
"""Fresh starts of each design of a front, where the budget does not pay for more."""
_PROOF = 2 * 10**6
"""The number of the first start that is used to see whether a design meets a target."""
_STARTS_OF_PROOF = 16
WRONGLY_MET = 0.05
"""The chance that a search stops at a design that does not meet its target, where none does, at most."""
Report = Callable[[float], None]
Noise = Sequence[Moments] | None


def reserve(problem: Problem, settings: Settings, ensemble: Ensemble) -> int:
    """Return the number of runs that are kept back for the end: an eighth of the budget for one objective,
    or what all designs that are reported need, if that is less; a quarter for a front; none where all starts
    of a design are the same."""
    asked, most = settings.ensemble, settings.max_evaluations
    if most is None or ensemble.repeatable or not (asked.select or asked.confirm):
        return 0
    if problem.several:
        return most // 4
    return min(most // 8, settings.hall_of_fame * (asked.select + _fresh(problem, settings)))


def _fresh(problem: Problem, settings: Settings) -> int:
    """Return the number of fresh starts of each design that is reported."""
    asked = settings.ensemble.confirm
    return max(asked, *(one.statistic.fewest_fresh for one in problem.objectives)) if asked else 0


def concluded(
    problem: Problem, settings: Settings, ensemble: Ensemble, known: Sequence[Individual], report: Report,
    met: Individual | None = None,
) -> list[Individual]:  # fmt: skip
    """Return the designs that a search reports, best first, and give these their fresh starts.

    known : all designs that have run; those that have not failed are chosen from. met : the one that has met
    the target, which is reported first. The budget of the ensemble is not exceeded.
    """
    asked = settings.ensemble
    fresh = _fresh(problem, settings)
    if asked.select or asked.confirm:
        ensemble.look()
    noise = _noise(problem, settings, ensemble, known) if asked.confirm else None
    if problem.several:
        return _front(problem, ensemble, known, fresh, report, noise)
    count = settings.hall_of_fame
    if ensemble.repeatable:
        return _exact(problem, _first(met, best(problem.genome, known, count)), ensemble)
    candidates = best(problem.genome, known, count)
    if 3 * asked.select * len(candidates) <= _left(ensemble):
        _know(problem, candidates, ensemble, asked.select)
    if fresh:
        count = int(max(1, min(count, _left(ensemble) // fresh)))
    chosen = _first(met, best(problem.genome, known, count))
    _confirm(problem, chosen, ensemble, int(min(fresh, _left(ensemble))), report, noise)
    return chosen


def _front(
    problem: Problem,
    ensemble: Ensemble,
    known: Sequence[Individual],
    confirm: int,
    report: Report,
    noise: Noise,
) -> list[Individual]:
    """Return the front, of which no design is dominated by the fresh means of another; confirm : fresh starts
    of each.

    Those that are left were lucky more often than not, as the same means decide. Of r left of m intervals
    have the confidence 1 - 0.05 r / m, by which a part of 0.95 of them hold the truth (Y. Benjamini and D.
    Yekutieli, J. Am. Stat. Assoc. 100 (2005) 71-81).
    """
    front = best(problem.genome, known, len(known))
    if ensemble.repeatable:
        return _exact(problem, front, ensemble)
    if not confirm or not front:
        return front
    left = _left(ensemble)
    if not math.isinf(left):
        fewest = max(FEWEST_FRESH, *(one.statistic.fewest_starts for one in problem.objectives))
        confirm = max(min(confirm, int(left) // len(front)), min(confirm, fewest))
        front = best(problem.genome, known, max(1, int(left) // confirm))
    _confirm(problem, front, ensemble, confirm, report, noise)
    if not front[0].confirmed:
        return front
    left_over = not_dominated(front)
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
    """Return whether a design is as good as a goal, a cost, with confidence: whether the upper end of its
    interval over starts of its own is no higher.

    known : all designs that have run. tried : designs that have not met the goal before it. Of many that are
    tried some would meet it by luck; the k-th has a chance of 0.05 / (k (k + 1)) to do so, and all together
    one of 0.05 at most.
    """
    ensemble.look()
    if ensemble.repeatable:
        return leader.fitness.values[0] <= goal
    if _left(ensemble) < _STARTS_OF_PROOF:
        return False
    chance = WRONGLY_MET / ((tried + 1) * (tried + 2))
    noise = _noise(problem, settings, ensemble, known)
    ((estimate,),) = ensemble.fresh(
        [problem.genome.decode(leader)], _STARTS_OF_PROOF, _PROOF, noise=noise, confidence=1.0 - 2.0 * chance
    )
    return estimate.high <= goal


def _confirm(
    problem: Problem,
    chosen: Sequence[Individual],
    ensemble: Ensemble,
    starts: int,
    report: Report,
    noise: Noise,
    confidence: float = CONFIDENCE,
) -> None:
    """Give designs their fresh starts, if these are enough for their statistics, and the budget has them or
    they have been made."""
    again = bool(chosen) and bool(chosen[0].confirmed)
    too_few = starts < max(one.statistic.fewest_starts for one in problem.objectives)
    if not starts or too_few or (starts * len(chosen) > _left(ensemble) and not again):
        return
    designs = [problem.genome.decode(string) for string in chosen]
    fresh = ensemble.fresh(designs, starts, progress=report, noise=noise, confidence=confidence)
    for string, estimates in zip(chosen, fresh, strict=True):
        string.confirmed = estimates


def _noise(problem: Problem, settings: Settings, ensemble: Ensemble, known: Sequence[Individual]) -> Noise:
    """Return what the search tells of the noise of each cost, where it can: not of starts that all designs
    have in common, whose noise is no less alike."""
    if ensemble.repeatable or settings.ensemble.common_starts:
        return None
    return moments(problem.genome, known)


def _know(problem: Problem, candidates: Sequence[Individual], ensemble: Ensemble, starts: int) -> None:
    designs = [problem.genome.decode(string) for string in candidates]
    for string, estimates in zip(candidates, ensemble.more(designs, starts), strict=True):
        string.know(estimates)
        string.limit(problem.result_constraints, ensemble.constraint_means(problem.genome.decode(string)))


def _exact(problem: Problem, chosen: list[Individual], ensemble: Ensemble) -> list[Individual]:
    """Let designs be known for sure that had several starts before these were seen to be all the same."""
    _know(problem, [one for one in chosen if not all(e.exact for e in one.estimates)], ensemble, 0)
    return chosen


def _first(met: Individual | None, chosen: list[Individual]) -> list[Individual]:
    """Return as many designs as these, with the one that has met the target in front."""
    return chosen if met is None else [met, *(one for one in chosen if one is not met)][: len(chosen)]


def _left(ensemble: Ensemble) -> float:
    return ensemble.budget - ensemble.requested
