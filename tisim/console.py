"""Consoles, progress bars and tables for the output of runs and searches.

Text is printed literally: file names and other names may have brackets, which are not taken as markup.
Control characters, for example in the name of a scene, are printed as escapes. If a stream is closed, full,
or not a file, its text is lost without further effect.
"""

import io
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
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
LINES_KEPT = 12
"""Number of lines above a progress bar in a notebook; earlier ones disappear."""
REFRESH_PAUSE = 0.5
"""Time between updates of a progress bar in a notebook, s."""
_CELL = '<pre style="white-space:pre;overflow-x:auto;margin:0;font-family:monospace">{code}</pre>'
"""HTML of a progress bar."""


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


class NotebookProgress(bars.Progress):
    """A progress bar in the output of a cell of a notebook.

    It replaces one output, so that a long search does not fill the notebook with lines, and a saved notebook
    has its last state. rich's own needs ipywidgets, and leaves nothing in a saved notebook. Lines printed to
    its console stand above the bar, the last LINES_KEPT of them.
    """

    def __init__(self, *columns: bars.ProgressColumn) -> None:
        self._text = _LastLines()
        console = PrintableConsole(
            file=self._text, markup=False, width=FILE_WIDTH, force_jupyter=False, force_terminal=False
        )
        super().__init__(*columns, console=console, auto_refresh=False)
        self._ended = threading.Event()
        self._refreshing = threading.Thread(target=self._refresh_often, daemon=True)
        self._output: Any = None

    def start(self) -> None:
        from IPython.display import display

        self._output = display(self._content(), raw=True, display_id=True)
        self._refreshing.start()

    def stop(self) -> None:
        if self._output is not None and not self._ended.is_set():
            self._ended.set()
            self._refreshing.join()
            self.refresh()

    def refresh(self) -> None:
        if self._output is not None:
            self._output.update(self._content(), raw=True)

    def _refresh_often(self) -> None:
        while not self._ended.wait(REFRESH_PAUSE):
            self.refresh()

    def _content(self) -> dict[str, str]:
        """Return the lines and the bar as text and as HTML."""
        page = PrintableConsole(
            file=io.StringIO(),
            record=True,
            width=FILE_WIDTH,
            force_jupyter=False,
            force_terminal=True,
            color_system="truecolor",
        )
        for line in self._text.lines:
            page.print(line, markup=False, highlight=False)
        page.print(self.get_renderable())
        return {
            "text/plain": page.export_text(clear=False).rstrip(),
            "text/html": page.export_html(inline_styles=True, code_format=_CELL),
        }


class _LastLines(io.StringIO):
    """A stream that keeps the last lines written to it."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: deque[str] = deque(maxlen=LINES_KEPT)

    def write(self, text: str) -> int:
        self.lines.extend(text.splitlines())
        return len(text)


def progress_bar(before: str, after: str = "", console: Console | None = None) -> bars.Progress:
    """Return a progress bar with the elapsed and remaining time, between two texts with fields of its task.

    ``console`` of the bar prints lines above it. With a quiet console nothing is shown.
    """
    chosen = console or err()
    columns = (
        bars.TextColumn(before, markup=False), Compiling(), bars.BarColumn(), bars.TaskProgressColumn(),
        bars.TextColumn("elapsed"), bars.TimeElapsedColumn(),
        bars.TextColumn("left"), bars.TimeRemainingColumn(),
        bars.TextColumn(after, markup=False),
    )  # fmt: skip
    if chosen.is_jupyter and not chosen.quiet:
        return NotebookProgress(*columns)
    return bars.Progress(*columns, console=chosen, disable=chosen.quiet)


@contextmanager
def shown_progress(what: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar; yield the function that takes the finished fraction, 0..1."""
    with progress_bar("{task.description}") as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)


def plain_table(*headings: str) -> Table:
    """Return a table without lines; without headings it has no header row."""
    table = Table(*headings, show_header=bool(headings), box=None, padding=(0, 2, 0, 0))
    for column in table.columns:
        column.overflow = "fold"
    return table


def print_stopping() -> None:
    """Print, after Ctrl-C, that the command will stop at the next good moment."""
    say("stopping at the next good moment; Ctrl-C again stops at once")
