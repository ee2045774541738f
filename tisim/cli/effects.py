"""The command ``tisim effects`` lists and explains what a scene can be made of."""

from __future__ import annotations

import re
from collections.abc import Sequence
from textwrap import fill, shorten
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Group, RenderableType
from rich.text import Text

from tisim.cli.options import Plugins
from tisim.console import out, plain_table

if TYPE_CHECKING:
    from tisim.describe.reference import Entry

Name = Annotated[
    str | None,
    typer.Argument(
        metavar="NAME",
        help="One of them, in full: impact. Or a category, with a line for each of its members: operators, "
        "pair. "
        "All, without.",
    ),
]
LEAST_WIDTH = 20
"""So much of what a part is stands in its line on any terminal, characters."""


def effects(name: Name = None, plugins: Plugins = None) -> None:
    """List effects, sources, operators, steppers, step controls, placements and others, or explain one."""
    from tisim.describe import reference

    groups = reference.groups()
    if name is None:
        _print_list(reference.entries())
        print(f"'tisim effects NAME' explains one, or lists a category: {', '.join(groups)}.")
        return
    # A category may have the name of its first law, such as impact: that is explained, and others are listed.
    if name not in groups or name in reference.names():
        out().print(_describe(reference.find(name)))
    if name in groups:
        _print_list(groups[name])


def _print_list(entries: Sequence[Entry]) -> None:
    """Print a line for each entry, family by family: whole into a file, as much as fits on a terminal."""
    from tisim.describe.reference import FAMILIES

    width = out().width if out().is_terminal else None
    columns = [max(map(len, column)) for column in zip(*map(_names, entries), strict=True)]
    for family in dict.fromkeys(entry.family for entry in entries):
        out().print(Text(FAMILIES[family].title, "bold"))
        for entry in entries:
            if entry.family == family:
                names = "  ".join(f"{name:<{n}}" for name, n in zip(_names(entry), columns, strict=True))
                text = "  ".join(filter(None, (entry.summary, entry.source)))
                print(names, text if width is None else _fitting(text, width - len(names) - 2), sep="  ")
        print()


def _fitting(text: str, width: int) -> str:
    """Return as many words of a text as fit, with no number cut."""
    return shorten(text, max(width, LEAST_WIDTH), placeholder=" ...")


def _fitted(body: str, width: int) -> str:
    """Return the paragraphs of a docstring in lines of at most so many characters, equations as they stand
    where they fit."""
    paragraphs = []
    for paragraph in body.split("\n\n"):
        if paragraph.startswith("    "):
            paragraphs += ["\n".join(_fitted_equation(line, width) for line in paragraph.splitlines())]
        else:
            paragraphs += [fill(paragraph, width)]
    return "\n\n".join(paragraphs)


def _fitted_equation(line: str, width: int) -> str:
    """Return a line of equations; one that is too long is broken between them, or else between words."""
    if len(line) <= width:
        return line
    lines = ["  "]
    for equation in re.split(" {2,}", line.strip()):
        if lines[-1].strip() and len(lines[-1]) + 2 + len(equation) > width:
            lines.append("      ")
        lines[-1] += f"  {equation}"
    return "\n".join(fill(one, width, subsequent_indent=" " * 8) for one in lines)


def _names(entry: Entry) -> tuple[str, str]:
    return entry.name, entry.kind.__name__


def _describe(entry: Entry) -> RenderableType:
    """Return all that the reference has of one entry."""
    heading = Text.assemble((entry.name, "bold"), f"  {entry.kind.__module__}.{entry.kind.__name__}")
    lines: list[RenderableType] = [heading, "", f"{entry.summary}.", ""]
    lines += [_fitted(entry.body, out().width), ""] if entry.body else []
    references = [f"Source: {entry.source}", *(f"    {work}" for work in entry.publications()), ""]
    lines += references if entry.source else []
    if entry.settings:
        table = plain_table("parameter", "unit", "default", "must be", "what it is")
        for setting in entry.settings:
            table.add_row(
                setting.name, setting.unit, setting.default or "(required)", setting.rule, setting.text
            )
        lines += [table, ""]
    facts = {
        "needs": "; ".join(entry.needs),
        "particle fields": ", ".join(f"{name} ({unit})" if unit else name for name, unit in entry.fields),
        "counts and measures": ", ".join(entry.gives),
    }
    lines += [f"{what}: {text}" for what, text in facts.items() if text]
    return Group(*lines, *(["", "In a scene file:", "", entry.toml] if entry.toml else []))
