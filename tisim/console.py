"""Consoles, progress bars and tables that runs and searches print with.

Text is printed as it is: names of files and of extras may have brackets, which are no markup here. Characters
that would control the terminal, as the name of a scene may have them, are printed as escapes. Where a stream
is closed, full, or no file at all, the text is lost and nothing else.
"""

import sys
from collections.abc import Iterable
from typing import Any

from rich import progress as bars
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from tisim.compiling import is_compiling
from tisim.streams import escaped, safe, say

FILE_WIDTH = 110
"""Width of tables that do not go to a terminal, characters; rich would assume 80."""
TERMINAL_WIDTH = 80
"""Largest width of tables for a terminal, characters: every terminal has as many."""


class PrintableConsole(Console):
    """This console prints characters that control a terminal as escapes, such as \\x1b, but for its own."""

    def render_str(self, text: str, **options: Any) -> Text:
        return super().render_str(escaped(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.is_control else Segment(escaped(segment.text), segment.style)


def _console(stream: Any) -> Console:
    file = safe(stream)
    return PrintableConsole(file=file, markup=False, width=None if file.isatty() else FILE_WIDTH)  # type: ignore[arg-type]


def out() -> Console:
    """Return the console for results, which writes to standard output."""
    return _console(sys.stdout)


def err() -> Console:
    """Return the console for progress, which writes to standard error."""
    return _console(sys.stderr)


class Compiling(bars.ProgressColumn):
    """This column says so while kernels are compiled, in which nothing else advances."""

    def render(self, task: bars.Task) -> Text:
        return Text("compiling" if is_compiling() else "")


def progress_bar(before: str, after: str = "", console: Console | None = None) -> bars.Progress:
    """Return a bar with the time taken and left, between two texts with fields of its task."""
    return bars.Progress(
        bars.TextColumn(before, markup=False), Compiling(), bars.BarColumn(), bars.TaskProgressColumn(),
        bars.TextColumn("elapsed"), bars.TimeElapsedColumn(),
        bars.TextColumn("left"), bars.TimeRemainingColumn(),
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
    say("stopping at the next good moment; Ctrl-C again stops at once")
