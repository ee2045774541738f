"""The command ``tisim effects`` lists and explains the parts of which a scene is made."""

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
        help="A part to show in full, such as impact; or a category to list: operators, pair. "
        "Without a name, list all.",
    ),
]
LEAST_WIDTH = 20
"""The description of a part gets at least this many characters of its line on any terminal."""


def effects(name: Name = None, plugins: Plugins = None) -> None:
    """List all effects, steppers and other parts, or explain one."""
    from tisim.describe import reference

    groups = reference.groups()
    if name is None:
        _print_list(reference.entries())
        print(f"'tisim effects NAME' explains one, or lists a category: {', '.join(groups)}.")
        return
    # If a category has the name of its first law, such as impact, the law is explained and the category is
    # listed.
    if name not in groups or name in reference.names():
        out().print(_describe(reference.find(name)))
    if name in groups:
        _print_list(groups[name])


def _print_list(entries: Sequence[Entry]) -> None:
    """Print one line for each entry, family by family, cut to the width of a terminal but complete in a
    file."""
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
    """Return the words of a text that fit into a width; words and numbers are not cut."""
    return shorten(text, max(width, LEAST_WIDTH), placeholder=" ...")


def _fitted(body: str, width: int) -> str:
    """Return the paragraphs of a docstring in lines of at most ``width`` characters; equations that fit keep
    their lines."""
    paragraphs = []
    for paragraph in body.split("\n\n"):
        if paragraph.startswith("    "):
            paragraphs += ["\n".join(_fitted_equation(line, width) for line in paragraph.splitlines())]
        else:
            paragraphs += [fill(paragraph, width)]
    return "\n\n".join(paragraphs)


def _fitted_equation(line: str, width: int) -> str:
    """Return a line of equations; a line that is too long is broken between equations, or else between
    words."""
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
    """Return the complete reference entry."""
    heading = Text.assemble((entry.name, "bold"), f"  {entry.kind.__module__}.{entry.kind.__name__}")
    lines: list[RenderableType] = [heading, "", f"{entry.summary}.", ""]
    lines += [_fitted(entry.body, out().width), ""] if entry.body else []
    references = [f"Source: {entry.source}", *(f"    {work}" for work in entry.publications()), ""]
    lines += references if entry.source else []
    if entry.settings:
        table = plain_table("parameter", "unit", "default", "must be", "description")
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
