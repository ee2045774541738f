"""The command ``tisim effects`` lists and explains what a scene can be made of."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Group, RenderableType
from rich.text import Text

from tisim.cli.options import Plugins
from tisim.console import out, plain_table

Name = Annotated[
    str | None,
    typer.Argument(metavar="NAME", help="One of them, in full: impact; all, a line each, without."),
]


def effects(name: Name = None, plugins: Plugins = None) -> None:
    """List effects, sources, operators, steppers, step controls, placements and others, or explain one."""
    from tisim.engine import reference

    out().print(_list_families(reference) if name is None else _describe(reference.find(name)))


def _list_families(reference) -> RenderableType:
    """Return a table with a line for each entry, family by family."""
    lines: list[RenderableType] = []
    entries = reference.entries()
    for name, family in reference.FAMILIES.items():
        table = plain_table("name", "class", "what it is", "source")
        for entry in entries:
            if entry.family == name:
                table.add_row(entry.name, entry.kind.__name__, entry.summary, entry.source)
        lines += [Text(family.title, "bold"), table, ""]
    return Group(*lines, "'tisim effects NAME' explains one.")


def _describe(entry) -> RenderableType:
    """Return all that the reference has of one entry."""
    heading = Text.assemble((entry.name, "bold"), f"  {entry.kind.__module__}.{entry.kind.__name__}")
    lines: list[RenderableType] = [heading, "", f"{entry.summary}.", ""]
    lines += [entry.body, ""] if entry.body else []
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
