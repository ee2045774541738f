"""Faults of the rows of the coverage of publications: names of things that do not exist, and rows that lack
the reason, the test or the place that their status asks for."""

from __future__ import annotations

import ast
import importlib.util
import shlex
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import coverage_rows
import typer
from coverage_rows import DOCS, STATUS, Publication, Row, headings, slug

from tisim.cases.case import every
from tisim.cli.main import app
from tisim.cli.usage import UsageError
from tisim.describe import reference
from tisim.errors import InputError

ROOT = DOCS.parent
CASE_COMMANDS = ("run", "check", "figures", "optimize", "cost", "compare", "explain")
"""Commands whose first argument is a case."""


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
        if anchor and anchor not in map(slug, headings(DOCS / file)):
            yield f"there is no section {row.page}"
        text = " ".join((DOCS / file).read_text(encoding="utf-8").split())
        yield from (f"{one!r} is not on {file}" for one in row.here if one not in text)
    yield from (f"there is no part {name}" for name in row.parts if name not in _parts())
    yield from (f"there is no {path}" for path in row.code if not (ROOT / path).exists())
    for one in row.tests:
        path, _, name = one.partition("::")
        if name not in _tests(ROOT / "tests" / path):
            yield f"there is no test {one}"
    for one in row.checks:
        line = coverage_rows.measured().get((one["case"], one["check"]))
        if line is None:
            yield f"there is no check {one['check']!r} of {one['case']}"
        elif line["verdict"] == "FAIL":
            yield f"the check {one['check']!r} of {one['case']} fails"
    if row.command and (fault := command_fault(row.command)):
        yield f"{row.command}: {fault}"


@cache
def _parts() -> frozenset[str]:
    """The names of all parts of scenes."""
    return frozenset(entry.name for entry in reference.entries())


@cache
def _tests(path: Path) -> frozenset[str]:
    """The names of the tests of a file, without importing it."""
    if not path.is_file():
        return frozenset()
    body = ast.parse(path.read_text(encoding="utf-8")).body
    return frozenset(
        one.name for one in body if isinstance(one, ast.FunctionDef) and one.name.startswith("test_")
    )


@cache
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
        path = ROOT / f"{words[1].replace('.', '/')}.py"
        if not path.is_file() and (spec := importlib.util.find_spec(words[1])) and spec.origin:
            path = Path(spec.origin)
        words = words[2:]
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
    if words[0] in CASE_COMMANDS and case is None:
        return "there is no such case"
    if case is not None and (values.get("size") or "default") not in case.sizes:
        return f"{case.name} has no size {values['size']}"
    variants = {*case.variants, *case.scenes} if case is not None else set()
    if values.get("variant") and values["variant"] not in variants:
        return f"there is no variant {values['variant']}"
    if words[0] == "figures" and case is not None and case.figures is None:
        return f"{case.name} has no figures"
    return ""
