"""The settings of a search, and the name they give it."""

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


_STOPPING = {"generations", "hall_of_fame", "target", "patience", "max_evaluations", "wall_clock_s"}


def search_name(problem: Problem, settings: Settings, evaluator_settings: Mapping[str, Any]) -> str:
    """Group of a search in its cache file: the same for searches that differ in when they stop only."""
    decisive = settings.model_dump(exclude=_STOPPING)
    digest = hashlib.sha256(canonical([problem.name, problem.version, decisive, dict(evaluator_settings)]))
    return f"searches/{problem.name}-{digest.hexdigest()[:12]}"
