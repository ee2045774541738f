"""Progress of a cost study on standard error: first its reference, then each setting."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING

from tisim.accuracy import report
from tisim.accuracy.runner import DESCRIPTION_LENGTH
from tisim.console import err, progress_bar

if TYPE_CHECKING:
    from tisim.accuracy import Row, Study

LEAST_FRACTION = 0.02
"""The remaining time is shown only after this fraction of the study is done."""


class CostProgress:
    """Progress of a study: a bar on a terminal, otherwise one line for each finished setting."""

    def __init__(self, study: Study) -> None:
        self.study, self.console = study, err()
        self.bar = progress_bar("", "{task.description}", self.console)
        self.bar.disable = not self.console.is_terminal
        self.task = self.bar.add_task("", total=1.0)
        self.began, self.fraction, self.what = time.monotonic(), 0.0, ""
        # Rows of an earlier study are not shown again, but the quality of its reference is.
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
        """Show the fraction of the study that is done and the name of the current run."""
        self.fraction = fraction
        self.bar.update(self.task, completed=fraction, description=what[:DESCRIPTION_LENGTH])
        if self.bar.disable and what != self.what and not self.study.truths:
            self._print(f"running {what}")
        self.what = what

    def finished(self) -> None:
        """Show the new results: true values or rows."""
        self._print_truths()
        if self.bar.disable:
            for row in self.study.rows[self.rows :]:
                self._print(_line(row, self._left()))
        self.rows = len(self.study.rows)

    def _print_truths(self) -> None:
        if len(self.study.truths) > self.truths:
            for line in report.truths(self.study):
                self._print(line)
            self.truths = len(self.study.truths)

    def _left(self) -> str:
        """Return the estimated remaining time as text, or an empty string before there is an estimate."""
        if self.fraction < LEAST_FRACTION:
            return ""
        seconds = (time.monotonic() - self.began) * (1.0 - self.fraction) / self.fraction
        return f"; about {seconds:.0f} s left"

    def _print(self, line: str) -> None:
        self.console.print(line, highlight=False, markup=False, soft_wrap=True)


def _line(row: Row, left: str) -> str:
    """Return one line with the error and the time of a setting."""
    measured = f"error {', '.join(report.error_texts(row))}; {row.median:.3g} s"
    return f"{row.method}, {row.setting}: {row.failed or measured}{left}"
