"""Where a search is, and what it found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from deap import tools

from optimize.breeding import Individual
from optimize.problem import Problem
from optimize.settings import Settings, search_name

Stopped = Literal["", "generations", "target", "patience", "evaluations", "wall clock", "interrupted"]


@dataclass(frozen=True)
class Progress:
    """Where a search is. fraction : of this generation, 0..1. best_design : None until one is known.
    evaluations, hits : run, and found in the cache. elapsed_s : wall seconds since the search began."""

    generation: int
    generations: int
    fraction: float
    best_fitness: float
    best_design: dict[str, float] | None
    evaluations: int
    hits: int
    elapsed_s: float


@dataclass
class Outcome:
    """What a search found.

    hall : the best different designs, best first (by fresh starts once they are confirmed; empty if none
    succeeded); failed designs never enter.
    logbook : one row per finished generation: gen, designs (newly estimated), starts (evaluations asked for),
    failed, best, mean, std (of the successful designs in the population; best is +inf and mean and std NaN
    if there is none), box (mean width of the search box it drew from), recentred (box moved after it).
    evaluations, hits : run, and found in the cache. stopped : the rule that ended it.
    identity : see optimize.settings. name : of its group in the cache file.
    """

    problem: Problem
    settings: Settings
    identity: Mapping[str, Any]
    hall: list[Individual] = field(default_factory=list)
    logbook: tools.Logbook = field(default_factory=tools.Logbook)
    evaluations: int = 0
    hits: int = 0
    elapsed_s: float = 0.0
    stopped: Stopped = ""

    @property
    def name(self) -> str:
        return search_name(self.identity)

    @property
    def best(self) -> Individual | None:
        return self.hall[0] if self.hall else None

    @property
    def interrupted(self) -> bool:
        """Stopped by Ctrl-C; search again with the same settings and file to go on."""
        return self.stopped == "interrupted"
