"""Settings determine a search. Settings and problem together form its identity, which names it in the cache
file."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Mapping
from typing import Any

from pydantic import Field, SerializeAsAny, model_validator

from tisim.components.component import Checked
from tisim.errors import must
from tisim.optimize.beginning import Beginning
from tisim.optimize.evaluation.ensemble_settings import LOOKED_AT, EnsembleSettings, fewest_starts
from tisim.optimize.generation_log import OwnStatistics
from tisim.optimize.methods.base import SearchMethod, code_of, every, find
from tisim.optimize.problem.problem import Problem
from tisim.optimize.storage.record import canonical

METHOD = "genetic"
"""The default search method."""
IDENTITY_FORMAT = 5
"""The version of the identity below; raised when older searches can no longer be resumed."""


class Settings(Checked):
    """The settings of a search and its stopping rules.

    seed : seed of the search and of its random starts.
    method : name of the method, see optimize.methods.base; options : its own settings.
    generations : number of generations after generation 0, the random initial population.
    ensemble : averaging over starts.
    hall_of_fame : number of best designs kept; a front is always kept whole.
    statistics : further columns of the logbook, a deap.tools.Statistics or MultiStatistics; see
        optimize.generation_log. They do not change the course of a search, and are not stored with its
        settings.

    Stopping rules are checked after each generation; None disables a rule.
    target : stop when the best fitness is at least as good.
    patience : stop after this number of generations without improvement.
    wall_clock_s : stop after this time in seconds. It is checked after every evaluation, too; the unfinished
        generation is then discarded, but its evaluations stay cached.
    max_evaluations : limit on the number of different runs requested, cached ones included, so that a resumed
        search stops at the same point. It is never exceeded: the last generation is cut short.
    """

    seed: int = Field(0, ge=0)
    method: str = METHOD
    options: SerializeAsAny[Checked] = Checked()
    generations: int = Field(25, ge=0)
    ensemble: EnsembleSettings = EnsembleSettings()
    hall_of_fame: int = Field(6, ge=1)
    statistics: Any = Field(None, exclude=True, repr=False)
    target: float | None = None
    patience: int | None = Field(None, ge=1)
    max_evaluations: int | None = Field(None, ge=1)
    wall_clock_s: float | None = Field(None, gt=0)

    @classmethod
    def kind(cls) -> str:
        """Return the prefix of these settings in commands, as in ``--set search.generations=30``."""
        return "search"

    @model_validator(mode="before")
    @classmethod
    def _options_of_the_method(cls, data: dict[str, Any]) -> dict[str, Any]:
        method = find(data.get("method", METHOD))
        kind = method.Options
        options = data.get("options", {})
        if not isinstance(options, kind):
            named = isinstance(options, Mapping) and all(isinstance(name, str) for name in options)
            must(named, "search.options", "settings of the method, by name", options)
            options = kind(**options)
        return {**data, "options": options, "ensemble": _ensemble(method, options, data.get("ensemble", {}))}


def _ensemble(method: type[SearchMethod], options: Any, given: Any) -> Any:
    """Return the ensemble settings: the given ones, and the method's defaults for the others."""
    common = not method.starts_of_its_own(options)
    if isinstance(given, EnsembleSettings):
        return (
            given if given.common_starts is not None else given.model_copy(update={"common_starts": common})
        )
    if not isinstance(given, Mapping):
        return given  # refused later by the validation of the field
    return {"common_starts": common, **method.ensemble, **given}


_STOPPING = {"generations", "hall_of_fame", "target", "patience", "max_evaluations", "wall_clock_s"}
_AFTERWARDS = {"select", "confirm"}
_OF_THE_PROBLEM = (
    "format", "problem", "problem_version", "problem_code", "units", "objectives", "objective_order",
    "evaluator",
)  # fmt: skip
"""The parts of the identity that two searches must share to share their runs."""


def identity(
    problem: Problem, settings: Settings, evaluator: Mapping[str, Any], beginning: Beginning | None = None
) -> dict[str, Any]:
    """Return everything that determines the course of a search.

    Stopping rules and the repeated runs at its end are not included. evaluator : the settings of the
        evaluator. beginning : starting designs and experiments; none by default.
    """
    left_out = dict.fromkeys(_STOPPING, True) | {"ensemble": _AFTERWARDS}
    method_code = code_of(settings.method)
    return {
        "format": IDENTITY_FORMAT,
        "problem": problem.name,
        "problem_version": problem.version,
        "problem_code": problem.identity,
        "genes": {gene.name: gene.described for gene in problem.genome.genes},
        "gene_order": list(problem.genome.names),
        "units": {gene.name: gene.unit for gene in problem.genome.genes},
        **(
            {"constraints": {one.name: one.described for one in problem.constraints}}
            if problem.constraints
            else {}
        ),
        "objectives": {
            one.name: ", ".join(
                filter(None, ("largest" if one.maximise else "least", one.unit, one.statistic.described))
            )
            for one in problem.objectives
        },
        "objective_order": [one.name for one in problem.objectives],
        "search": settings.model_dump(mode="json", exclude=left_out),
        **({"method_code": method_code} if method_code else {}),
        **({} if beginning is None else beginning.identity(problem)),
        "evaluator": dict(evaluator),
    }


