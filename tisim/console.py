"""Consoles, progress bars and tables for the output of runs and searches.

Text is printed literally: file names and other names may have brackets, which are not taken as markup.
Control characters, for example in the name of a scene, are printed as escapes. If a stream is closed, full,
or not a file, its text is lost without further effect.
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
"""Largest width of tables on a terminal, characters."""


class PrintableConsole(Console):
    """A console that prints control characters in text as escapes, such as \\x1b."""

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
    """A column that shows "compiling" while kernels are compiled, when no progress is made."""

    def render(self, task: bars.Task) -> Text:
        return Text("compiling" if is_compiling() else "")


def progress_bar(before: str, after: str = "", console: Console | None = None) -> bars.Progress:
    """Return a progress bar with the elapsed and remaining time, between two texts with fields of its
    task."""
    return bars.Progress(
        bars.TextColumn(before, markup=False), Compiling(), bars.BarColumn(), bars.TaskProgressColumn(),
        bars.TextColumn("elapsed"), bars.TimeElapsedColumn(),
        bars.TextColumn("left"), bars.TimeRemainingColumn(),
        bars.TextColumn(after, markup=False), console=console or err(),
    )  # fmt: skip


def plain_table(*headings: str) -> Table:
    """Return a table without lines; without headings it has no header row."""
    table = Table(*headings, show_header=bool(headings), box=None, padding=(0, 2, 0, 0))
    for column in table.columns:
        column.overflow = "fold"
    return table


def print_stopping() -> None:
    """Print, after Ctrl-C, that the command will stop at the next good moment."""
    say("stopping at the next good moment; Ctrl-C again stops at once")
