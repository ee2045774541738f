"""Options that commands share, and where they print."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich import progress as bars
from rich.console import Console
from rich.table import Table

Target = Annotated[
    str, typer.Argument(metavar="CASE_OR_TOML", help="A case of 'tisim cases', or a scene file.")
]
CaseName = Annotated[str, typer.Argument(metavar="CASE", help="A case of 'tisim cases'.")]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change a setting: effects.impact.hardness=3e5. Repeatable."
    ),
]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder to write to; out/NAME by default.")
]
Seed = Annotated[int | None, typer.Option(help="Of all that is random.")]
Size = Annotated[str | None, typer.Option(help="Size of the case: small, default or paper.")]
Device = Annotated[str, typer.Option(help="cpu or cuda.")]
Precision = Annotated[str, typer.Option(help="f64 or f32.")]
Threads = Annotated[int, typer.Option(help="CPU threads; 0 for all cores.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace what an earlier run has left.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on from where Ctrl-C stopped the same run.")]


def stopping() -> None:
    """What Ctrl-C says."""
    print("stopping at the next good moment; Ctrl-C again stops at once", file=sys.stderr)


WIDTH = 110
"""Of tables that do not go to a terminal, where rich would assume 80 columns."""


def out() -> Console:
    """For results."""
    return Console(width=None if sys.stdout.isatty() else WIDTH)


def err() -> Console:
    """For progress."""
    return Console(stderr=True, width=None if sys.stderr.isatty() else WIDTH)


def progress_bar(before: str, after: str = "", console: Console | None = None) -> bars.Progress:
    """A bar with the time taken and left, between two texts with fields of its task."""
    return bars.Progress(
        bars.TextColumn(before), bars.BarColumn(), bars.TaskProgressColumn(), bars.TimeElapsedColumn(),
        bars.TextColumn("left"), bars.TimeRemainingColumn(), bars.TextColumn(after), console=console or err(),
    )  # fmt: skip


def plain_table(*headings: str) -> Table:
    """A table without lines; without a head when there are no headings."""
    table = Table(*headings, show_header=bool(headings), box=None, padding=(0, 2, 0, 0))
    for column in table.columns:
        column.overflow = "fold"
    return table
