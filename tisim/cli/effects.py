"""``tisim effects``: what there is to make a scene of."""

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

    out().print(_index(reference) if name is None else _page(reference.find(name)))


def _index(reference) -> RenderableType:
    """A line for each, family by family."""
    shown: list[RenderableType] = []
    entries = reference.entries()
    for name, family in reference.FAMILIES.items():
        table = plain_table("name", "class", "what it is", "source")
        for entry in entries:
            if entry.family == name:
                table.add_row(entry.name, entry.kind.__name__, entry.summary, entry.source)
        shown += [Text(family.title, "bold"), table, ""]
    return Group(*shown, "'tisim effects NAME' explains one.")


def _page(entry) -> RenderableType:
    """All there is to say of one."""
    head = Text.assemble((entry.name, "bold"), f"  {entry.kind.__module__}.{entry.kind.__name__}")
    shown: list[RenderableType] = [head, "", f"{entry.summary}.", ""]
    shown += [entry.body, ""] if entry.body else []
    cited = [f"Source: {entry.source}", *(f"    {work}" for work in entry.publications()), ""]
    shown += cited if entry.source else []
    if entry.settings:
        table = plain_table("parameter", "unit", "default", "must be", "what it is")
        for one in entry.settings:
            table.add_row(one.name, one.unit, one.default or "(required)", one.rule, one.text)
        shown += [table, ""]
    facts = {
        "needs": "; ".join(entry.needs),
        "particle fields": ", ".join(f"{name} ({unit})" if unit else name for name, unit in entry.fields),
        "counts and measures": ", ".join(entry.gives),
    }
    shown += [f"{what}: {text}" for what, text in facts.items() if text]
    return Group(*shown, *(["", "In a scene file:", "", entry.toml] if entry.toml else []))
