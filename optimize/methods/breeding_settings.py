"""The composition of a generation in Z04's genetic algorithm."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from tisim.components.component import Checked
from tisim.errors import must

POPULATION, PARENTS = 20, 6
"""Individuals in a generation, and the number of parents among them (Z04 section 8)."""
_WHOLE = TypeAdapter(int)


class Breeding(Checked):
    """Composition of a generation. Defaults are Z04 section 8, except for recentre_factor.

    Z04 restricts and rescales the search box around the best design, but does not say by how much; its factor
    of 0.5 is chosen here.

    If only some of population, parents and offspring are given, the others follow in the proportions of Z04
    (20, 6 and 6).

    population : individuals in a generation (S).
    parents : number of best ones, kept unchanged and never evaluated again (K).
    offspring : number of bred individuals (None: equal to parents, or the largest even number that fits). The
        rest are random individuals drawn from the search box.
    recentre_every : generations between re-centrings of the box on the best (0: never).
    recentre_factor : factor by which the box shrinks each time.
    """

    population: int = Field(POPULATION, ge=2)
    parents: int = Field(PARENTS, ge=1)
    offspring: int | None = Field(None, ge=0)
    recentre_every: int = Field(4, ge=0)
    recentre_factor: float = Field(0.5, gt=0, le=1)

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
        """Return the settings with the numbers that are not given derived from those that are."""
        population, parents, offspring = (
            _whole(data.get(name)) for name in ("population", "parents", "offspring")
        )
        follow: dict[str, int] = {}
        if "parents" not in data:
            # each parent has at most one offspring
            fitting = max(proportional(population or POPULATION), offspring or 0)
            most = fitting if population is None else population - (offspring or 0)
            follow["parents"] = max(1, min(fitting, most))
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
        rule = f"<= parents = {self.parents} (two for each pair)"
        must(self.bred <= self.parents, "offspring", rule, self.bred)
        return self


def _whole(value: Any) -> int | None:
    """Return the integer that a field accepts for a value such as 8.0 or "8"; None if it would refuse the
    value."""
    try:
        return _WHOLE.validate_python(value)
    except ValidationError:
        return None


def proportional(population: int) -> int:
    """Return the number of parents for a population: the even number nearest to Z04's fraction of it, 6 of
    20, or one if that is zero."""
    return 2 * round(population * PARENTS / POPULATION / 2) or 1
