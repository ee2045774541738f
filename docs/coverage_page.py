"""Makes docs/coverage.md, which equations and figures of the five publications tisim has, row by row, and
docs/coverage_tests.md, their code and tests.

    python docs/coverage_page.py    writes the pages anew
    tisim check CASE --out docs/coverage/CASE.csv --overwrite    takes the numbers of a case anew

The rows are in docs/coverage/PUBLICATION.toml. Numbers come from docs/coverage/CASE.csv, which ``tisim check``
writes, or are quoted from a page, on which the same text must stand (``faults``).
"""

from __future__ import annotations

import ast
import csv
import importlib.util
import re
import shlex
import sys
import textwrap
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import typer

from tisim.analysis import Mean
from tisim.cases.case import every
from tisim.cli.main import app
from tisim.cli.usage import UsageError
from tisim.describe import reference
from tisim.errors import InputError

DOCS = Path(__file__).parent
ROOT = DOCS.parent
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
    or left out, or how it differs. later : it belongs to a part of a publication that is not built yet.
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
    later: bool = False
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

    def counts(self) -> Counter[str]:
        """Return the number of rows of each status."""
        return Counter(row.status for row in self.rows)


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


def page() -> str:
    """Return the text of docs/coverage.md."""
    return "\n".join(_page(publications())).rstrip() + "\n"


def _page(works: Sequence[Publication]) -> Iterator[str]:
    rows = [row for work in works for row in work.rows]
    yield from ("# Coverage of the publications", "")
    yield from _paragraph(
        "To see which parts of a publication run in tisim, go to its table. Each row is an equation, a figure or "
        "a section, in the order of the publication, with its status, the number here, the published number, the "
        "page that explains it, the parts of a scene that do it, and a command that runs it. The [code and the "
        "tests](coverage_tests.md) of each row are on another page."
    )
    yield from ("| publication | works | in part | left out | rows |", "|---|---|---|---|---|")
    for work in works:
        yield f"| [{work.name}](#{slug(_heading(work))}) | {_cells(work.counts())} |"
    yield from (f"| all | {_cells(Counter(row.status for row in rows))} |", "")
    yield from _paragraph(_meaning(rows))
    lines = measured().values()
    dates, processors, versions = (
        sorted({line[key] for line in lines}) for key in ("date", "processor", "physics")
    )
    yield from _paragraph(
        rf"± is half of a 95 % interval. Numbers with a star \* were printed by `tisim check` (physics version "
        f"{', '.join(versions)}, {', '.join(processors)}, {' to '.join(dict.fromkeys((dates[0], dates[-1])))}; "
        "`docs/coverage`). The others are quoted from the page in the last column."
    )
    for work in works:
        yield from _publication(work)


def _meaning(rows: Sequence[Row]) -> str:
    later, laboratory = (sum(getattr(row, name) for row in rows) for name in ("later", "laboratory"))
    others = [row for row in rows if not (row.later or row.laboratory)]
    whole = sum(row.status == "works" for row in others)
    return (
        "*Works*: it is used in a scene, and a test or a check holds it. *In part*: some of it, or another size, "
        "or without a conclusion of the source; the row says which. *Left out*: not there, with the reason. "
        f"{later} rows belong to two parts of B16 that are not built yet: random packings (chapters 1 to 4) and "
        f"the filter of packed fibres (chapter 7). {laboratory} rows are laboratory work. Of the other "
        f"{len(others)} rows, {whole} work."
    )


def _paragraph(text: str) -> Iterator[str]:
    yield from (*textwrap.wrap(text, 120, break_on_hyphens=False), "")


def _cells(counts: Counter[str]) -> str:
    return " | ".join(str(one) for one in (*(counts[name] for name in STATUS), counts.total()))


def _heading(work: Publication) -> str:
    return f"{work.name}: {work.about}"


def _publication(work: Publication) -> Iterator[str]:
    yield from (f"## {_heading(work)}", "", *_paragraph(f"{work.title}."))
    head = (work.name, "subject", "status", "number here", "published", "read, use, run")
    rows = []
    for row in work.rows:
        subject = f"{row.title}. {row.reason}" if row.reason else row.title
        numbers = "; ".join(_numbers(row))
        rows.append((row.source, subject, STATUS[row.status], numbers, row.published, _place(row)))
    yield from _table(head, rows)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield from (f"| {' | '.join(head)} |", "|---" * len(head) + "|")
    yield from (f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in rows)
    yield ""


def _numbers(row: Row) -> Iterator[str]:
    for one in row.checks:
        if line := measured().get((one["case"], one["check"])):
            yield one.get("text", "{}").format(number(line)) + r"\*"
    yield from row.here


def _place(row: Row) -> str:
    """The page, the parts of a scene and the command of a row."""
    lines = [f"[{_title(row.page)}]({row.page})" if row.page else ""]
    lines.append(", ".join(f"{{ref}}`{name}`" for name in row.parts))
    lines.append(f"`{row.command}`" if row.command else "")
    return "<br>".join(filter(None, lines))


def _title(page: str) -> str:
    """The heading of a section; of a whole page, the name of its file."""
    file, _, anchor = page.partition("#")
    name = file.removesuffix(".md")
    return next((one for one in _headings(DOCS / file) if slug(one) == anchor), name) if anchor else name


def tests_page() -> str:
    """Return the text of docs/coverage_tests.md."""
    return "\n".join(_tests_page(publications())).rstrip() + "\n"


