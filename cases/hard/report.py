"""The numbers of hard cases as files: hard_cases.csv, hard_cases.h5 and a table for the documentation.

hard_cases.h5: the arrays ``family``, ``case``, ``quantity``, ``number``, ``least``, ``most`` and ``ok`` have
a row for each number, in the order of hard_cases.csv. The attributes hold the settings of the run, the
processor, the date and the versions.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tisim.backend import runtime
from tisim.backend.processor import processor
from tisim.cases.hard.hard_case import HardCase, Measured, title
from tisim.files import checksum, output_folder
from tisim.files.atomic import replace_file
from tisim.io.run_folder import versions

HARD_FORMAT = "tisim hard 1"
HARD_CSV, HARD_HDF5, HARD_TABLE = "hard_cases.csv", "hard_cases.h5", "hard_cases.md"
HARD_FILES = (HARD_CSV, HARD_HDF5, HARD_TABLE, output_folder.LOCK)
_COLUMNS = ("family", "case", "quantity", "number", "least", "most", "ok")


@dataclass(frozen=True)
class Finished:
    """A hard case that has been run, with its numbers and its processor time (s), compilation included."""

    case: HardCase
    outcomes: Sequence[Measured]
    seconds: float


def _rows(finished: Sequence[Finished]) -> list[tuple[Any, ...]]:
    return [
        (one.case.family, one.case.name, o.bound.quantity, o.number, o.bound.least, o.bound.most, o.ok)
        for one in finished
        for o in one.outcomes
    ]


def write(finished: Sequence[Finished], folder: Path) -> list[Path]:
    """Write the three files into a folder, created if missing; return their paths. RunError if the disk is
    full."""
    output_folder.ensure_writable(folder)
    text = io.StringIO(newline="")
    csv.writer(text).writerows([_COLUMNS, *_rows(finished)])
    replace_file(folder / HARD_CSV, text.getvalue().encode())
    with checksum.create_file(folder / HARD_HDF5) as file:
        file.attrs.update({
            "format": HARD_FORMAT, "settings": json.dumps(runtime.current().described),
            "versions": json.dumps(versions()), "machine": machine(), "date": _today(),
        })  # fmt: skip
        for name, values in zip(_COLUMNS, zip(*_rows(finished), strict=True), strict=True):
            kind = h5py.string_dtype() if isinstance(values[0], str) else None
            file[name] = np.array(values, dtype=kind)
    replace_file(folder / HARD_TABLE, markdown(finished).encode())
    return [folder / name for name in HARD_FILES[:3]]


def machine() -> str:
    """Return the name of the processor."""
    return processor().get("model name", "unknown processor")


def _today() -> str:
    return datetime.now(UTC).date().isoformat()


def markdown(finished: Sequence[Finished]) -> str:
    """Return a table of the numbers beside their bounds for each family, as Markdown."""
    numbers = sum(len(one.outcomes) for one in finished)
    seconds = sum(one.seconds for one in finished)
    settings = ", ".join(f"{key} {value}" for key, value in runtime.current().described.items())
    lines = [
        f"{len(finished)} cases, {numbers} numbers, {seconds:.0f} s of processor time with compilation; "
        f"{_today()}, {machine()}; {settings}."
    ]
    for family in dict.fromkeys(one.case.family for one in finished):
        lines += ["", f"### {title(family)}", "", "| case and number | measured | bound |", "|---|---|---|"]
        for one in finished:
            if one.case.family == family:
                lines.append(f"| **{one.case.name}** {one.case.difficulty} | | |")
                lines += [
                    f"| {o.bound.quantity} | {o.measured}{'' if o.ok else ' FAIL'} | {o.bound.allowed} |"
                    for o in one.outcomes
                ]
    return "\n".join(lines) + "\n"
