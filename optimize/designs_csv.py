"""Designs given by the user as rows of a CSV file or as dictionaries: genes and values by heading.

The headings are the same as in best.csv, met.csv and ``Outcome.to_frame``, so these files can be used as
input; the unit in the heading of a gene or an objective may be omitted.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tisim.errors import InputError, is_number, must
from tisim.files import regular_file
from tisim.optimize.problem.gene_values import Named
from tisim.optimize.problem.given_genes import FixedGene
from tisim.optimize.problem.problem import Problem
from tisim.optimize.tables import ERROR, FEASIBLE, FRESH_STARTS, HIGH, LOW

MOST_ROWS = 10_000
"""The largest number of designs that are read from a file."""
GENERATION, WHETHER_ASKED = "generation", "asked"
"""Headings of the additional columns in the file of an ask-and-tell campaign."""
COUNTS = ("rank", "front", FEASIBLE, "starts", "converged", "failed", GENERATION, WHETHER_ASKED)
"""Headings of further columns in result files, which are ignored."""
Row = tuple[str, Mapping[str, str]]
"""The position of a row, in words, and its cells by heading."""
Given = str | Path | Sequence[Mapping[str, Any]]
"""A CSV file, or its rows as dictionaries."""


def rows(given: Given, what: str) -> list[Row]:
    """Return the rows of a file, or the given rows; ``what`` names them in messages.

    InputError for no rows or too many, and for a file that is not a table with a heading.
    """
    if isinstance(given, str | Path):
        found = _of_file(Path(given))
    else:
        listed = isinstance(given, Sequence) and all(isinstance(row, Mapping) for row in given)
        must(listed, what, "a CSV file, or a list of dictionaries", given)
        found = [
            (f"{what} {k}", {str(head): _text(cell) for head, cell in row.items()})
            for k, row in enumerate(given, start=1)
        ]
    must(0 < len(found) <= MOST_ROWS, what, f"one design or more, and {MOST_ROWS} at most", len(found))
    return found


def check_headings(problem: Problem, row: Mapping[str, str]) -> None:
    """Raise InputError for a column that belongs neither to the problem nor to a result file, such as a
    misspelt gene or a gene with another unit."""
    known = set(_headings(problem))
    for head in row:
        # The heading of a constraint contains its bound, which may have been different.
        of_constraint = head.partition(",")[0] in {constraint.name for constraint in problem.constraints}
        labels = ", ".join(gene.label for gene in problem.genome.genes)
        rule = f"a gene ({labels}) or a heading of best.csv"
        must(head.removesuffix(FRESH_STARTS) in known or of_constraint, f"column {head}", rule, head)


def design_of(problem: Problem, row: Mapping[str, str]) -> dict[str, Any]:
    """Return the values of the searched genes of a row, within their ranges.

    InputError for one that is missing or out of its range, and if a fixed gene has another value.
    """
    genome = problem.genome
    for gene in genome.genes:
        if isinstance(gene, FixedGene) and (cell := cell_of(gene, row)) is not None:
            must(_is(gene.value, cell), f"gene {gene.name}", gene.described, cell)
    design = genome.decode(genome.encode(genome.parse(row)))
    return {gene.name: design[gene.name] for gene in genome.searched}


def designs(given: Given, problem: Problem, what: str = "starting designs") -> tuple[dict[str, Any], ...]:
    """Return the different designs of a file or of rows, the values of the searched genes by name, in order.

    InputError as in ``rows``, ``check_headings`` and ``design_of``, naming the row.
    """
    found: dict[tuple[Any, ...], dict[str, Any]] = {}
    for place, row in rows(given, what):
        with naming(place):
            check_headings(problem, row)
            design = design_of(problem, row)
            found.setdefault(tuple(design.values()), design)
    return tuple(found.values())


def cell_of(named: Named | Any, row: Mapping[str, str]) -> str | None:
    """Return the cell below the label or the name of a gene, an objective or a constraint; None without that
    column."""
    return row.get(named.label, row.get(named.name))


@contextmanager
def naming(place: str) -> Iterator[None]:
    """Add this place to the message of an InputError within the context."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error}") from None


def _headings(problem: Problem) -> Iterator[str]:
    """Yield the headings that a table of designs of a problem may have."""
    yield from (*COUNTS, ERROR, LOW, HIGH, *problem.derived)
    for named in (*problem.genome.genes, *problem.objectives, *problem.constraints):
        yield from (named.label, named.name)
    names = [one.name for one in problem.objectives] + [one.name for one in problem.constraints]
    for name in names:
        yield from (f"{name} {end}" for end in (ERROR, LOW, HIGH))


def _of_file(path: Path) -> list[Row]:
    other = regular_file.irregular(path)
    must(other is None, "designs", "a CSV file that can be read", f"{path}, which is {other}")
    try:
        text = path.read_bytes().decode("utf-8-sig")
        reader = csv.reader(io.StringIO(text, newline=""), strict=True)
        lines = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} must be a CSV file that can be read; received {error}") from None
    lines = [(number, row) for number, row in lines if any(row)]
    must(len(lines) > 1, str(path), "a CSV file of a heading and one design or more", text[:40])
    (_, heading), *others = lines
    twice = [head for head in heading if heading.count(head) > 1]
    must(not twice, f"headings of {path}", "all different", heading)
    for number, row in others:
        must(len(row) == len(heading), f"{path}, line {number}", f"{len(heading)} cells", row)
    return [(f"{path}, line {number}", dict(zip(heading, row, strict=True))) for number, row in others]


def _text(cell: Any) -> str:
    return "" if cell is None else str(cell)


def _is(value: Any, cell: str) -> bool:
    """Return whether a cell contains this value."""
    if cell == str(value):
        return True
    try:
        return is_number(value) and float(cell) == value
    except ValueError:
        return False
