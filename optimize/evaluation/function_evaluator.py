"""Calls plain functions of designs where others run scenes; neither Taichi nor a device is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tisim.optimize.problem.function import FunctionCall, FunctionResult


class FunctionEvaluator:
    """Calls to results, one after the other; an evaluator (optimize.evaluation.runs.Evaluator).

    settings : empty, as neither precision nor device changes what a function of Python gives.
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
        """There is nothing to give back."""
