"""The progress of a study of costs is shown on standard error: its reference, then each setting."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING

from tisim.accuracy import table
from tisim.console import err, progress_bar

if TYPE_CHECKING:
    from tisim.accuracy import Row, Study

LEAST_FRACTION = 0.02
"""So much of a study must be done before the time that is left is shown."""


class CostProgress:
    """Progress is a bar on a terminal; elsewhere, where a bar would be seen at its end only, a line for each
    setting."""

    def __init__(self, study: Study) -> None:
        self.study, self.console = study, err()
        self.bar = progress_bar("", "{task.description}", self.console)
        self.bar.disable = not self.console.is_terminal
        self.task = self.bar.add_task("", total=1.0)
        self.began, self.fraction, self.what = time.monotonic(), 0.0, ""
        # What an earlier study has left is not shown again, but for what its reference is good for.
        self.rows, self.truths = len(study.rows), 0

    def __enter__(self) -> CostProgress:
        self.bar.__enter__()
        self._print_truths()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.bar.__exit__(kind, error, trace)

    def running(self, fraction: float, what: str) -> None:
        """Show that so much of the study is done, and what is being run."""
        self.fraction = fraction
        self.bar.update(self.task, completed=fraction, description=what[:48])
        if self.bar.disable and what != self.what and not self.study.truths:
            self._print(f"running {what}")
        self.what = what

    def finished(self) -> None:
        """Show what has become known: the truth, or rows."""
        self._print_truths()
        if self.bar.disable:
            for row in self.study.rows[self.rows :]:
                self._print(_line(row, self._left()))
        self.rows = len(self.study.rows)

    def _print_truths(self) -> None:
        if len(self.study.truths) > self.truths:
            for line in table.truths(self.study):
                self._print(line)
            self.truths = len(self.study.truths)

    def _left(self) -> str:
        """Return about how long the rest takes, or nothing while too little is known of it."""
        if self.fraction < LEAST_FRACTION:
            return ""
        seconds = (time.monotonic() - self.began) * (1.0 - self.fraction) / self.fraction
        return f"; about {seconds:.0f} s left"

    def _print(self, line: str) -> None:
        self.console.print(line, highlight=False, markup=False, soft_wrap=True)


def _line(row: Row, left: str) -> str:
    """Return what a setting costs and how accurate it is, in a line."""
    measured = f"error {', '.join(table.error_texts(row))}; {row.median:.3g} s"
    return f"{row.method}, {row.setting}: {row.failed or measured}{left}"
