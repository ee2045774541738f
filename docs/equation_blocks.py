"""Blocks of plain-text equations, from docstrings and guides, become tables of mathematics in the pages.

    python docs/equation_blocks.py    prints the blocks of the reference that stay plain text

A line holds equations with wide gaps between them, and after three spaces or more the next column, such as
the condition of a case. Indented lines go on with the equation above: another case of it, or another side.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from textwrap import dedent
from typing import Any

from equations import content, mathml
from mathml import Unset, tokens

RELATION = re.compile(r"(?:(?<=\s)|^)(?:[=<>~]|<=|>=|\+=)(?=\s)")


def is_equation(text: str) -> bool:
    """Return whether a block without a language is of equations: a symbol is something in each line."""
    try:
        return all(
            (match := RELATION.search(line)) and not _has_words(line[: match.start()])
            for line in text.splitlines()
        )
    except Unset:
        return False


def _has_words(text: str) -> bool:
    return any(token.kind == "word" for token in tokens(text))


def unset(docstrings: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Yield the indented blocks of docstrings, by name, that stay plain text."""
    for name, text in docstrings:
        for paragraph in text.strip("\n").split("\n\n"):
            if paragraph.startswith("    "):
                try:
                    block(paragraph)
                except Unset as error:
                    yield f"{name}: {error}"


def block(text: str) -> str:
    """Return a block of equations as HTML."""
    rows = list(_rows(dedent(text.strip("\n"))))
    if len(rows) == 1 and len(rows[0]) == 1 and isinstance(rows[0][0], str):
        return f'<div class="equations">{_cell(rows[0][0])}</div>\n'
    lines = "".join(f"<tr>{''.join(_columns(row))}</tr>\n" for row in rows)
    return f'<div class="equations"><table>\n{lines}</table></div>\n'


def _rows(text: str) -> Iterator[list[Any]]:
    """The cells of each row. An equation with cases is one cell, the list of the rows of these."""
    waiting: list[list[str]] = []
    for line in text.splitlines():
        cells = re.split(r"(?<![,;\s])\s{3,}(?!\s|[=<>~] |[<>+]= )", line.strip())
        if waiting and line.startswith(" ") and not RELATION.match(line.strip()):
            waiting.append(cells)
            continue
        if waiting:
            yield _joined(waiting)
        waiting = [cells]
    if waiting:
        yield _joined(waiting)


def _joined(rows: list[list[str]]) -> list[Any]:
    return rows[0] if len(rows) == 1 else [rows]


def _columns(row: list[Any]) -> Iterator[str]:
    """The table cells of a row, with the relation of its first equation at the same place in all rows."""
    if not isinstance(row[0], str):
        yield from _cases(row[0])
        return
    first, *others = row
    match = RELATION.search(first)
    if match and not _has_words(first[: match.start()]):
        left = _cell(first[: match.start()]) if match.start() else ""
        yield f'<td class="left">{left}</td><td>{_cell(first[match.start() :])}</td>'
    else:
        yield f'<td colspan="2">{_cell(first)}</td>'
    yield from (f"<td>{_cell(other)}</td>" for other in others)


def _cases(rows: list[list[str]]) -> Iterator[str]:
    """An equation with a brace before its cases."""
    match = RELATION.search(rows[0][0])
    if not match:
        raise Unset(f"cases of {rows[0][0]}")
    name, first = rows[0][0][: match.start()], rows[0][0][match.end() :]
    cases = [[first, *rows[0][1:]], *rows[1:]]
    table = "".join(f"<mtr>{''.join(f'<mtd>{content(cell)}</mtd>' for cell in case)}</mtr>" for case in cases)
    brace = '<mo form="prefix" fence="true" stretchy="true">{</mo>'
    sides = f'<mo form="infix">{match[0]}</mo>{brace}<mtable displaystyle="true">{table}</mtable>'
    yield f'<td class="left">{_cell(name)}</td><td><math displaystyle="true">{sides}</math></td>'


def _cell(text: str) -> str:
    """The equations of a cell, which break into lines between them."""
    return " ".join(mathml(one) for one in re.split(r"(?<=[,;])\s{2,}", text.strip()))


if __name__ == "__main__":
    import reference_pages

    print(*unset(reference_pages.docstrings()), sep="\n")
