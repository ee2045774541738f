"""A search as its folder has it: designs, their runs, logbook and settings, without the code of its problem.

Nothing is run, and no code of the user is loaded.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tisim.errors import InputError, must
from tisim.files import regular_file
from tisim.optimize.evaluation.ensemble import FRESH
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.search_folder import SEARCH_FILE, SHOWN_FILE
from tisim.optimize.search_records import COMMAND_TABLE, DESIGNS_TABLE, searches
from tisim.optimize.storage.cache import Cache, existing
from tisim.optimize.storage.hdf5_store import CONSTRAINTS_TABLE, GENES_TABLE, OBJECTIVES_TABLE
from tisim.optimize.storage.runs_table import RunsTable

Row = Mapping[str, Any]
"""A row of a table: cells by heading."""


@dataclass(frozen=True)
class RunOfDesign:
    """A run of a design that its search has used.

    start : number of the random start. held_out : whether it is one of the starts that did not choose the
        design. seed : of the start. values : by the names of quantities, NaN if it failed.
    reason : of its failure, or "". wall_s : wall time, s.
    """

    start: int
    held_out: bool
    seed: int
    values: Mapping[str, float]
    reason: str
    wall_s: float


@dataclass(frozen=True)
class SearchData:
    """A search.

    name : in the file. problem, title : name and title of its problem.
    stopped : the rule that ended it; "" if it has not ended. identity : see optimize.settings.
    command : words of the command that began it; empty if it was begun in Python.
    genes, objectives, constraints : a row for each, see optimize.search_records.
    logbook : columns by heading. facts, design_genes, values : see ``tables.SearchedDesigns``.
    runs : the runs of each design, in the order of their starts.
    best_scene : the scene of the best design as TOML, if the folder has the one of this search; or "".
    """

    name: str
    problem: str
    title: str
    stopped: str
    settings: Mapping[str, Any]
    identity: Mapping[str, Any]
    versions: Mapping[str, Any]
    command: Sequence[str]
    genes: Sequence[Row]
    objectives: Sequence[Row]
    constraints: Sequence[Row]
    logbook: Mapping[str, Sequence[Any]]
    facts: Mapping[str, Sequence[Any]]
    design_genes: Mapping[str, Sequence[Any]]
    values: Mapping[str, Sequence[float]]
    runs: Sequence[Sequence[RunOfDesign]]
    best_scene: str = ""

    def __len__(self) -> int:
        return len(self.facts.get("gen", ()))

    def design(self, k: int) -> dict[str, Any]:
        """Return the genes of a design by name."""
        return {name: column[k] for name, column in self.design_genes.items()}

    @property
    def common_starts(self) -> bool:
        """Whether start k has the same seed for every design."""
        return self.settings.get("ensemble", {}).get("common_starts") is not False


def search_names(file: Path) -> list[str]:
    """Return the names of the searches in a search.h5, or in the folder of one."""
    return _names(existing(_file(file)))


def read_search(path: str | Path, search: str | None = None) -> SearchData:
    """Return a search from its folder or its search.h5, also while it is running.

    search : its name, if the file has several; by default the one that the result files of the folder belong
        to, or else the first.

    InputError if there is no such file, or no such search in it.
    """
    file = _file(Path(path))
    stored = existing(file)
    names, shown = _names(stored), _shown(file.parent)
    must(bool(names), "file", "one with a search", str(file))
    if search is None:
        search = shown if shown in names else names[0]
    must(search in names, "search", f"one of {', '.join(names)}", search)
    name = f"searches/{search}"
    attributes, tables = searches(stored)[name], {*stored.tables()}

    def columns(below: str) -> Mapping[str, Sequence[Any]]:
        return stored.table(f"{name}/{below}").columns if f"{name}/{below}" in tables else {}

    identity, settings = json.loads(attributes["identity"]), json.loads(attributes["settings"])
    problem = str(attributes["problem"])
    genes = _rows(columns(GENES_TABLE))
    designs = _choices(columns(f"{DESIGNS_TABLE}/genes"), genes)
    common = settings.get("ensemble", {}).get("common_starts") is not False
    runs = [part for part in stored.runs() if part.problem == problem]
    scene = regular_file.content(file.parent / "best_scene.toml") if search == shown else None
    return SearchData(
        name=search,
        problem=problem,
        title=str(attributes["title"]) or problem,
        stopped=str(attributes["stopped"]),
        settings=settings,
        identity=identity,
        versions=json.loads(attributes["versions"]),
        command=list(columns(COMMAND_TABLE).get("word", ())),
        genes=genes,
        objectives=_rows(columns(OBJECTIVES_TABLE)),
        constraints=_rows(columns(CONSTRAINTS_TABLE)),
        logbook=columns("logbook"),
        facts=columns(DESIGNS_TABLE),
        design_genes=designs,
        values=columns(f"{DESIGNS_TABLE}/values"),
        runs=_runs_of(designs, runs, int(settings["seed"]), common),
        best_scene=(scene or b"").decode(errors="replace"),
    )


def _file(path: Path) -> Path:
    return path / SEARCH_FILE if regular_file.is_folder(path) else path


def _names(stored: Cache) -> list[str]:
    return [name.removeprefix("searches/") for name in searches(stored)]


def _shown(folder: Path) -> str:
    """Return the name of the search that the result files of a folder belong to; "" if there are none."""
    content = regular_file.content(folder / SHOWN_FILE)
    try:
        return str(json.loads(content or b"{}").get("search", ""))
    except (ValueError, AttributeError):
        raise InputError(f"{folder / SHOWN_FILE} must be JSON; received {content!r}") from None


def _choices(columns: Mapping[str, Sequence[Any]], genes: Sequence[Row]) -> dict[str, Sequence[Any]]:
    """Return the genes of designs, with choices as they are: numbers beside texts are stored as texts."""
    found = dict(columns)
    for row in genes:
        if "choices" in row and row["name"] in found:
            by_text = {str(choice): choice for choice in json.loads(row["choices"])}
            found[row["name"]] = [by_text.get(str(value), value) for value in found[row["name"]]]
    return found


def _rows(columns: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Return columns as rows, without cells that a row does not have (NaN or "")."""
    found = []
    for cells in zip(*columns.values(), strict=True):
        row = dict(zip(columns, cells, strict=True))
        found.append({name: value for name, value in row.items() if value == value and value != ""})
    return found


