"""The rows of the coverage of publications, from docs/coverage/PUBLICATION.toml, and the numbers of
docs/coverage/CASE.csv, which ``tisim check`` writes."""

from __future__ import annotations

import csv
import re
import tomllib
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from tisim.analysis import Mean

DOCS = Path(__file__).parent
FOLDER = DOCS / "coverage"
ORDER = ("z04", "z13", "z16", "l21", "b16")
"""Files of the publications, in the order of the page."""
SMALL = 1e-4
"""Numbers below this are printed with two digits."""
STATUS = {"works": "works", "part": "in part", "out": "left out"}
"""The status of a row in a file, and on the page."""


@dataclass(frozen=True)
class Row:
    """An equation, figure or section of a publication.

    source, title : as in the publication. status : a key of STATUS. page : PAGE.md#SECTION, or PAGE.md.
    parts : names of effects and other parts of a scene. code : paths from the root of the repository.
    tests : FILE::TEST below tests/. checks : tables with ``case``, ``check``, and ``text``, in which {} is
    the number that the check measures. here : numbers, as they are written on ``page``. published : the
    number in the publication. command : prints the numbers or draws the figure. reason : why a row is in part
    or left out, or how it differs.
    laboratory : it is no simulation.
    """

    source: str
    title: str
    status: str
    page: str = ""
    parts: tuple[str, ...] = ()
    code: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()
    checks: tuple[dict[str, str], ...] = ()
    here: tuple[str, ...] = ()
    published: str = ""
    command: str = ""
    reason: str = ""
    laboratory: bool = False

    @classmethod
    def of(cls, table: dict[str, Any]) -> Row:
        """Return the row of a table; lists become tuples."""
        return cls(**{key: tuple(one) if isinstance(one, list) else one for key, one in table.items()})


@dataclass(frozen=True)
class Publication:
    """A publication. name : its short name in tisim. title : author, title and year. about : one sentence."""

    name: str
    title: str
    about: str
    rows: tuple[Row, ...] = field(repr=False)


def publications(folder: Path = FOLDER) -> list[Publication]:
    """Return the publications with their rows."""
    found = []
    for name in ORDER:
        table = tomllib.loads((folder / f"{name}.toml").read_text(encoding="utf-8"))
        rows = tuple(map(Row.of, table.pop("row")))
        found.append(Publication(rows=rows, **table))
    return found


@cache
def measured(folder: Path = FOLDER) -> dict[tuple[str, str], dict[str, str]]:
    """Return the lines of the files of ``tisim check``, by case and name of the check."""
    lines = {}
    for path in sorted(folder.glob("*.csv")):
        with path.open(newline="", encoding="utf-8") as file:
            lines |= {(line["case"], line["check"]): line for line in csv.DictReader(file)}
    return lines


def number(line: dict[str, str]) -> str:
    """Return the measured number of a check as text, with its interval if it has one."""
    value = float(line["measured"])
    if line["half_interval"]:
        return str(Mean(value, float(line["half_interval"])))
    # Of an error the first digits are enough.
    return f"{value:.2g}" if abs(value) < SMALL else f"{value:.5g}"


def slug(heading: str) -> str:
    """Return the anchor of a heading, as Sphinx and GitHub make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def headings(path: Path) -> list[str]:
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    return re.findall(r"^#{1,3} (.+)$", text, re.M)
