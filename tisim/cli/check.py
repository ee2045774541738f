"""The command ``check`` runs the checks of a case; its table is printed, and written as CSV on request."""

from __future__ import annotations

import datetime
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from tisim.analysis import Mean
from tisim.backend import runtime
from tisim.backend.processor import processor
from tisim.cli import targets
from tisim.cli.options import (
    Arithmetic,
    CaseName,
    Device,
    Overwrite,
    Plugins,
    Precision,
    Threads,
    nameable,
)
from tisim.console import err, out, plain_table
from tisim.errors import RunError, must
from tisim.files import output_folder
from tisim.files.atomic import replace_file
from tisim.scene.scene import PHYSICS_VERSION
from tisim.version import __version__

if TYPE_CHECKING:
    from tisim.cases.case import Check, Claim, Shown

VERDICTS = {True: "pass", False: "FAIL", None: ""}
"""The verdict on a check that passes, on one that fails, and on a value that is shown without a check."""
VERDICT_STYLES = {True: "green", False: "bold red", None: ""}
CSV_COLUMNS = (
    "case", "check", "measured", "half_interval", "expected", "allowed", "verdict",
    "tisim", "physics", "processor", "date",
)  # fmt: skip
"""The heading of the CSV file.

measured : the number, or the mean of several runs, in the unit in the name of the check. half_interval : half
of its 95 % interval; empty for a single number. expected, allowed : as printed. tisim, physics : versions.
"""
File = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="FILE.csv",
        callback=nameable,
        help="Also write the table as CSV, with the versions, the processor and the date.",
    ),
]


def check(
    case: CaseName, file: File = None, device: Device = "cpu", precision: Precision = "f64",
    threads: Threads = 0, arithmetic: Arithmetic = "strict", overwrite: Overwrite = False,
    plugins: Plugins = None,
) -> None:  # fmt: skip
    """Run a case's own checks; exit code 1 when one fails."""
    chosen = targets.case(case)
    if file is not None:
        must(file.suffix == ".csv", "--out", "a file NAME.csv", str(file))
        output_folder.claim(file.parent, (file.name,), overwrite)
    checks = chosen.check()
    runtime.init(device, precision, threads, arithmetic)
    table = plain_table("check", "measured", "expected", "off by", "allowed", "")
    done: list[Check | Claim | Shown] = []
    try:
        with err().status("checking") as status:
            for item in checks:
                done.append(item)
                table.add_row(item.name, *item.cells, Text(VERDICTS[_ok(item)], VERDICT_STYLES[_ok(item)]))
                status.update(f"checked: {item.name}")
                if not err().is_terminal:
                    err().print(f"checked: {item.name}")
    finally:
        # Also if a later check fails or is interrupted.
        if done:
            out().print(table)
    if file is not None:
        replace_file(file, _csv(chosen.name, done).encode())
    outcomes = [_ok(item) for item in done]
    failed, passed = outcomes.count(False), outcomes.count(True)
    if failed:
        raise RunError(f"{failed} of {failed + passed} checks failed")


def _ok(item: Check | Claim | Shown) -> bool | None:
    """Return the verdict; None for a value that is only shown."""
    return None if item.ok is None else bool(item.ok)


def _csv(case: str, items: Iterable[Check | Claim | Shown]) -> str:
    """Return the table of a case as CSV."""
    from tisim.cases.common.csv_tables import csv_text

    made = (
        __version__,
        PHYSICS_VERSION,
        processor().get("model name", "unknown"),
        datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
    )
    rows = []
    for item in items:
        number, expected, allowed = item.number, item.cells[1], item.cells[3]
        value, half = (number.value, number.half) if isinstance(number, Mean) else (float(number), "")
        rows.append((case, item.name, value, half, expected, allowed, VERDICTS[_ok(item)], *made))
    return csv_text([CSV_COLUMNS, *rows])
