"""Ask and tell: a search method for experiments, or for a simulator outside tisim.

The methods are the same as in a search. The designs that one asks for depend only on its seed and on the
values that it was told. A campaign can therefore be resumed from a CSV file of these values: a new object
with the same settings replays the file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tisim.errors import InputError, Words, is_number, must
from tisim.optimize.beginning import Beginning
from tisim.optimize.campaign_file import CampaignFile, Tried, campaign_line
from tisim.optimize.designs_csv import (
    GENERATION,
    WHETHER_ASKED,
    Given,
    check_headings,
    design_of,
    naming,
    rows,
)
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.experiments import known, row_values
from tisim.optimize.hall_of_fame import hall_of_fame
from tisim.optimize.methods.base import find
from tisim.optimize.methods.individual import Individual
from tisim.optimize.outcome import Design, Outcome
from tisim.optimize.problem.calls import check_design
from tisim.optimize.problem.feasibility import penalised
from tisim.optimize.problem.genome import AnyGene, Genome
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.problem import Problem
from tisim.optimize.settings import METHOD, Settings, fit, identity
from tisim.optimize.surrogate.ranking import best
from tisim.optimize.tables import error_of

SAME = 1e-9
"""A told design counts as an asked one if every gene agrees within this tolerance, as a fraction of its
range."""
_TRIES = 100
"""After this number of generations in a row without a new design, ``ask`` returns an empty list."""
_SETTINGS = "of the same genes, method, seed, options and starting designs as this campaign"
Point = tuple[float, ...]
"""A design as a point of the unit cube, at the centre of the cells of integers and choices."""


class AskTell:
    """A campaign: ``ask`` for designs, evaluate them elsewhere, ``tell`` their values.

    problem : a Problem, whose scene and objective functions are not called; or a genome or its genes,
        together with ``objectives``.
    objectives : a list of names to minimise, {name: "smallest" or "largest"}, or Objectives.
    method, seed, options : as in a search.
    starting_designs : designs to be asked for first (see optimize.run).
    file : a CSV file in which every told value is recorded; an existing file is continued.

    InputError if the method does not support the problem, or the file has other genes or settings.
    """

    def __init__(
        self,
        problem: Problem | Genome | Sequence[AnyGene],
        objectives: Sequence[str | Objective] | Mapping[str, Literal["smallest", "largest"]] = ("value",),
        *,
        method: str = METHOD,
        seed: int = 0,
        options: Mapping[str, Any] | None = None,
        starting_designs: Given | None = None,
        file: str | Path | None = None,
    ) -> None:
        self.problem = problem if isinstance(problem, Problem) else _elsewhere(problem, objectives)
        self.settings = Settings(method=method, seed=seed, options=dict(options or {}))
        beginning = Beginning.of(self.problem, starting_designs, None, False)
        fit(self.problem, self.settings, beginning)
        genome, count = self.problem.genome, len(self.problem.objectives)
        self._method = find(method)(genome, count, self.settings.options, seed)
        self._starting = beginning.first(self.problem)
        self._asked: list[Individual] = []  # of the current generation
        self._open: dict[Point, list[Individual]] = {}  # individuals that await a value, by design
        self._by_method = False  # whether the method proposed them
        self._generations = 0
        self._told: dict[Point, list[Tried]] = {}
        # Individuals of told designs; the first one of a design is the one told.
        self._individuals: dict[Point, list[Individual]] = {}
        self._not_learned: list[Point] = []
        self._file = CampaignFile(self.problem, None if file is None else Path(file))
        self._replay()

    def ask(self) -> list[dict[str, Any]]:
        """Return the designs to be tried now, as {gene name: value in its unit}.

        The same designs are returned until each has been told, then the next ones. The list is empty once the
        method has no new design.
        """
        for _ in range(_TRIES):
            if self._open:
                return [self.problem.genome.decode(individuals[0]) for individuals in self._open.values()]
            self._next()
        return []

    def tell(
        self, designs: Given | Mapping[str, Any], values: Any = None, standard_errors: Any = None
    ) -> None:
        """Report the values of designs: of those that were asked for, in any order and number, or of others.

        designs : one design, or a list, by the names of the searched genes, or a CSV file
            (optimize.experiments).
        values : one value for each design, in the unit of the objective. With several objectives, or with
            constraints of the result, each is a list in that order or a dictionary by name. NaN or None for a
            failed design. Omitted if the designs contain the values as further keys or columns.
        standard_errors : the standard errors of the values, in the same form, if known.

        The values of a design that is told more than once are averaged, weighted by the standard errors if
        they are given; otherwise the noise is estimated from the spread of the values. A single value without
        a standard error counts as exact.

        InputError for invalid input; in that case nothing is recorded.
        """
        given: Any = [designs] if isinstance(designs, Mapping) else designs
        in_file = isinstance(given, str | Path)
        for what, of in (("values", values), ("standard_errors", standard_errors)):
            able = of is None or (not in_file and values is not None)
            must(able, what, "left out if the designs contain them", of)
        if values is not None:
            given = self._joined(list(given), values, standard_errors, designs is not given)
        read = []
        for place, row in rows(given, "told design"):
            with naming(place):
                read.append((row, *self._read(row)))
        lines = [self._line(row, self._same(point) in self._open) for row, point, _ in read]
        tries, individuals = self._known([(point, tried) for _, point, tried in read])
        self._file.append(lines)
        self._take(tries, individuals)

    @property
    def best(self) -> Design | None:
        """The best design by posterior mean, or the compromise of several objectives. None before a value is
        known."""
        outcome = self.outcome
        return next((one for one, individual in zip(outcome.designs, outcome.hall, strict=True)
                     if individual is outcome.best), None)  # fmt: skip

    @property
    def designs(self) -> list[Design]:
        """The best designs, best first, or the front of several objectives.

        Their values are biased towards good ones, because the designs were chosen by these values. Without a
        feasible design they are the ones with the least violation; see Design.feasible.
        """
        return self.outcome.designs

    @property
    def outcome(self) -> Outcome:
        """The results so far, as of a search, for ``to_frame`` and ``tisim.optimize.sensitivity``."""
        found = Outcome(self.problem, self.settings, identity(self.problem, self.settings, {}))
        individuals = self._ranked()
        for individual in individuals:
            (found.failures if individual.failed else found.estimates)[tuple(individual)] = (
                individual.estimates
            )
        places = len(individuals) if self.problem.several else self.settings.hall_of_fame
        found.limits = {tuple(individual): individual.limits for individual in individuals}
        # Values that were told once count as exact.
        repeated = any(limit.starts > 1 for individual in individuals for limit in individual.limits)
        constraints = self.problem.result_constraints if repeated else ()
        found.hall.fill(best(self.problem.genome, individuals, places, constraints))
        return found

    def _next(self) -> None:
        """Tell the method the known values, and ask it for the next generation."""
        hall = hall_of_fame(self.problem, self.settings.hall_of_fame)
        hall.update(self._ranked())
        if self._by_method:
            self._method.tell(self._asked, hall.individuals)
        if self._not_learned:
            self._method.learn([self._individuals[point][0] for point in self._not_learned])
            self._not_learned = []
        self._by_method = bool(self._generations) or not self._starting
        self._asked = self._method.ask() if self._by_method else self._starting
        self._generations += 1
        for individual in self._asked:
            if not individual.fitness.valid:
                self._recognise(individual)

    def _recognise(self, individual: Individual) -> None:
        """Give an individual the known values of its design, or list it as open. It fails if its design
        violates a design constraint."""
        design = self.problem.genome.decode(individual)
        point = self._point(design)
        if point in self._individuals:
            _become(individual, self._individuals[point][0])
            self._individuals[point].append(individual)
            return
        try:
            check_design(self.problem, design)
        except InputError as error:
            failed = FitnessEstimate.failed(0, f"infeasible: {error}")
            individual.know((failed,) * len(self.problem.objectives))
        else:
            self._open.setdefault(point, []).append(individual)

    def _ranked(self) -> list[Individual]:
        """Return the individuals of all told designs; their costs rank feasible designs first."""
        individuals = [of_design[0] for of_design in self._individuals.values()]
        good = [individual for individual in individuals if not individual.failed]
        if good and self.problem.result_constraints:
            costs = [[estimate.mean for estimate in individual.estimates] for individual in good]
            ordered = penalised(costs, [individual.violation for individual in good])
            for individual, cost in zip(good, ordered.tolist(), strict=True):
                individual.fitness.values = tuple(cost)
            for first, *others in self._individuals.values():
                for individual in others:
                    individual.fitness.values = first.fitness.values
        return individuals

    def _known(
        self, told: Sequence[tuple[Point, Tried]]
    ) -> tuple[dict[Point, list[Tried]], dict[Point, Individual]]:
        """Return all trials of each told design, and the individual that combines them."""
        tries: dict[Point, list[Tried]] = {}
        for point, tried in told:
            same = self._same(point)
            tries.setdefault(same, [*self._told.get(same, ())]).append(tried)
        individuals = {}
        for point, of_design in tries.items():
            values, errors, limits = zip(*of_design, strict=True)
            individuals[point] = known(self.problem, point, values, errors, limits)
        return tries, individuals

    def _take(self, tries: Mapping[Point, list[Tried]], individuals: Mapping[Point, Individual]) -> None:
        """Record the trials and individuals of told designs."""
        self._told |= tries
        for point, individual in individuals.items():
            if point not in self._individuals:
                if not (self._by_method and point in self._open):
                    self._not_learned.append(point)
                self._individuals[point] = self._open.pop(point, [individual])
            for other in self._individuals[point]:
                _become(other, individual)

    def _same(self, point: Point) -> Point:
        """Return the asked or told design that agrees with this one within ``SAME``; the point itself if
        there is none."""
        points = list(dict.fromkeys((*self._open, *self._individuals)))
        if point in self._open or point in self._individuals or not points:
            return point
        apart = np.abs(np.array(points) - point).max(axis=1)
        return points[int(np.argmin(apart))] if apart.min() <= SAME else point

    def _point(self, design: Mapping[str, Any]) -> Point:
        return tuple(map(float, self.problem.genome.encode(design)))

    def _read(self, row: Mapping[str, str]) -> tuple[Point, Tried]:
        check_headings(self.problem, row)
        return self._point(design_of(self.problem, row)), row_values(self.problem, row)

    def _joined(self, designs: list[Any], values: Any, errors: Any, one: bool) -> list[dict[str, Any]]:
        """Return the designs with their values and standard errors as further keys."""
        objectives = [objective.name for objective in self.problem.objectives]
        names = [*objectives, *(constraint.name for constraint in self.problem.result_constraints)]
        values_of = [values] if one else list(values)
        errors_of = [None] * len(designs) if errors is None else [errors] if one else list(errors)
        for what, of in (("values", values_of), ("standard_errors", errors_of)):
            must(len(of) == len(designs), what, f"one for each of {len(designs)} designs", of)
        found = []
        for design, value, error in zip(designs, values_of, errors_of, strict=True):
            must(isinstance(design, Mapping), "design", "a dictionary by the names of genes", design)
            by_name = _by_name(value, names, "values of a design")
            errors_by_name = {} if error is None else _by_name(error, objectives, "standard errors")
            found.append({**design, **by_name, **{error_of(k): v for k, v in errors_by_name.items()}})
        return found

    def _line(self, row: Mapping[str, str], asked: bool) -> list[str]:
        """Return the line of the file for a told row."""
        _, tried = self._read(row)
        return campaign_line(self._generations, asked, design_of(self.problem, row), tried)

    def _replay(self) -> None:
        """Tell the method the contents of the file, in their order."""
        for place, row in self._file.rows():
            with naming(place):
                point, tried = self._read(row)
                self._go_on_to(row[GENERATION])
                asked = self._same(point) in self._open
                must(
                    asked or row[WHETHER_ASKED] != "yes",
                    "campaign file",
                    _SETTINGS,
                    Words("a design that was not asked for"),
                )
                self._file.lines.append(self._line(row, asked))
                self._take(*self._known([(point, tried)]))

    def _go_on_to(self, generation: str) -> None:
        must(generation.isdigit(), GENERATION, "a whole number", generation)
        while self._generations < int(generation):
            must(not self._open, "campaign file", _SETTINGS, Words("one without some designs before"))
            self._next()


def _become(individual: Individual, other: Individual) -> None:
    """Give an individual the known values of another one with the same design."""
    individual.know(other.estimates)
    individual.limits, individual.violation = other.limits, other.violation
    individual.fitness.values = other.fitness.values


def _by_name(value: Any, names: Sequence[str], what: str) -> dict[str, Any]:
    """Return one or several numbers as a dictionary by name."""
    if isinstance(value, Mapping):
        must(set(value) == set(names), what, f"of {', '.join(names)}", [*value])
        return dict(value)
    numbers = [value] if value is None or is_number(value) else value
    listed = isinstance(numbers, Sequence | np.ndarray) and len(numbers) == len(names)
    must(listed and not isinstance(value, str), what, f"of {', '.join(names)}", value)
    return dict(zip(names, numbers, strict=True))


def _elsewhere(
    genes: Genome | Sequence[AnyGene], objectives: Sequence[str | Objective] | Mapping[str, str]
) -> Problem:
    """Return the problem of a campaign with these genes."""
    must(not isinstance(objectives, str), "objectives", "a list or a dictionary of names", objectives)
    directions = dict(objectives) if isinstance(objectives, Mapping) else {}
    for name, direction in directions.items():
        must(direction in ("smallest", "largest"), f"objective {name}", "'smallest' or 'largest'", direction)
    made = [
        one
        if isinstance(one, Objective)
        else Objective(one, _not_here, maximise=directions.get(one) == "largest")
        for one in objectives
    ]
    return Problem.of_function(_not_here, genes, made, name="campaign")


def _not_here(design: Any) -> float:
    """The objective of a campaign, which is evaluated elsewhere; raises InputError when called."""
    raise InputError("a campaign must be told the values of its designs; received a call of its objective")