def _tests_page(works: Sequence[Publication]) -> Iterator[str]:
    yield from ("# Code and tests behind the coverage", "")
    yield from _paragraph(
        "For each row of the [coverage of the publications](coverage.md) that works, or works in part, this page "
        "has the files of its code and its tests. `python -m pytest -n 0 TEST` runs a test in the repository, "
        "with `-m slow` if it takes long. Names without a folder are parts of a scene."
    )
    for work in works:
        yield from (f"## {work.name}", "")
        head = (work.name, "parts and files", "tests")
        rows = []
        for row in work.rows:
            files = (*(f"{{ref}}`{name}`" for name in row.parts), *(f"`{path}`" for path in row.code))
            tests = [f"`tests/{one}`" for one in row.tests]
            if files or tests:
                rows.append((row.source, "<br>".join(files), "<br>".join(tests)))
        yield from _table(head, rows)


def slug(heading: str) -> str:
    """Return the anchor of a heading, as Sphinx and GitHub make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _headings(path: Path) -> list[str]:
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    return re.findall(r"^#{1,3} (.+)$", text, re.M)


def faults(works: Sequence[Publication]) -> Iterator[str]:
    """Yield a line for each row that names something that does not exist, or lacks what its status asks
    for."""
    for work in works:
        for row in work.rows:
            for fault in (*_incomplete(row), *_missing(row)):
                yield f"{work.name} {row.source}: {fault}"


def _incomplete(row: Row) -> Iterator[str]:
    if row.status not in STATUS:
        yield f"status must be one of {', '.join(STATUS)}; received {row.status!r}"
    if row.status != "works" and not row.reason:
        yield "has no reason"
    if row.status == "works" and not (row.tests or row.checks):
        yield "has no test or check"
    if row.status != "out" and not (row.page or row.parts or row.code):
        yield "has no place"
    if row.here and not row.page:
        yield "has numbers, but no page on which they stand"
    if row.title.endswith("."):
        yield "the title ends with a full stop"


def _missing(row: Row) -> Iterator[str]:
    file, _, anchor = row.page.partition("#")
    if row.page and not (DOCS / file).is_file():
        yield f"there is no page {file}"
    elif row.page:
        if anchor and anchor not in map(slug, _headings(DOCS / file)):
            yield f"there is no section {row.page}"
        text = " ".join((DOCS / file).read_text(encoding="utf-8").split())
        yield from (f"{one!r} is not on {file}" for one in row.here if one not in text)
    names = {entry.name for entry in reference.entries()}
    yield from (f"there is no part {name}" for name in row.parts if name not in names)
    yield from (f"there is no {path}" for path in row.code if not (ROOT / path).exists())
    for one in row.tests:
        path, _, name = one.partition("::")
        if name not in _tests(ROOT / "tests" / path):
            yield f"there is no test {one}"
    for one in row.checks:
        line = measured().get((one["case"], one["check"]))
        if line is None:
            yield f"there is no check {one['check']!r} of {one['case']}"
        elif line["verdict"] == "FAIL":
            yield f"the check {one['check']!r} of {one['case']} fails"
    if row.command and (fault := command_fault(row.command)):
        yield f"{row.command}: {fault}"


@cache
def _tests(path: Path) -> frozenset[str]:
    """The names of the tests of a file, without importing it."""
    if not path.is_file():
        return frozenset()
    body = ast.parse(path.read_text(encoding="utf-8")).body
    return frozenset(
        one.name for one in body if isinstance(one, ast.FunctionDef) and one.name.startswith("test_")
    )


def command_fault(command: str) -> str:
    """Return why a command could not be run; empty if it could.

    A tisim command is read by the parser of the command line; the case and its size are looked up. Of a
    script or module, the file is found, and each option in its text.
    """
    program, *words = shlex.split(command)
    if program == "tisim":
        return _cli_fault(words)
    if program != "python" or not words:
        return "must begin with tisim or python"
    if words[0] == "-m":
        spec = importlib.util.find_spec(words[1])
        path, words = Path(spec.origin) if spec and spec.origin else Path(words[1]), words[2:]
    else:
        path, words = ROOT / words[0], words[1:]
    if not path.is_file():
        return f"there is no {path}"
    text = path.read_text(encoding="utf-8")
    return next((f"{path.name} has no {word}" for word in words if word[:2] == "--" and word not in text), "")


def _cli_fault(words: list[str]) -> str:
    group = typer.main.get_command(app)
    try:
        context = group.make_context("tisim", [words[0], "--help"], resilient_parsing=True)
        one = group.get_command(context, words[0])  # type: ignore[attr-defined]
        if one is None:
            return f"there is no command {words[0]}"
        values = one.make_context(words[0], words[1:], parent=context).params
    except (UsageError, InputError, typer.Exit) as error:
        return str(error) or "it is not accepted"
    case = every().get(values.get("case") or values.get("target") or "")
    if words[0] in ("run", "check", "figures", "optimize", "cost", "compare", "explain") and case is None:
        return "there is no such case"
    if case is not None and (values.get("size") or "default") not in case.sizes:
        return f"{case.name} has no size {values['size']}"
    variants = {*case.variants, *case.scenes} if case is not None else set()
    if values.get("variant") and values["variant"] not in variants:
        return f"there is no variant {values['variant']}"
    if words[0] == "figures" and case is not None and case.figures is None:
        return f"{case.name} has no figures"
    return ""


PAGES = {"coverage.md": page, "coverage_tests.md": tests_page}
"""The functions that make the text of each page."""

if __name__ == "__main__":
    if found := list(faults(publications())):
        print(*found, sep="\n")
        sys.exit(1)
    for name, make in PAGES.items():
        (DOCS / name).write_text(make(), encoding="utf-8")
