"""How a generation of strings follows from the one before: DEAP toolbox operators, Z04's or DEAP's own."""

from __future__ import annotations

import copy
import inspect
import math
import random
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from deap import base, tools
from pydantic import Field, TypeAdapter, ValidationError, model_validator

from optimize.methods.individual import Individual
from optimize.methods.random_state import OwnRandom
from optimize.problem.genome import SearchBox
from tisim import InputError
from tisim.components.component import Checked
from tisim.errors import must

_UNFIT = {
    **dict.fromkeys(("selRoulette", "selStochasticUniversalSampling"), "favours large fitness values"),
    **dict.fromkeys(
        ("selNSGA2", "selNSGA3", "selNSGA3WithMemory", "selSPEA2", "selTournamentDCD"),
        "is for several objectives",
    ),
}


POPULATION, PARENTS = 20, 6
"""Of Z04 section 8."""
_WHOLE = TypeAdapter(int)


class GeneticOperator(Checked):
    """An operator of deap.tools by name, with its keyword arguments (bounds low and up are filled in)."""

    name: str
    options: dict[str, Any] = Field(default_factory=dict)

    def function(self, prefix: str) -> Any:
        """The function in deap.tools. InputError unless the name and the arguments fit."""
        function: Any = getattr(tools, self.name, None)
        known = [
            name
            for name in dir(tools)
            if name.startswith(prefix) and callable(getattr(tools, name)) and name not in _UNFIT
        ]
        why = f" ({self.name} {_UNFIT[self.name]})" if self.name in _UNFIT else ""
        must(self.name in known, "operator name", f"one of {', '.join(known)}{why}", self.name)
        signature = inspect.signature(function)
        taken = {"sel": 2, "cx": 2, "mut": 1}[prefix]
        free = list(signature.parameters)[taken:]
        must(set(self.options) <= set(free), f"options of {self.name}", f"among {free}", sorted(self.options))
        needed = [
            n
            for n in free
            if signature.parameters[n].default is inspect.Parameter.empty and n not in ("low", "up")
        ]
        must(
            set(needed) <= set(self.options),
            f"options of {self.name}",
            f"complete: {needed}",
            sorted(self.options),
        )
        return function

    def bound(self, prefix: str) -> tuple[Any, dict[str, Any]]:
        """The function and all its keyword arguments, bounds of the unit cube included."""
        function = self.function(prefix)
        names = inspect.signature(function).parameters
        return function, {
            name: value for name, value in (("low", 0.0), ("up", 1.0)) if name in names
        } | self.options


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
        """As in ``--set search.options.population=30``."""
        return "search.options"

    @property
    def bred(self) -> int:
        """Number of offspring."""
        if self.offspring is not None:
            return self.offspring
        return min(self.parents, self.population - self.parents) // 2 * 2

    @model_validator(mode="before")
    @classmethod
    def _following(cls, data: dict[str, Any]) -> dict[str, Any]:
        """What the numbers that are given make of those that are not."""
        population, parents, offspring = (
            _whole(data.get(name)) for name in ("population", "parents", "offspring")
        )
        follow: dict[str, int] = {}
        if "parents" not in data:
            wish = proportional(population or POPULATION)
            if data.get("breeding", "z04") == "z04":  # each parent has one offspring at most
                wish = max(wish, offspring or 0)
            room = wish if population is None else population - (offspring or 0)
            follow["parents"] = max(1, min(wish, room))
        kept = parents or follow.get("parents", PARENTS)
        total = kept + (kept if offspring is None else offspring)
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
        else:
            for operator, prefix in ((self.select, "sel"), (self.mate, "cx"), (self.mutate, "mut")):
                operator.function(prefix)
        return self


def _whole(value: Any) -> int | None:
    """The whole number that a field makes of a value, say of 8.0 or "8"; None where it will refuse it."""
    try:
        return _WHOLE.validate_python(value)
    except ValidationError:
        return None


def proportional(population: int) -> int:
    """How many parents go with a population: the even number nearest to Z04's part of it, 6 of 20; one where
    that is none."""
    return 2 * round(population * PARENTS / POPULATION / 2) or 1


