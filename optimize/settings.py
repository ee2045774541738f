"""Settings decide a search; with its problem they give it an identity, and that a name in the cache file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from pydantic import Field, SerializeAsAny, model_validator
from tisim.optimize.beginning import Beginning
from tisim.optimize.evaluation.ensemble import EnsembleSettings
from tisim.optimize.methods.base import SearchMethod, code_of, every, find
from tisim.optimize.problem.problem import Problem
from tisim.optimize.storage.record import canonical

from tisim.components.component import Checked
from tisim.errors import must

METHOD = "genetic"
"""The method of a search for which none is given."""
IDENTITY_FORMAT = 5
"""The version of the identity below; it is raised when a search of before cannot be resumed any more."""


class Settings(Checked):
    """Settings are all that decides a search, and when it stops.

    seed : of the search and of its random starts. method : by name, see optimize.methods.base; options : its
    own settings. generations : after generation 0, the random start. ensemble : averaging over starts.
    hall_of_fame : best designs kept; a front is kept whole.
    Stopping rules, None = off, looked at after each generation: target - best fitness as good as that;
    patience - generations without improvement; wall_clock_s - seconds, looked at after every evaluation too:
    the generation under way is then dropped, its evaluations stay cached.
    max_evaluations : different runs requested, whether run or found in the cache (so that a resumed search
    stops at the same place); never more: the last generation is cut short.
    """

    seed: int = Field(0, ge=0)
    method: str = METHOD
    options: SerializeAsAny[Checked] = Checked()
    generations: int = Field(25, ge=0)
    ensemble: EnsembleSettings = EnsembleSettings()
    hall_of_fame: int = Field(6, ge=1)
    target: float | None = None
    patience: int | None = Field(None, ge=1)
    max_evaluations: int | None = Field(None, ge=1)
    wall_clock_s: float | None = Field(None, gt=0)

    @classmethod
    def kind(cls) -> str:
        """Return the word for it in commands, as in ``--set search.generations=30``."""
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
    """Return the settings of the ensemble: those that are given, else those that suit the method."""
    common = not method.starts_of_its_own(options)
    if isinstance(given, EnsembleSettings):
        return (
            given if given.common_starts is not None else given.model_copy(update={"common_starts": common})
        )
    if not isinstance(given, Mapping):
        return given  # which is refused with its name
    return {"common_starts": common, **method.ensemble, **given}


_STOPPING = {"generations", "hall_of_fame", "target", "patience", "max_evaluations", "wall_clock_s"}
_AFTERWARDS = {"select", "confirm"}
_OF_THE_PROBLEM = (
    "format", "problem", "problem_version", "problem_code", "units", "objectives", "objective_order",
    "evaluator",
)  # fmt: skip
"""What two searches have in common whose runs are of the same kind."""


def identity(
    problem: Problem, settings: Settings, evaluator: Mapping[str, Any], beginning: Beginning | None = None
) -> dict[str, Any]:
    """Return all that decides the course of a search: not when it stops, nor what is run again at its end.

    evaluator : the settings of the evaluator. beginning : what it begins with; nothing unless given.
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
    """Return the part of an identity that decides what a run of a design is, and what its values mean. Where
    it is the same, runs are shared; ranges of genes, bounds of constraints, method, seed and all other
    settings may differ."""
    return {name: identity[name] for name in _OF_THE_PROBLEM if name in identity}


def search_name(identity: Mapping[str, Any]) -> str:
    """Return the name of the group of a search in its cache file: by problem, method, seed, and a checksum of
    all that decides its course."""
    named = identity["problem"], identity["search"]["method"], str(identity["search"]["seed"])
    return f"searches/{'-'.join(named)}-{hashlib.sha256(canonical(identity)).hexdigest()[:12]}"


def without_dependent_options(usual: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a case without those options whose defaults depend on an option that changes.

    Where a case has 24 strings and 8 parents, 12 strings shall have as many parents as go with 12.
    usual : settings of the case. changes : settings in place of them, by dotted name.
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


def fit(problem: Problem, settings: Settings, beginning: Beginning | None = None) -> None:
    """Raise InputError when the method, a stopping rule or the number of starts cannot be for the problem's
    objectives, or not for what the search begins with."""
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
    if beginning is not None and settings.max_evaluations is not None:
        first = len(beginning.designs)
        rule = f"at most max_evaluations = {settings.max_evaluations}, as each of them is run"
        must(first <= settings.max_evaluations, "number of starting designs", rule, first)


def proposed(problem: Problem, base: Mapping[str, Any], method: str | None) -> dict[str, Any]:
    """Return the settings of a case with another method, whose options are then its own defaults; a method
    that takes all options of the case's method, as restart those of zohdi, keeps them.

    base : of the case; under "methods" it may have settings for methods other than its own, by name.
    method : by name; None for the case's, or what its objectives need.
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
