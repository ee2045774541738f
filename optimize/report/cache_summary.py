"""A summary of the evaluations and searches in a cache file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tisim.console import plain_table
from tisim.optimize.search_records import searches
from tisim.optimize.storage.cache import existing
from tisim.optimize.storage.runs_table import RunsTable

MAX_REASONS = 5
"""The largest number of failures whose reasons are printed."""


def summary(path: str | Path) -> RenderableType:
    """Return tables of the evaluations in a cache file by problem, of its searches, and of reasons for
    failures.

    InputError if there is no such file.
    """
    cache = existing(path)
    runs = cache.runs()
    table = plain_table("search", "generations", "best", "ended by")
    for name, about in searches(cache).items():
        log = cache.table(f"{name}/logbook").columns
        best = [values[-1] for heading, values in log.items() if heading.split(" ")[0] == "best" and values]
        last = ", ".join(f"{value:.6g}" for value in best) or "none"
        table.add_row(
            name, str(max(0, len(log.get("gen", [])) - 1)), last, str(about["stopped"]) or "not ended"
        )
    return Group(_evaluations(runs), "", table, *_failures(runs))


def _evaluations(runs: Sequence[RunsTable]) -> Table:
    table = plain_table("problem", "evaluations", "failed", "lowest .. highest", "run time")
    for part in runs:
        good = part.facts["ok"] == 1
        ranges = [_range(column[good]) for column in part.values.values()]
        failed, seconds = len(part) - int(good.sum()), float(part.facts["wall_s"].sum())
        text = ", ".join(filter(None, ranges)) or "none"
        table.add_row(part.problem, str(len(part)), str(failed), text, f"{seconds:.1f} s")
    return table


def _range(values: NDArray[Any]) -> str:
    known = values[~np.isnan(values)]
    return f"{known.min():.6g} .. {known.max():.6g}" if len(known) else ""


def _failures(runs: Sequence[RunsTable]) -> list[RenderableType]:
    failed = [(part, row) for part in runs for row in np.flatnonzero(part.facts["ok"] == 0)]
    records = [part.record(int(row)) for part, row in failed[:MAX_REASONS]]
    lines: list[RenderableType] = [Text(f"seed {record.seed}: {record.reason}") for record in records]
    more = [f"and {len(failed) - MAX_REASONS} more"] if len(failed) > MAX_REASONS else []
    return ["", "failed:", *lines, *more] if failed else []