def _runs_of(
    designs: Mapping[str, Sequence[Any]], parts: Sequence[RunsTable], seed: int, common: bool
) -> list[list[RunOfDesign]]:
    """Return the runs of each design, as far as they have the seeds of this search."""
    points = list(zip(*designs.values(), strict=True))
    index = {_point(point): k for k, point in enumerate(points)}
    runs: list[list[RunOfDesign]] = [[] for _ in points]
    same = cache(lambda start: start_seed(seed, start))
    for part in parts:
        if set(part.genes) != set(designs):
            continue
        columns = [_plain(part.genes[name]) for name in designs]
        values = {name: column.tolist() for name, column in part.values.items()}
        reasons = _plain(part.facts["reason"])
        starts, seeds = part.facts["start"].tolist(), part.facts["seed"].tolist()
        seconds = part.facts["wall_s"].tolist()
        for row, point in enumerate(zip(*columns, strict=True)):
            k = index.get(_point(point))
            if k is None:
                continue
            start = starts[row]
            own = dict(zip(designs, points[k], strict=True))
            # A start is the same for all designs, or the design's own.
            used = (common and seeds[row] == same(start)) or seeds[row] == start_seed(seed, start, own)
            if used:
                mine = {name: column[row] for name, column in values.items()}
                runs[k].append(
                    RunOfDesign(start, start >= FRESH, seeds[row], mine, reasons[row], seconds[row])
                )
    return [sorted(of_it, key=lambda run: run.start) for of_it in runs]


def _point(values: Sequence[Any]) -> tuple[Any, ...]:
    """Return the genes of a design so that equal designs are equal: a flag is no number."""
    return tuple((type(value) is bool, type(value) is str, value) for value in values)


def _plain(column: np.ndarray) -> list[Any]:
    """Return a column as Python values."""
    cells: list[Any] = column.tolist()
    return [cell.decode(errors="replace") for cell in cells] if column.dtype.kind == "S" else cells


def number_or_none(value: Any, digits: int = 7) -> float | None:
    """Return a number rounded to some significant digits; None if it is not finite."""
    return float(f"{value:.{digits}g}") if math.isfinite(value) else None
