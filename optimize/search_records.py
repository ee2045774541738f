"""Stores the settings, versions, logbook and best designs of a search as tables in its cache file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import deap

from tisim.io.run_folder import versions
from tisim.optimize.experiments import table_of
from tisim.optimize.outcome import Outcome
from tisim.optimize.problem.problem import Problem
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.hdf5_store import CONSTRAINTS_TABLE, GENES_TABLE, OBJECTIVES_TABLE
from tisim.optimize.storage.record import canonical
from tisim.optimize.tables import attributes, best_columns, logbook_columns, searched_designs

WARM_START = "warm_start"
"""Name of the table of the known designs of a warm start; its checksum has this key in an identity."""
DESIGNS_TABLE, COMMAND_TABLE = "designs", "command"
"""Names of the tables, below a search, of its designs (with ``genes`` and ``values`` below), and of the words
of the command that began it."""


def store(cache: Cache, outcome: Outcome) -> None:
    """Store the tables of a search in the file; they are on disk on return.

    New rows are written to its journal; at the beginning and the end of the search, all are written to the
    HDF5 file.
    """
    problem, name = outcome.problem, outcome.name
    of_search = {
        "problem": problem.name,
        "title": problem.title,
        "identity": canonical(outcome.identity).decode(),
        "settings": outcome.settings.model_dump_json(),
        "versions": json.dumps({**versions(), "deap": deap.__version__}),
        "stopped": outcome.stopped,
    }
    for below, columns in beginning_tables(outcome).items():
        cache.put_table(f"{name}/{below}", columns)
    cache.put_table(f"{name}/{GENES_TABLE}", genes(problem))
    cache.put_table(f"{name}/{OBJECTIVES_TABLE}", objectives(problem))
    if problem.constraints:
        cache.put_table(f"{name}/{CONSTRAINTS_TABLE}", constraints(problem))
    for below, columns in (
        ("hall_of_fame", best_columns(problem, outcome.hall)),
        ("logbook", logbook_columns(problem, outcome.logbook)),
    ):
        about = {heading: one for heading, one in attributes(problem).items() if heading in columns}
        cache.put_table(f"{name}/{below}", columns, about=about)
    designs = searched_designs(
        problem, outcome.generations, {**outcome.estimates, **outcome.failures}, outcome.limits,
        outcome.held_out, outcome.hall, outcome.best,
    )  # fmt: skip
    for below, columns in (("", designs.facts), ("/genes", designs.genes), ("/values", designs.values)):
        cache.put_table(f"{name}/{DESIGNS_TABLE}{below}", columns)
    cache.put_table(name, {}, of_search)
    if outcome.stopped or not outcome.logbook:
        cache.fold()


def store_command(cache: Cache, search: str, words: Sequence[str]) -> None:
    """Store the command that began a search, or goes on with it: its name, arguments and options."""
    if words:
        cache.put_table(f"{search}/{COMMAND_TABLE}", {"word": list(words)})


def beginning_tables(outcome: Outcome) -> dict[str, dict[str, list[Any]]]:
    """Return the columns of the tables of a search's beginning, if it has designs."""
    problem, beginning = outcome.problem, outcome.beginning
    tables = {}
    if beginning.designs:
        names = beginning.designs[0]
        tables["starting_designs"] = {name: [design[name] for design in beginning.designs] for name in names}
    if beginning.experiments:
        tables["experiments"] = table_of(problem, beginning.experiments)
    if beginning.warm is not None:
        tables[WARM_START] = table_of(problem, beginning.warm)
    return tables


def genes(problem: Problem) -> dict[str, list[Any]]:
    """Return the columns of a table with a row for each gene: all its fields except functions."""
    rows = [{one.name: getattr(gene, one.name) for one in fields(gene)} for gene in problem.genome.genes]
    return _columns([{n: value for n, value in row.items() if not callable(value)} for row in rows])


def objectives(problem: Problem) -> dict[str, list[Any]]:
    """Return the columns of a table with a row for each objective: name, unit, direction, meaning."""
    rows = [
        {
            "name": objective.name,
            "unit": objective.unit,
            "direction": "largest" if objective.maximise else "smallest",
            "statistic": objective.statistic.described or "mean",
            "description": problem.meanings.get(objective.name, ""),
        }
        for objective in problem.objectives
    ]
    return _columns(rows)


def constraints(problem: Problem) -> dict[str, list[Any]]:
    """Return the columns of a table with a row for each constraint: name, unit, bounds, what it limits."""
    rows = [
        {
            "name": constraint.name,
            "unit": constraint.unit,
            "at_least": constraint.at_least,
            "at_most": constraint.at_most,
            "of": constraint.kind,
        }
        for constraint in problem.constraints
    ]
    return _columns(rows)


def _columns(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Return rows as columns of numbers or of text; NaN or "" for missing entries."""
    names = dict.fromkeys(name for row in rows for name in row)
    columns = {name: [_cell(row.get(name)) for row in rows] for name in names}
    return {name: _filled(column) for name, column in columns.items()}


def _cell(value: Any) -> float | str | None:
    return value if value is None or isinstance(value, int | float | str) else json.dumps(value, default=str)


def _filled(column: list[Any]) -> list[Any]:
    nothing = "" if any(isinstance(cell, str) for cell in column) else math.nan
    return [nothing if cell is None else cell for cell in column]


def searches(cache: Cache) -> dict[str, Mapping[str, Any]]:
    """Return the attributes of each search in the file, by its name."""
    tables = cache.attributes()
    return {name: attributes for name, attributes in tables.items() if "identity" in attributes}
