"""Hall of fame and logbook as plain columns: what the report prints and the cache file keeps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from deap import tools

from optimize.breeding import Individual
from optimize.problem import Problem


def best_columns(problem: Problem, hall: Sequence[Individual]) -> dict[str, list[Any]]:
    """Z04 tables 1 to 3 in one: rank, every gene in its unit, fitness with the half-width of its 95 %
    confidence interval, the derived columns of the problem, starts, whether their mean has settled; the same
    from fresh starts where the designs have been confirmed. Heading -> values, best first.
    """
    estimates = [string.estimate for string in hall if string.estimate is not None]
    columns: dict[str, list[Any]] = {"rank": list(range(1, len(estimates) + 1))}
    designs = [problem.genome.decode(string) for string in hall]
    for gene in problem.genome.genes:
        columns[gene.label] = [design[gene.name] for design in designs]
    columns[problem.symbol] = [estimate.mean for estimate in estimates]
    columns["95 % +-"] = [estimate.half_width for estimate in estimates]
    for heading, function in problem.derived.items():
        columns[heading] = [float(function(estimate.mean)) for estimate in estimates]
    columns["starts"] = [estimate.starts for estimate in estimates]
    columns["settled"] = ["yes" if estimate.settled else "no" for estimate in estimates]
    confirmed = [string.confirmed for string in hall if string.confirmed is not None]
    if confirmed:
        columns[f"{problem.symbol}, fresh starts"] = [estimate.mean for estimate in confirmed]
        columns["95 % +-, fresh starts"] = [estimate.half_width for estimate in confirmed]
        for heading, function in problem.derived.items():
            columns[f"{heading}, fresh starts"] = [float(function(estimate.mean)) for estimate in confirmed]
    return columns


def logbook_columns(problem: Problem, logbook: tools.Logbook) -> dict[str, list[Any]]:
    """The logbook and the derived values of each generation's best. Heading -> values by generation."""
    columns = {name: list(logbook.select(name)) for name in (logbook[0] if logbook else {})}
    for heading, function in problem.derived.items() if columns else ():
        columns[heading] = [float(function(best)) for best in columns["best"]]
    return columns
