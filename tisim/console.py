"""Consoles, progress bars and tables that runs and searches print with.

Text is printed as it is: names of files and of extras may have brackets, which are no markup here.
"""

import sys

from rich import progress as bars
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tisim.compiling import is_compiling

FILE_WIDTH = 110
"""Width of tables that do not go to a terminal, characters; rich would assume 80."""
TERMINAL_WIDTH = 80
"""Largest width of tables for a terminal, characters: every terminal has as many."""


def out() -> Console:
    """Return the console for results, which writes to standard output."""
    return Console(markup=False, width=None if sys.stdout.isatty() else FILE_WIDTH)


def err() -> Console:
    """Return the console for progress, which writes to standard error."""
    return Console(stderr=True, markup=False, width=None if sys.stderr.isatty() else FILE_WIDTH)


class Compiling(bars.ProgressColumn):
    """This column says so while kernels are compiled, in which nothing else advances."""

    def render(self, task: bars.Task) -> Text:
        return Text("compiling" if is_compiling() else "")


def progress_bar(before: str, after: str = "", console: Console | None = None) -> bars.Progress:
    """Return a bar with the time taken and left, between two texts with fields of its task."""
    return bars.Progress(
        bars.TextColumn(before, markup=False), Compiling(), bars.BarColumn(), bars.TaskProgressColumn(),
        bars.TimeElapsedColumn(), bars.TextColumn("left"), bars.TimeRemainingColumn(),
        bars.TextColumn(after, markup=False), console=console or err(),
    )  # fmt: skip


def plain_table(*headings: str) -> Table:
    """Return a table without lines; it has no head when there are no headings."""
    table = Table(*headings, show_header=bool(headings), box=None, padding=(0, 2, 0, 0))
    for column in table.columns:
        column.overflow = "fold"
    return table


def print_stopping() -> None:
    """Print, after Ctrl-C, that the command will stop at the next good moment."""
    print("stopping at the next good moment; Ctrl-C again stops at once", file=sys.stderr)
