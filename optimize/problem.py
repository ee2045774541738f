"""An inverse problem: which scene a design makes, and how good its result is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from optimize.genome import Genome
from tisim.errors import must

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tisim.result import Result
    from tisim.scene import Scene


@dataclass(frozen=True)
class Problem:
    """Everything the search needs to know of an inverse problem.

    name : short, part of the cache key; title, description : for people.
    genome : the genes, their units and ranges.
    scene : (design in physical units, start seed) -> Scene. Cheap and declarative; an InputError raised
        here marks the design as infeasible, it does not stop the search.
    objective : Result -> fitness, minimised. Called for runs that ended well only; NaN and inf never win.
    version : raise it when objective changes its meaning: fitnesses of the old one are then not reused.
    symbol : heading of the fitness in tables and plots.
    derived : extra report columns computed from the fitness, heading -> function.
    picture : (Scene, Result) -> figure of a run, for the report.
    details : (design, Result) -> what the best design's run shows beside what was wanted, for the report.
    Raises InputError for an empty name.
    """

    name: str
    genome: Genome
    scene: Callable[[Mapping[str, float], int], Scene]
    objective: Callable[[Result], float]
    title: str = ""
    description: str = ""
    version: int = 1
    symbol: str = "fitness"
    derived: Mapping[str, Callable[[float], float]] = field(default_factory=dict)
    picture: Callable[[Scene, Result], Figure] | None = None
    details: Callable[[Mapping[str, float], Result], Mapping[str, float]] | None = None

    def __post_init__(self) -> None:
        must(
            bool(self.name.strip()) and "/" not in self.name,
            "problem name",
            "a non-empty string without '/'",
            self.name,
        )
