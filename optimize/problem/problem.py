"""An inverse problem: the scene of a design, and the objectives that its result is judged by."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tisim.errors import InputError, must
from tisim.files import python_file, regular_file
from tisim.files.python_file import sha256
from tisim.optimize.problem.constraint import DesignConstraint, InequalityConstraint, ResultConstraint
from tisim.optimize.problem.faults import function_name
from tisim.optimize.problem.fingerprint import fingerprint
from tisim.optimize.problem.function import PlainFunction, ValueOf
from tisim.optimize.problem.gene_values import Value
from tisim.optimize.problem.genome import AnyGene, Genome
from tisim.optimize.problem.given_genes import DependentGene
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.statistic import Misfit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tisim import Result, Scene


@dataclass(frozen=True)
class Problem:
    """The definition of an inverse problem: genes, scene, objectives and constraints.

    name : short name, part of the cache key; title, description : for reports.
    genome : the genes, their units and ranges.
    scene : (design in physical units, start seed) -> Scene. It should be cheap and only declare the scene. An
        InputError raised here marks the design as infeasible; it does not stop the search. A PlainFunction
        here is called instead of a simulation; see ``of_function``.
    objective : Result -> fitness, minimised. It is called only for runs that ended well; NaN and inf never
        win. Alternatively a list of Objectives: with two or more, the search finds the Pareto front, the
        designs that no other design beats in one objective without losing in another.
    version : increase it when the meaning of the objective changes; fitnesses of the old version are then not
        reused.
    symbol : heading of the fitness in tables and plots, if objective is a function.
    meanings : explanations of report headings, heading -> words; printed below the tables.
    derived : extra report columns computed from the fitness, heading -> function; with one objective only.
    picture : (Scene, Result) -> figure of a run, for the report.
    details : (design, Result) -> further quantities of the best design's run, for the report.
    met_at : a design with this fitness, or a better one, meets all requirements. The report then shows the
        spread of each gene over all such designs of the search. With one objective only.
    constraints : any number of ResultConstraints and DesignConstraints.
    code : a text that distinguishes this problem from others of the same name and version. It replaces the
        checksums of scene and objectives, of their files and of all values that they are bound to (see
        fingerprint.py).
    files : data files that scene or objectives read when they are called. A checksum of their content is part
        of the key of a value. An objective that reads any other file is refused.

    Raises InputError for an empty name, for an empty list of objectives, and for two objectives of the same
    name.
    """

    name: str
    genome: Genome
    scene: Callable[[Mapping[str, Any], int], Any]
    objective: Callable[[Result], float] | Sequence[Objective]
    title: str = ""
    description: str = ""
    version: int = 1
    symbol: str = "fitness"
    derived: Mapping[str, Callable[[float], float]] = field(default_factory=dict)
    meanings: Mapping[str, str] = field(default_factory=dict)
    picture: Callable[[Scene, Result], Figure] | None = None
    details: Callable[[Mapping[str, Any], Result], Mapping[str, float]] | None = None
    met_at: float | None = None
    code: str = ""
    files: Sequence[str | Path] = ()
    constraints: Sequence[InequalityConstraint] = ()

    def __post_init__(self) -> None:
        must(
            bool(self.name.strip()) and "/" not in self.name,
            "problem name",
            "a non-empty string without '/'",
            self.name,
        )
        names = [objective.name for objective in self.objectives]
        must(bool(names) and len(set(names)) == len(names), "objectives", "one or more, all different", names)
        must(len(names) == 1 or not self.derived, "derived", "empty for several objectives", [*self.derived])
        must(not isinstance(self.files, str | Path), "files", "a list of paths", self.files)
        one = len(names) == 1 or self.met_at is None
        must(one, "met_at", "left out for several objectives", self.met_at)
        for constraint in self.constraints:
            able = isinstance(constraint, ResultConstraint | DesignConstraint)
            must(able, "constraint", "a ResultConstraint or a DesignConstraint", constraint)
        own = [*self.quantities, *(constraint.name for constraint in self.constraints)]
        headings = [*self.genome.names, *own]
        twice = sorted({name for name in own if headings.count(name) > 1})
        must(not twice or own == names, "names of constraints, and of quantities,",
             "different from each other and from the names of genes and objectives", twice)  # fmt: skip

    @classmethod
    def of_function(
        cls,
        function: Callable[..., Any],
        genes: Genome | Sequence[AnyGene],
        objectives: Sequence[str | Objective] = ("value",),
        name: str = "",
        **fields: Any,
    ) -> Problem:
        """Return the problem of a plain function of a design, without simulation.

        function : f(design) or f(design, seed) -> a number; with several objectives a list in their order, or
            a dictionary by name; see PlainFunction.
        objectives : a name stands for a value of the function that is minimised; an Objective computes its
            value from a FunctionResult, ``lambda result: -result.value``.
        name : by default the name of the function. fields : other fields of a Problem.
        """
        must(not isinstance(objectives, str), "objectives", "a list of names or Objectives", objectives)
        plain, called = PlainFunction(function), function_name(function).replace("/", " ")
        names = tuple(one if isinstance(one, str) else one.name for one in objectives)
        of_names = tuple(
            Objective(one, ValueOf(called, names, one)) if isinstance(one, str) else one for one in objectives
        )
        genome = genes if isinstance(genes, Genome) else Genome(tuple(genes))
        return cls(name or called, genome, plain, of_names, **fields)

    def fix(self, **values: Value) -> Problem:
        """Return the problem with these genes fixed at values within their ranges."""
        return replace(self, genome=self.genome.fix(**values))

    @property
    def function(self) -> PlainFunction | None:
        """The plain function that replaces the simulation, or None."""
        return self.scene if isinstance(self.scene, PlainFunction) else None

    @property
    def deterministic(self) -> bool:
        """Whether all starts of a design are known to give the same value, so that one is enough."""
        return self.function is not None and not self.function.takes_seed

    @property
    def design_constraints(self) -> tuple[InequalityConstraint, ...]:
        """The constraints that can be checked before a run."""
        return tuple(one for one in self.constraints if isinstance(one, DesignConstraint))

    @property
    def result_constraints(self) -> tuple[InequalityConstraint, ...]:
        """The constraints on a quantity of a run."""
        return tuple(one for one in self.constraints if isinstance(one, ResultConstraint))

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """All objectives; a bare function is one objective that is minimised."""
        if callable(self.objective):
            return (Objective(self.symbol, self.objective),)
        return tuple(self.objective)

    @property
    def quantities(self) -> tuple[str, ...]:
        """The names of the values that are stored for each run: the quantities of all objectives, in
        order."""
        return tuple(name for objective in self.objectives for name in objective.quantities)

    @property
    def measured(self) -> Misfit | None:
        """The misfit to measurements, if it is the only objective."""
        statistic = self.objectives[0].statistic
        return statistic if isinstance(statistic, Misfit) and not self.several else None

    @property
    def identity(self) -> str:
        """A checksum of scene, objectives and the functions of genes and constraints, with all that they are
        bound to now; see ``code``."""
        # The key of a value includes the digest of its scene.
        return f"{self.code or '-'.join(self._design_checksums())}-{self.objective_identity}"

    def _design_checksums(self) -> list[str]:
        """Return checksums of the functions that determine the run of a design."""
        functions = {
            f"gene {gene.name}": gene.of for gene in self.genome.genes if isinstance(gene, DependentGene)
        }
        functions |= {f"constraint {one.name}": one.of for one in self.design_constraints}
        return [checksum_of(self.scene), *(checksum_of(of, what) for what, of in functions.items())]

    @property
    def objective_identity(self) -> str:
        """A checksum of objectives, result constraints, data files and the plain function, if any. It
        determines a value together with the scene."""
        measured = [name for one in self.objectives for name in one.statistic.quantities]
        files = [sha256(read(file)) for file in self.files]
        return _checksum([self.code or self._run_checksums(), files, *([measured] if measured else [])])

    def _run_checksums(self) -> dict[str, str]:
        """Return checksums of the functions that determine the value of a run, by name."""
        checksums = {o.name: checksum_of(o.of, f"objective {o.name}", True) for o in self.objectives}
        functions = {f"constraint {one.name}": one.of for one in self.result_constraints}
        if self.function is not None:
            functions[f"function {function_name(self.function.of)}"] = self.function.of
        return checksums | {what: checksum_of(of, what, True) for what, of in functions.items()}

    @property
    def several(self) -> bool:
        """Whether there are two or more objectives, so that the result is a front instead of one best
        design."""
        return len(self.objectives) > 1

    def costs(self, values: Sequence[float]) -> tuple[float, ...]:
        """Return the objectives' values with signs such that all are minimised; or the inverse."""
        return tuple(o.sign * value for o, value in zip(self.objectives, values, strict=True))


def checksum_of(function: Callable[..., Any], what: str = "", reused: bool = False) -> str:
    """Return a checksum of a function, of the files that define it and of all that it is bound to.

    what : the name of the function in error messages; reused : whether its values are; as in
    ``fingerprint``.
    """
    files = python_file.module_checksums(function)
    return _checksum([fingerprint(function, what, reused), *files.values()])


def _checksum(value: Any) -> str:
    """Return a short checksum of texts in lists and dictionaries."""
    return sha256(json.dumps(value, sort_keys=True).encode())[:24]


def read(file: str | Path) -> bytes:
    """Return the content of a data file of a problem; InputError if it does not exist."""
    content = regular_file.content(regular_file.target(Path(file)))
    if content is None:
        raise InputError(f"files of a problem must exist; received {str(file)!r}")
    return content
