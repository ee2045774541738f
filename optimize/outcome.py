"""The progress of a running search, and the outcome of a finished one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from deap import tools
from numpy.typing import NDArray

from tisim.data_frames import data_frame
from tisim.notebook import ShownInNotebook
from tisim.optimize.beginning import NOTHING, Beginning
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.hall_of_fame import HallOfFame, compromise, hall_of_fame
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.calls import constraint_value
from tisim.optimize.problem.feasibility import feasible, violated
from tisim.optimize.problem.gene_values import Value
from tisim.optimize.problem.problem import Problem
from tisim.optimize.settings import Settings, search_name
from tisim.optimize.tables import (
    best_columns,
    design_columns,
    error_of,
    interval_of_value,
    logbook_columns,
    units,
)

if TYPE_CHECKING:
    from pandas import DataFrame

Stopped = Literal["", "generations", "target", "patience", "evaluations", "wall clock", "interrupted"]


@dataclass(frozen=True)
class Progress:
    """The progress of a running search.

    fraction : finished fraction of this generation, 0..1.
    best : best value of each objective over the designs of the hall; empty until one is known.
    designs : number of designs in the hall.
    best_design : for one objective; None until one is known.
    evaluations, hits : numbers of runs made, and of runs found in the cache.
    elapsed_s : wall time since the search began, s.
    failure : reason why a design of this generation failed, as long as no design has succeeded.
    violated : the constraints of the result that the best design violates, in words, if no design satisfies
        all.
    """

    generation: int
    generations: int
    fraction: float
    best: tuple[float, ...]
    designs: int
    best_design: dict[str, Value] | None
    evaluations: int
    hits: int
    elapsed_s: float
    failure: str = ""
    violated: str = ""


@dataclass(frozen=True)
class Design:
    """A design that a search has found, in physical units.

    genes : the value of each gene, by name, in its unit: a number, a text or a flag.
    values : mean of each objective over random starts, by name, in its unit; over the held-out starts if
        there are any.
    intervals : the ends of the 95 % confidence intervals of values and constraints, by name; None without
        held-out starts, because the starts that chose a design bias its values.
    constraints : the value of each constraint, by name, in its unit; of a constraint of the result the mean
        over the same starts.
    feasible : True if the intervals of all constraints lie within their bounds; False if a value does not;
        None if an interval contains a bound, or is not known.
    starts : number of these starts.
    converged : whether the last start changed the mean by less than the given tolerance.
    """

    genes: dict[str, Any]
    values: dict[str, float]
    intervals: dict[str, tuple[float, float] | None]
    starts: int
    converged: bool
    constraints: dict[str, float] = field(default_factory=dict)
    feasible: bool | None = True


@dataclass(repr=False)
class Outcome(ShownInNotebook):
    """The outcome of a search.

    hall : the best different designs, best first, ranked by all information of the search (see
        optimize.conclusion; empty if none succeeded), as a deap.tools.HallOfFame; for several objectives the
        front, as a deap.tools.ParetoFront. Failed designs never enter.
    estimates : estimates of each successful design, by its point of the unit cube, in the order of
        their first estimation.
    quantities : quantities of the runs of each of these, in the order of problem.quantities, shape (starts,
        quantities).
    failures : estimates of each failed design, with the reason.
    limits : estimates of the constraints of the result, of each design.
    held_out : estimates of the objectives and of the constraints of the result from held-out starts, of each
        design that has them.
    generations : the generation in which each design was first estimated, in order.
    logbook : one row for each finished generation: gen, designs (newly estimated), starts (evaluations
        requested), failed, box (mean width of the search box it drew from), recentred (box moved after it),
        best (so far; infinitely bad if there is none). For one objective also mean and std of the successful
        designs in the population (NaN if there is none); for several the number of designs in the front, and
        best for each. The columns of Settings.statistics follow.
    evaluations, hits : numbers of runs made, and of runs found in the cache.
    stopped : the rule that ended it.
    beginning : its starting designs and experiments.
    identity : see optimize.settings. name : name of its group in the cache file.
    """

    shown_by = "tisim.optimize.report.report:outcome_cell"
    problem: Problem
    settings: Settings
    identity: Mapping[str, Any]
    beginning: Beginning = NOTHING
    hall: HallOfFame = field(init=False)
    estimates: dict[tuple[float, ...], tuple[FitnessEstimate, ...]] = field(default_factory=dict)
    quantities: dict[tuple[float, ...], NDArray[np.float64]] = field(default_factory=dict)
    failures: dict[tuple[float, ...], tuple[FitnessEstimate, ...]] = field(default_factory=dict)
    limits: dict[tuple[float, ...], tuple[FitnessEstimate, ...]] = field(default_factory=dict)
    held_out: dict[tuple[float, ...], tuple[tuple[FitnessEstimate, ...], tuple[FitnessEstimate, ...]]] = (
        field(default_factory=dict)
    )
    generations: dict[tuple[float, ...], int] = field(default_factory=dict)
    logbook: tools.Logbook = field(default_factory=tools.Logbook)
    evaluations: int = 0
    hits: int = 0
    elapsed_s: float = 0.0
    stopped: Stopped = ""

    def __post_init__(self) -> None:
        self.hall = hall_of_fame(self.problem, self.settings.hall_of_fame)

    def __repr__(self) -> str:
        counts = f"{len(self.hall)} designs from {self.evaluations + self.hits} runs"
        none = ", none of them feasible" if self.violated else ""
        return f"<search of {self.problem.name}: {counts}{none}, stopped by {self.stopped or 'nothing yet'}>"

    @property
    def name(self) -> str:
        """Return the name of its group in the cache file."""
        return search_name(self.identity)

    @property
    def best(self) -> Individual | None:
        """Return the best design; for several objectives the compromise, the design nearest to the best of
        each, of those that satisfy the constraints of the result with confidence if there are any."""
        if self.hall and self.problem.several:
            constraints = self.problem.result_constraints
            return compromise(
                [one for one in self.hall if feasible(constraints, one.reported_limits)] or self.hall
            )
        return self.hall[0] if self.hall else None

    @property
    def violated(self) -> str:
        """Return the constraints of the result that the first design violates, in words; "" if its means
        satisfy all.

        Feasible designs come first, so that none of the designs is feasible if this one is not.
        """
        if not self.hall:
            return ""
        return violated(self.problem.result_constraints, self.hall[0].reported_limits)

    @property
    def doubt(self) -> str:
        """Return in words that the best design violates constraints of the result, or may do so; "" if it
        satisfies all with confidence."""
        if self.best is None:
            return ""
        constraints, limits = self.problem.result_constraints, self.best.reported_limits
        answer = feasible(constraints, limits)
        if answer is None:
            return "may violate a constraint: an interval contains a bound, or is not known"
        return "" if answer else f"violates a constraint: {violated(constraints, limits)}"

    @property
    def designs(self) -> list[Design]:
        """Return the hall of fame by name and in physical units, in its order."""
        return [self._design(individual) for individual in self.hall]

    def _design(self, individual: Individual) -> Design:
        estimates = individual.confirmed or individual.estimates
        names = [objective.name for objective in self.problem.objectives]
        means = self.problem.costs([estimate.mean for estimate in estimates])
        sure = bool(individual.confirmed) or all(estimate.exact for estimate in estimates)
        intervals = {
            one.name: interval_of_value(estimate, one) if sure else None
            for one, estimate in zip(self.problem.objectives, estimates, strict=True)
        }
        genes = self.problem.genome.decode(individual)
        of_design = [
            FitnessEstimate.certain(constraint_value(one, genes, self.problem))
            for one in self.problem.design_constraints
        ]
        constraints = (*self.problem.design_constraints, *self.problem.result_constraints)
        limits = (*of_design, *individual.reported_limits)
        limited = {one.name: limit for one, limit in zip(constraints, limits, strict=True)}
        intervals |= {
            name: None if math.isnan(limit.low) else (limit.low, limit.high)
            for name, limit in limited.items()
        }
        return Design(
            genes=genes,
            values=dict(zip(names, means, strict=True)),
            intervals=intervals,
            starts=estimates[0].starts,
            converged=estimates[0].converged,
            constraints={name: limit.mean for name, limit in limited.items()},
            feasible=feasible(constraints, limits),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON: units, designs, logbook by column, counts and settings."""
        return {
            "problem": self.problem.name,
            "stopped": self.stopped,
            "evaluations": self.evaluations,
            "hits": self.hits,
            "elapsed_s": self.elapsed_s,
            "units": self._units,
            "designs": [vars(design) for design in self.designs],
            "logbook": logbook_columns(self.problem, self.logbook),
            "settings": self.settings.model_dump(mode="json"),
        }

    @property
    def _units(self) -> dict[str, str]:
        """The unit of each gene, objective and constraint by name, "" if it has none."""
        genes = {gene.name: gene.unit for gene in self.problem.genome.genes}
        constraints = {one.name: one.unit for one in self.problem.constraints}
        return genes | {objective.name: objective.unit for objective in self.problem.objectives} | constraints

    def to_frame(self, *, hall: bool = False) -> DataFrame:
        """Return all designs of the search as a pandas data frame.

        It has a row for each design: its genes by name, the mean of each objective and of each constraint of
        the result over random starts, their standard errors, whether it is feasible by these means, the
        number of starts, whether the mean converged, and the reason of a failure ("" if it did not fail).
        ``frame.attrs["units"]`` has the unit of each column that has one.

        hall : return the hall of fame instead, with the columns of best.csv.

        InputError if pandas is not installed.
        """
        if hall:
            return data_frame(best_columns(self.problem, self.hall), units(self.problem))
        intervals = {error_of(one.name): one.unit for one in self.problem.objectives}
        intervals |= {error_of(one.name): one.unit for one in self.problem.result_constraints}
        columns = design_columns(self.problem, {**self.estimates, **self.failures}, self.limits)
        return data_frame(columns, self._units | intervals)

    @property
    def interrupted(self) -> bool:
        """Return whether Ctrl-C stopped it; search again with the same settings and file to resume."""
        return self.stopped == "interrupted"