def of_the_problem(identity: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an identity that determines the run of a design and the meaning of its values.

    Searches in which it is equal share their runs. Ranges of genes, bounds of constraints, method, seed and
    all other settings may differ.
    """
    return {name: identity[name] for name in _OF_THE_PROBLEM}


def search_name(identity: Mapping[str, Any]) -> str:
    """Return the name of a search's group in its cache file: problem, method, seed, and a checksum of the
    identity."""
    named = identity["problem"], identity["search"]["method"], str(identity["search"]["seed"])
    return f"searches/{'-'.join(named)}-{hashlib.sha256(canonical(identity)).hexdigest()[:12]}"


def without_dependent_options(usual: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a case without the options whose defaults depend on a changed option.

    Example: a case sets 24 individuals and 8 parents; if 12 individuals are requested, the number of parents
    is dropped and takes its default for 12.
    usual : settings of the case. changes : settings that replace them, by dotted name.
    """
    method = find(changes.get("method", usual.get("method", METHOD)))
    dropped = {
        name
        for option, names in method.dependent_options.items()
        if f"options.{option}" in changes
        for name in names
    }
    options = {name: value for name, value in usual.get("options", {}).items() if name not in dropped}
    return {**usual, "options": options}


def least_evaluations(problem: Problem, settings: Settings) -> int:
    """Return the smallest budget from which a search can run a design from all its random starts."""
    if problem.deterministic:
        return 1
    starts = fewest_starts(problem, settings.ensemble)
    # Other designs may have run from two starts by then, to check whether the starts matter.
    needed = starts if starts <= 2 else starts + 2 * (LOOKED_AT - 1)
    budgets = itertools.count(needed)
    return next(most for most in budgets if most - reserved(problem, settings, most) >= needed)


def reserved(problem: Problem, settings: Settings, most: int) -> int:
    """Return the number of runs of a budget that are reserved for the end of a search; see
    conclusion.reserve."""
    options = settings.ensemble
    if not (options.select or options.confirm):
        return 0
    if problem.several:
        return most // 4
    part = most // 4 if problem.result_constraints else most // 8
    return min(part, settings.hall_of_fame * (options.select + fresh_starts(problem, settings)))


def fresh_starts(problem: Problem, settings: Settings) -> int:
    """Return the number of held-out starts of each reported design."""
    starts = settings.ensemble.confirm
    return max(starts, *(one.statistic.fewest_fresh for one in problem.objectives)) if starts else 0


def fit(problem: Problem, settings: Settings, beginning: Beginning | None = None) -> None:
    """Raise InputError if the method, a stopping rule, the statistics or the number of starts does not suit
    the objectives or the beginning of the search."""
    OwnStatistics(problem, settings.statistics)
    for objective in problem.objectives:
        fewest = objective.statistic.fewest_starts
        must(
            problem.deterministic or settings.ensemble.max_starts >= fewest,
            "search.ensemble.max_starts",
            f"{fewest} or more for the {objective.statistic.label or 'statistic'} of {objective.name}",
            settings.ensemble.max_starts,
        )
    if problem.several:
        able = [name for name, method in every().items() if method.several]
        must(settings.method in able, "method", f"for several objectives: {', '.join(able)}", settings.method)
        must(settings.target is None, "target", "left out for several objectives", settings.target)
    if beginning is not None and beginning.experiments:
        able = [name for name, method in every().items() if method.takes_experiments]
        must(settings.method in able, "method", f"for experiments: {', '.join(able)}", settings.method)
    if settings.max_evaluations is not None:
        least, starts = least_evaluations(problem, settings), fewest_starts(problem, settings.ensemble)
        rule = f"{least} or more, as each design runs from {starts} random starts"
        must(settings.max_evaluations >= least, "max_evaluations", rule, settings.max_evaluations)
    if beginning is not None and settings.max_evaluations is not None:
        first = len(beginning.designs)
        rule = f"at most max_evaluations = {settings.max_evaluations}, as each of them is run"
        must(first <= settings.max_evaluations, "number of starting designs", rule, first)


def proposed(problem: Problem, base: Mapping[str, Any], method: str | None) -> dict[str, Any]:
    """Return the settings of a case for a method.

    Another method than the case's gets its own default options, unless it accepts all options of the case's
    method (as restart accepts the options of zohdi); it then keeps them.

    base : settings of the case; "methods" may contain settings for other methods, by name.
    method : name of the method; None for the case's own, or for one that supports its objectives.
    """
    of_methods = base.get("methods", {})
    base = {key: value for key, value in base.items() if key != "methods"}
    usual = base.get("method", METHOD)
    if method is None and problem.several and not find(usual).several:
        method = METHOD
    if method in of_methods:
        return {**of_methods[method], "method": method}
    if method is None or issubclass(find(method).Options, find(usual).Options):
        return {**base, "method": method or usual}
    return {**{key: value for key, value in base.items() if key != "options"}, "method": method}
