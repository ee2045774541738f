"""What runs and searches print on: where text goes, bars and tables. Text is printed as it is: names of files
and of extras may have brackets, which are no markup here."""

import sys

from rich import progress as bars
from rich.console import Console
from rich.table import Table

WIDTH = 110
"""Columns of text that does not go to a terminal, where rich would assume 80."""


def out() -> Console:
    """For results."""
    return Console(markup=False, width=None if sys.stdout.isatty() else WIDTH)


def err() -> Console:
    """For progress."""
    return Console(stderr=True, markup=False, width=None if sys.stderr.isatty() else WIDTH)


def progress_bar(before: str, after: str = "", console: Console | None = None) -> bars.Progress:
    """A bar with the time taken and left, between two texts with fields of its task."""
    return bars.Progress(
        bars.TextColumn(before, markup=False), bars.BarColumn(), bars.TaskProgressColumn(),
        bars.TimeElapsedColumn(), bars.TextColumn("left"), bars.TimeRemainingColumn(),
        bars.TextColumn(after, markup=False), console=console or err(),
    )  # fmt: skip


def plain_table(*headings: str) -> Table:
    """A table without lines; without a head when there are no headings."""
    table = Table(*headings, show_header=bool(headings), box=None, padding=(0, 2, 0, 0))
    for column in table.columns:
        column.overflow = "fold"
    return table


def stopping() -> None:
    """What Ctrl-C says."""
    print("stopping at the next good moment; Ctrl-C again stops at once", file=sys.stderr)
