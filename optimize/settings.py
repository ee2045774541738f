"""The settings of a search, what they make it, and the name that gives it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from pydantic import Field

from optimize.breeding import Breeding
from optimize.ensemble import EnsembleSettings
from optimize.problem import Problem
from optimize.record import canonical


class Settings(Breeding):
    """All that decides a search, and when it stops. Defaults are Z04 section 8.

    seed : of the search and of its random starts. generations : after generation 0, the random start.
    ensemble : averaging over starts. hall_of_fame : best designs kept.
    Stopping rules, None = off, looked at after each generation: target - best fitness <= target;
    patience - generations without improvement; max_evaluations - single evaluations asked for, whether run
    or found in the cache (so that a resumed search stops at the same place); wall_clock_s - seconds, looked
    at after every evaluation too: the generation under way is then dropped, its evaluations stay cached.
    """

    seed: int = Field(0, ge=0)
    generations: int = Field(25, ge=0)
    ensemble: EnsembleSettings = EnsembleSettings()
    hall_of_fame: int = Field(6, ge=1)
    target: float | None = None
    patience: int | None = Field(None, ge=1)
    max_evaluations: int | None = Field(None, ge=1)
    wall_clock_s: float | None = Field(None, gt=0)

    @classmethod
    def kind(cls) -> str:
        """As in ``--set search.population=30``."""
        return "search"


_STOPPING = {"generations", "hall_of_fame", "target", "patience", "max_evaluations", "wall_clock_s"}
_AFTERWARDS = {"confirm"}


def identity(problem: Problem, settings: Settings, evaluator: Mapping[str, Any]) -> dict[str, Any]:
    """All that decides the course of a search. When it stops, and what is run again at its end, does not.

    evaluator : the settings of the evaluator.
    """
    left_out = dict.fromkeys(_STOPPING, True) | {"ensemble": _AFTERWARDS}
    return {
        "problem": problem.name,
        "problem_version": problem.version,
        "search": settings.model_dump(mode="json", exclude=left_out),
        "evaluator": dict(evaluator),
    }


def search_name(identity: Mapping[str, Any]) -> str:
    """Group of a search in its cache file."""
    return f"searches/{identity['problem']}-{hashlib.sha256(canonical(identity)).hexdigest()[:12]}"
