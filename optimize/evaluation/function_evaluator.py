"""Calls plain functions of designs in place of running scenes; Taichi and a device are not needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tisim.optimize.problem.function import FunctionCall, FunctionResult


class FunctionEvaluator:
    """Calls functions one after the other; an evaluator (optimize.evaluation.runs.Evaluator).

    settings : empty, since neither precision nor device changes the value of a Python function.
    """

    def __init__(self) -> None:
        self.settings: dict[str, Any] = {}

    def evaluate(
        self, calls: Sequence[FunctionCall], progress: Callable[[float], None] | None = None
    ) -> Iterator[tuple[int, FunctionResult]]:
        """Yield (index into calls, FunctionResult), in order."""
        for index, call in enumerate(calls):
            yield index, call.run()
            if progress is not None:
                progress((index + 1) / len(calls))

    def close(self) -> None:
        """Do nothing: there is nothing to release."""
