"""What a generation of strings is made of: the settings of breeding, and operators of deap.tools by name."""

from __future__ import annotations

import inspect
import math
from typing import Any, Literal

from deap import tools
from pydantic import Field, TypeAdapter, ValidationError, model_validator

from tisim.components.component import Checked
from tisim.errors import must

_UNSUITABLE = {
    **dict.fromkeys(("selRoulette", "selStochasticUniversalSampling"), "favours large fitness values"),
    **dict.fromkeys(
        ("selNSGA2", "selNSGA3", "selNSGA3WithMemory", "selSPEA2", "selTournamentDCD"),
        "is for several objectives",
    ),
}


POPULATION, PARENTS = 20, 6
"""Strings per generation, and how many of them are parents (Z04 section 8)."""
_WHOLE = TypeAdapter(int)


class GeneticOperator(Checked):
    """An operator of deap.tools by name, with its keyword arguments (bounds low and up are filled in)."""

    name: str
    options: dict[str, Any] = Field(default_factory=dict)

    def function(self, prefix: str) -> Any:
        """Return the function in deap.tools. InputError unless the name and the arguments fit."""
        function: Any = getattr(tools, self.name, None)
        names = [
            name
            for name in dir(tools)
            if name.startswith(prefix) and callable(getattr(tools, name)) and name not in _UNSUITABLE
        ]
        why = f" ({self.name} {_UNSUITABLE[self.name]})" if self.name in _UNSUITABLE else ""
        must(self.name in names, "operator name", f"one of {', '.join(names)}{why}", self.name)
        signature = inspect.signature(function)
        arity = {"sel": 2, "cx": 2, "mut": 1}[prefix]
        free = list(signature.parameters)[arity:]
        must(set(self.options) <= set(free), f"options of {self.name}", f"among {free}", sorted(self.options))
        required = [
            n
            for n in free
            if signature.parameters[n].default is inspect.Parameter.empty and n not in ("low", "up")
        ]
        must(
            set(required) <= set(self.options),
            f"options of {self.name}",
            f"complete: {required}",
            sorted(self.options),
        )
        return function

    def bound(self, prefix: str) -> tuple[Any, dict[str, Any]]:
        """Return the function and all its keyword arguments, bounds of the unit cube included."""
        function = self.function(prefix)
        names = inspect.signature(function).parameters
        return function, {
            name: value for name, value in (("low", 0.0), ("up", 1.0)) if name in names
        } | self.options


DEAP_OPTIONS = ("select", "mate", "mutate", "crossover_probability", "mutation_probability")
"""The names of the settings of a generation that Z04's breeding does not use."""


class Breeding(Checked):
    """Composition of a generation. Defaults are Z04 section 8; of population, parents and offspring, what is
    not given follows what is, in the proportions that Z04 has (20, 6 and 6).

    population : strings per generation (S). parents : the best, kept unchanged and never evaluated again (K).
    offspring : bred strings (None: as many as parents, or as there is room for, in pairs). The rest are fresh
    random strings of the search box.
    recentre_every : generations between re-centrings of the box on the best (0: never);
    recentre_factor : its shrinking each time.
    breeding : "z04" - the parents, ranked, are mated in neighbouring pairs (1st with 2nd, 3rd with 4th, ...),
    each pair giving two offspring, so K parents give exactly K; or "deap" - select, mate and mutate name
    operators of deap.tools, which work in the coordinates of the search box, and keep to it.
    """

    population: int = Field(POPULATION, ge=2)
    parents: int = Field(PARENTS, ge=1)
    offspring: int | None = Field(None, ge=0)
    recentre_every: int = Field(4, ge=0)
    recentre_factor: float = Field(0.5, gt=0, le=1)
    breeding: Literal["z04", "deap"] = "z04"
    select: GeneticOperator = GeneticOperator(name="selTournament", options={"tournsize": 3})
    mate: GeneticOperator = GeneticOperator(name="cxBlend", options={"alpha": 0.5})
    mutate: GeneticOperator = GeneticOperator(
        name="mutGaussian", options={"mu": 0.0, "sigma": 0.1, "indpb": 0.2}
    )
    crossover_probability: float = Field(0.9, ge=0, le=1)
    mutation_probability: float = Field(0.5, ge=0, le=1)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.options.population=30``."""
        return "search.options"

    @property
    def bred(self) -> int:
        """The number of offspring in a generation."""
        if self.offspring is not None:
            return self.offspring
        return min(self.parents, self.population - self.parents) // 2 * 2

    @model_validator(mode="before")
    @classmethod
    def _following(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Return what the numbers that are given make of those that are not."""
        population, parents, offspring = (
            _whole(data.get(name)) for name in ("population", "parents", "offspring")
        )
        follow: dict[str, int] = {}
        if "parents" not in data:
            fitting = proportional(population or POPULATION)
            if data.get("breeding", "z04") == "z04":  # each parent has one offspring at most
                fitting = max(fitting, offspring or 0)
            room = fitting if population is None else population - (offspring or 0)
            follow["parents"] = max(1, min(fitting, room))
        parent_count = parents or follow.get("parents", PARENTS)
        total = parent_count + (parent_count if offspring is None else offspring)
        if "population" not in data and total > POPULATION:
            follow["population"] = math.ceil(total / (2 * PARENTS) * POPULATION)
        return {**data, **follow}

    @model_validator(mode="after")
    def _consistent(self) -> Breeding:
        must(self.parents < self.population, "parents", f"< population = {self.population}", self.parents)
        total = self.parents + self.bred
        must(total <= self.population, "parents + offspring", f"<= population = {self.population}", total)
        must(self.bred % 2 == 0, "number of offspring", "even (a pair has two)", self.bred)
        if self.breeding == "z04":
            must(
                self.bred <= self.parents,
                "offspring",
                f"<= parents = {self.parents} (two for each pair)",
                self.bred,
            )
            for name in DEAP_OPTIONS:
                value = getattr(self, name)
                unused = value == type(self).model_fields[name].get_default()
                must(unused, f"search.options.{name}", "left out unless breeding is deap", value)
        else:
            for operator, prefix in ((self.select, "sel"), (self.mate, "cx"), (self.mutate, "mut")):
                operator.function(prefix)
        return self


def _whole(value: Any) -> int | None:
    """Return the whole number that a field makes of a value, say of 8.0 or "8"; None where it will refuse
    it."""
    try:
        return _WHOLE.validate_python(value)
    except ValidationError:
        return None


def proportional(population: int) -> int:
    """Return how many parents go with a population: the even number nearest to Z04's part of it, 6 of 20; one
    where that is none."""
    return 2 * round(population * PARENTS / POPULATION / 2) or 1
