"""Reads a search.h5 into data frames: every run, every design, logbooks, best designs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tisim.data_frames import data_frame
from tisim.errors import must
from tisim.files.regular_file import is_folder
from tisim.optimize.search_folder import SEARCH_FILE
from tisim.optimize.search_records import searches
from tisim.optimize.storage.cache import Cache, existing
from tisim.optimize.storage.hdf5_store import GENES_TABLE, OBJECTIVES_TABLE, descriptions
from tisim.optimize.storage.runs_table import RunsTable
from tisim.optimize.tables import error_of

if TYPE_CHECKING:
    from pandas import DataFrame

FACTS = ("start", "seed", "ok", "reason", "wall_s", "created", "key")
"""The columns of a run in addition to its genes and values."""


def read(path: str | Path) -> SearchFile:
    """Return the content of a search.h5, given the file or its folder, also while the search is running.

    Nothing is run, and the file is not changed. InputError if there is none, or it is damaged.
    """
    place = Path(path)
    return SearchFile(existing(place / SEARCH_FILE if is_folder(place) else place))


class SearchFile:
    """The runs and searches in a file, at the time of reading.

    Data frames have the unit of each column in ``frame.attrs["units"]``; they need pandas. If a file has
    several problems or searches, as after a comparison, pass the name to the methods.
    """

    def __init__(self, cache: Cache) -> None:
        self._runs, self._searches = cache.runs(), searches(cache)
        self._tables = {name: cache.table(name) for name in cache.tables()}
        self._units = {
            problem: {name.partition("/")[2]: str(one.get("unit", "")) for name, one in about.items()}
            for problem, about in descriptions(self._tables).items()
        }

    def __repr__(self) -> str:
        counts = f"{sum(map(len, self._runs))} runs, {len(self._searches)} searches"
        return f"<file of {', '.join(self.problems) or 'no problem'}: {counts}>"

    @property
    def problems(self) -> list[str]:
        """Return the names of the problems that have runs."""
        return list(dict.fromkeys(part.problem for part in self._runs))

    @property
    def searches(self) -> list[str]:
        """Return the names of the searches."""
        return [name.removeprefix("searches/") for name in self._searches]

    def runs(self, problem: str | None = None) -> DataFrame:
        """Return every run of a problem, a row for each: the genes of its design, its values, and FACTS."""
        return self._frame(problem, lambda part: {**part.genes, **part.values, **_facts(part)})

    def designs(self, problem: str | None = None) -> DataFrame:
        """Return every design of a problem, a row for each.

        The columns are genes, the mean of each value over all successful runs, its standard error, the number
        of these runs, and the reason of the first failure ("" if none failed).
        """
        return self._frame(problem, _designs)

    def logbook(self, search: str | None = None) -> DataFrame:
        """Return the logbook of a search, a row for each generation."""
        return self._table(search, "logbook")

    def hall(self, search: str | None = None) -> DataFrame:
        """Return the best designs of a search, the columns of best.csv."""
        return self._table(search, "hall_of_fame")

    def genes(self, search: str | None = None) -> DataFrame:
        """Return the genes of a search: names, units, ranges, scales."""
        return self._table(search, GENES_TABLE)

    def objectives(self, search: str | None = None) -> DataFrame:
        """Return the objectives of a search: names, units, directions."""
        return self._table(search, OBJECTIVES_TABLE)

    def settings(self, search: str | None = None) -> dict[str, Any]:
        """Return the settings of a search."""
        name = _one(search, self.searches, "search")
        return dict(json.loads(self._searches[f"searches/{name}"]["settings"]))

    def _table(self, search: str | None, below: str) -> DataFrame:
        name = _one(search, self.searches, "search")
        table = self._tables[f"searches/{name}/{below}"]
        units = {head: str(one.get("unit", "")) for head, one in table.about.items()}
        return data_frame(table.columns, units)

    def _frame(self, problem: str | None, columns: Callable[[RunsTable], Mapping[str, Any]]) -> DataFrame:
        name = _one(problem, self.problems, "problem")
        named = self._units.get(name, {})
        intervals = {error_of(head): unit for head, unit in named.items()}
        units = {**named, **intervals, "wall_s": "s", "created": "s"}
        frames = [data_frame(columns(part), units) for part in self._runs if part.problem == name]
        if len(frames) == 1:
            return frames[0]
        from pandas import concat

        # These runs are from a version of the problem with other genes.
        joined = concat(frames, ignore_index=True)
        joined.attrs["units"] = {head: units[head] for head in joined.columns if units.get(head)}
        return joined


def _facts(part: RunsTable) -> dict[str, NDArray[Any]]:
    columns = {name: _text(part.facts[name]) for name in FACTS}
    return {**columns, "ok": part.facts["ok"] == 1}


def _text(column: NDArray[Any]) -> NDArray[Any]:
    """Return a column with text in place of bytes."""
    return np.char.decode(column, "utf-8").astype(object) if column.dtype.kind == "S" else column


def _designs(part: RunsTable) -> dict[str, NDArray[Any]]:
    """Return the columns of the different designs of a table of runs, in the order of their first runs."""
    first, design = part.designs()
    ok = part.facts["ok"] == 1
    columns = {name: _text(column[first]) for name, column in part.genes.items()}
    for name, values in part.values.items():
        known = ok & ~np.isnan(values)
        columns[name], columns[error_of(name)] = _means(values[known], design[known], len(first))
    columns["starts"] = np.bincount(design[ok], minlength=len(first))
    reasons = np.full(len(first), "", dtype=object)
    failed = np.flatnonzero(~ok)[::-1]  # the first of a design is written last
    reasons[design[failed]] = _text(part.facts["reason"][failed])
    return {**columns, "failed": reasons}


def _means(values: NDArray[Any], design: NDArray[Any], designs: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the mean of each design, and its standard error; NaN for fewer than two values."""
    count = np.bincount(design, minlength=designs)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(design, values, designs) / count
        variance = np.bincount(design, (values - mean[design]) ** 2, designs) / (count - 1)
        error = np.sqrt(variance / count)
    return mean, np.where(count < 2, np.nan, error)


def _one(name: str | None, known: Sequence[str], what: str) -> str:
    """Return the name, or the only one that exists. InputError if it is unknown or ambiguous."""
    if name is None and len(known) == 1:
        return known[0]
    must(name in known, what, f"one of {', '.join(known) or 'none'}", name)
    return str(name)
