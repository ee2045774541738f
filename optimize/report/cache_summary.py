"""The evaluations and searches in a cache file are summarised in a few lines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from optimize.search_records import searches
from optimize.storage.cache import existing
from optimize.storage.record import Record
from tisim.console import plain_table

MAX_REASONS = 5
"""The largest number of failures whose reasons are spelled out."""


def summary(path: str | Path) -> RenderableType:
    """Return tables of the evaluations in a cache file by problem, of its searches, and of why some failed.

    InputError if there is no such file.
    """
    cache = existing(path)
    records = cache.records()
    table = plain_table("search", "generations", "best", "ended by")
    for name, about in searches(cache).items():
        log = cache.table(f"{name}/logbook").columns
        best = [values[-1] for heading, values in log.items() if heading.split(" ")[0] == "best" and values]
        last = ", ".join(f"{value:.6g}" for value in best) or "none"
        table.add_row(
            name, str(max(0, len(log.get("gen", [])) - 1)), last, str(about["stopped"]) or "not ended"
        )
    return Group(_evaluations(records), "", table, *_failures(records))


def _evaluations(records: Sequence[Record]) -> Table:
    table = plain_table("problem", "evaluations", "failed", "lowest .. highest", "run time")
    for problem in dict.fromkeys(record.problem for record in records):
        mine = [record for record in records if record.problem == problem]
        good = [record.values for record in mine if record.ok]
        ranges = ", ".join(f"{min(v):.6g} .. {max(v):.6g}" for v in zip(*good, strict=True))
        seconds = sum(record.wall_s for record in mine)
        table.add_row(
            problem, str(len(mine)), str(len(mine) - len(good)), ranges or "none", f"{seconds:.1f} s"
        )
    return table


def _failures(records: Sequence[Record]) -> list[RenderableType]:
    failed = [record for record in records if not record.ok]
    lines: list[RenderableType] = [
        Text(f"seed {record.seed}: {record.reason}") for record in failed[:MAX_REASONS]
    ]
    more = [f"and {len(failed) - MAX_REASONS} more"] if len(failed) > MAX_REASONS else []
    return ["", "failed:", *lines, *more] if failed else []
