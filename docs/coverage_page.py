"""Makes docs/coverage.md, which equations and figures of the five publications tisim has, row by row, and
docs/coverage_tests.md, their code and tests.

    python docs/coverage_page.py    writes the pages anew
    tisim check CASE --out docs/coverage/CASE.csv --overwrite    takes the numbers of a case anew

The rows are in docs/coverage/PUBLICATION.toml (coverage_rows.py). Numbers come from docs/coverage/CASE.csv,
which ``tisim check`` writes, or are quoted from a page, on which the same text must stand
(coverage_faults.py).
"""

from __future__ import annotations

import sys
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence

from coverage_faults import faults
from coverage_rows import DOCS, STATUS, Publication, Row, headings, measured, number, publications, slug

INTRODUCTION = """
To see which parts of a publication run in tisim, go to its table. Each row is an equation, a figure or a section, in
the order of the publication, with its status, the number here, the published number, the page that explains it, the
parts of a scene that do it, and a command that runs it. The [code and the tests](coverage_tests.md) of each row are
on another page.
"""  # noqa: E501
MEANING = """
*Works*: it is used in a scene, and confirmed by a test or a check. *In part*: only some of it, or at another size, or a
conclusion of the source is not reached; the row says which. *Left out*: it is not in tisim; the row gives the reason. {laboratory} rows are laboratory work. Of the other {others} rows, {whole} work.
"""  # noqa: E501
NUMBERS = r"""
± is half of a 95 % interval. Numbers with a star \* were printed by `tisim check` (physics version {physics},
{processor}, {date}; `docs/coverage`). The others are quoted from the page in the last column.
"""
TESTS = """
For each row of the [coverage of the publications](coverage.md) that works, or works in part, this page has the files of
its code and its tests. `python -m pytest -n 0 TEST` runs a test in the repository, with `-m slow` if it takes long.
Names without a folder are parts of a scene.
"""  # noqa: E501


def page() -> str:
    """Return the text of docs/coverage.md."""
    return "\n".join(_page(publications())).rstrip() + "\n"


def _page(works: Sequence[Publication]) -> Iterator[str]:
    rows = [row for work in works for row in work.rows]
    others = [row for row in rows if not row.laboratory]
    yield from ("# Coverage of the publications", "", *_paragraph(INTRODUCTION))
    counts = [(f"[{work.name}](#{slug(_heading(work))})", *_cells(work.rows)) for work in works]
    yield from _table(("publication", *STATUS.values(), "rows"), [*counts, ("all", *_cells(rows))])
    yield from _paragraph(
        MEANING.format(
            laboratory=sum(row.laboratory for row in rows),
            others=len(others),
            whole=sum(row.status == "works" for row in others),
        )
    )
    made = {
        key: ", ".join(sorted({line[key] for line in measured().values()}))
        for key in ("physics", "processor", "date")
    }
    yield from _paragraph(NUMBERS.format(**made))
    for work in works:
        yield from _publication(work)


def _paragraph(text: str) -> Iterator[str]:
    yield from (*textwrap.wrap(" ".join(text.split()), 120, break_on_hyphens=False), "")


def _cells(rows: Sequence[Row]) -> tuple[str, ...]:
    counts = Counter(row.status for row in rows)
    return tuple(str(one) for one in (*(counts[name] for name in STATUS), counts.total()))


def _heading(work: Publication) -> str:
    return f"{work.name}: {work.about}"


def _publication(work: Publication) -> Iterator[str]:
    yield from (f"## {_heading(work)}", "", *_paragraph(f"{work.title}."))
    head = (work.name, "subject", "status", "number here, and *published*", "read, use, run")
    rows = []
    for row in work.rows:
        subject = f"{row.title}. {row.reason}" if row.reason else row.title
        numbers = "; ".join(_numbers(row))
        beside = f"*published: {row.published}*" if row.published else ""
        both = "<br>".join(filter(None, (numbers, beside)))
        rows.append((row.source, subject, STATUS[row.status], both, _place(row)))
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
    lines += [f"{{ref}}`{name}`" for name in row.parts]
    lines.append(f"`{row.command}`" if row.command else "")
    return "<br>".join(filter(None, lines))


def _title(page: str) -> str:
    """The heading of a section; of a whole page, the name of its file."""
    file, _, anchor = page.partition("#")
    name = file.removesuffix(".md")
    return next((one for one in headings(DOCS / file) if slug(one) == anchor), name) if anchor else name


def tests_page() -> str:
    """Return the text of docs/coverage_tests.md."""
    return "\n".join(_tests_page(publications())).rstrip() + "\n"


def _tests_page(works: Sequence[Publication]) -> Iterator[str]:
    yield from ("# Code and tests behind the coverage", "")
    yield from _paragraph(TESTS)
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


PAGES = {"coverage.md": page, "coverage_tests.md": tests_page}
"""The functions that make the text of each page."""

if __name__ == "__main__":
    if found := list(faults(publications())):
        print(*found, sep="\n")
        sys.exit(1)
    for name, make in PAGES.items():
        (DOCS / name).write_text(make(), encoding="utf-8")
