"""The progress display of a search: a bar with the remaining time, the best design, and a line for each
generation."""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType

from rich.console import Console

from tisim.console import progress_bar
from tisim.optimize.outcome import Progress
from tisim.optimize.problem.gene_values import Value, brief
from tisim.optimize.problem.problem import Problem
from tisim.optimize.settings import Settings


class Display:
    """Shows the progress of a search; it is a context manager.

    Pass ``generation`` and ``step`` to ``tisim.optimize.search.search`` as on_generation and on_progress.
    """

    def __init__(self, problem: Problem, settings: Settings, console: Console) -> None:
        self.problem, self.settings = problem, settings
        self.best: Mapping[str, Value] | None = None
        self.bar = progress_bar("{task.fields[reached]}", "{task.fields[best]}", console)
        reached = f"generation 0 of {settings.generations}"
        self.task = self.bar.add_task("", total=1.0, reached=reached, best="")

    def __enter__(self) -> Display:
        self.bar.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.bar.__exit__(kind, error, trace)

    def step(self, where: Progress) -> None:
        """Update the bar with the finished fraction of the generations, or of the budget of runs if that ends
        earlier."""
        generations = (where.generation + where.fraction) / (self.settings.generations + 1)
        most, done = self.settings.max_evaluations, where.evaluations + where.hits
        runs = done / most if most else 0.0
        reached = f"generation {where.generation} of {self.settings.generations}"
        if runs > generations:
            reached = f"generation {where.generation}, {done} of {most} runs"
        self.bar.update(self.task, completed=max(generations, runs), reached=reached)

    def generation(self, where: Progress) -> None:
        """Print a line for a finished generation, and its best design if it is new."""
        self.step(where)
        best = self._best(where)
        self.bar.update(self.task, best=best.split("  ")[0])
        runs = f"{where.evaluations} runs" + (f", {where.hits} from the file" if where.hits else "")
        line = f"generation {where.generation:3d}  {best}  ({runs})"
        self.bar.console.print(line, highlight=False, markup=False)
        if where.best_design is not None and where.best_design != self.best:
            self.best = where.best_design
            text = f"    {self._design(self.best)}"
            self.bar.console.print(text, style="dim", highlight=False, markup=False, soft_wrap=True)

    def _best(self, where: Progress) -> str:
        if not where.best:
            return f"best none yet; the first failed: {where.failure}" if where.failure else "best none yet"
        pairs = zip(self.problem.objectives, where.best, strict=True)
        if where.violated:
            values = "".join(f"  {o.name} {value:.4g} {o.unit}".rstrip() for o, value in pairs)
            return f"no feasible design yet ({where.violated}){values}"
        if self.problem.several:
            best = "".join(f"  {o.name} {value:.4g} {o.unit}".rstrip() for o, value in pairs)
            return f"front of {where.designs}  ideal point{best}"
        objective, fitness = next(pairs)
        derived = "".join(f"  {name} {of(fitness):.4g}" for name, of in self.problem.derived.items())
        return f"best {objective.name} {fitness:.4g} {objective.unit}".rstrip() + derived

    def _design(self, design: Mapping[str, Value]) -> str:
        units = {gene.name: gene.unit for gene in self.problem.genome.genes}
        return ", ".join(f"{name} {brief(value)} {units[name]}".rstrip() for name, value in design.items())