class Breeder:
    """Makes generations. Its random numbers are its own: nothing global is read or left changed.

    box : the current search box, in the unit cube.
    """

    def __init__(self, genes: int, settings: Breeding, seed: int) -> None:
        self.settings = settings
        self.box = SearchBox.full(genes)
        self._rng = np.random.default_rng(np.random.SeedSequence([seed, 0]))
        self.random = OwnRandom(seed)
        self.toolbox = base.Toolbox()
        self.toolbox.register("clone", copy.deepcopy)
        if settings.breeding == "z04":
            self.toolbox.register("select", tools.selBest)
            self.toolbox.register("mate", mate_z04, rng=self._rng)
        else:
            for name, prefix in (("select", "sel"), ("mate", "cx"), ("mutate", "mut")):
                function, options = getattr(settings, name).bound(prefix)
                self.toolbox.register(name, function, **options)
            self._rehearse(genes)

    def first(self) -> list[Individual]:
        """Z04 step 1: a population of random strings."""
        return self._fresh(self.settings.population)

    def following(self, population: Sequence[Individual]) -> list[Individual]:
        """Z04 steps 3 to 6: the best parents (their fitness still valid), their offspring, fresh strings."""
        kept = tools.selBest(population, self.settings.parents)
        offspring = self._offspring(population, self.settings.bred)
        fresh = self._fresh(self.settings.population - len(kept) - len(offspring))
        return [*kept, *offspring, *fresh]

    def recentre(self, best: Individual) -> None:
        """Shrink the search box around the best string (Z04 section 8)."""
        self.box = self.box.recentre(np.array(best), self.settings.recentre_factor)

    def _fresh(self, count: int) -> list[Individual]:
        return [Individual(self.box.sample(self._rng)) for _ in range(count)]

    def _offspring(self, population: Sequence[Individual], count: int) -> list[Individual]:
        if self.settings.breeding == "z04":
            mated = [self.toolbox.clone(string) for string in self.toolbox.select(population, count)]
            pairs = zip(mated[::2], mated[1::2], strict=True)
            return [Individual(child) for pair in pairs for child in self.toolbox.mate(*pair)]
        with self.random:
            mated = [self._to_box(string) for string in self.toolbox.select(list(population), count)]
            for i in range(0, count, 2):
                if random.random() < self.settings.crossover_probability:
                    mated[i : i + 2] = self.toolbox.mate(mated[i], mated[i + 1])
            for i in range(count):
                if random.random() < self.settings.mutation_probability:
                    (mated[i],) = self.toolbox.mutate(mated[i])
        return [self._from_box(string) for string in mated]

    def _to_box(self, string: Individual) -> Individual:
        return Individual(np.clip((np.array(string) - self.box.low) / self.box.width, 0, 1))

    def _from_box(self, string: Individual) -> Individual:
        return Individual(
            np.clip(self.box.low + np.array(string) * self.box.width, self.box.low, self.box.high)
        )

    def _rehearse(self, genes: int) -> None:
        """Breed from throwaway strings, one of them failed: an unfit operator must show before any run."""
        rng, state = np.random.default_rng(0), self.random.state
        strings = [Individual(rng.random(genes)) for _ in range(self.settings.population)]
        for rank, string in enumerate(strings):
            string.fitness.values = (float(rank) if rank else float("inf"),)
        try:
            bred = self._offspring(strings, self.settings.bred)
            with self.random:
                for string in strings:
                    bred += self.toolbox.mate(Individual(string), Individual(strings[0]))
                    bred += self.toolbox.mutate(Individual(string))
            good = all(len(string) == genes and np.all(np.isfinite(string)) for string in bred)
        except Exception as error:
            raise InputError(
                f"operators must be fit for real-valued strings; received {self._names()} ({error!r})"
            ) from error
        finally:
            self.random.state = state
        must(good, "operators", "fit for real-valued strings", self._names())

    def _names(self) -> Mapping[str, str]:
        return {kind: getattr(self.settings, kind).name for kind in ("select", "mate", "mutate")}


def mate_z04(
    first: Sequence[float], second: Sequence[float], rng: np.random.Generator
) -> tuple[Individual, Individual]:
    """Z04 step 4: two offspring phi A + (1 - phi) B.

    A fresh weight 0 <= phi <= 1 for every component of both. first, second : shape (genes,).
    Each component of an offspring lies between its parents'.
    """
    a, b = np.array(first), np.array(second)
    phi = rng.random((2, len(a)))
    # rounding must not carry a component past a parent, or out of the unit cube
    one, two = np.clip(phi * a + (1 - phi) * b, np.minimum(a, b), np.maximum(a, b))
    return Individual(one), Individual(two)
