"""Trials in a separate process, which is replaced if it dies or does not answer."""

from __future__ import annotations

import multiprocessing
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

Outcome = tuple[str, str]
"""Outcome of a trial: its column of Counts, "" if it is good, and a message."""


def _work(calls: Connection, make: Callable[..., Callable[[Any], str]], arguments: tuple[Any, ...]) -> None:
    """Answer each call with the outcome of its trial."""
    answer = make(*arguments)
    calls.send("ready")
    while True:
        call = calls.recv()
        try:
            outcome: Outcome = "", answer(call)
        except AssertionError:
            outcome = "wrong", traceback.format_exc()
        except TimeoutError:
            outcome = "hung", traceback.format_exc()
        except BaseException:
            outcome = "tracebacks", traceback.format_exc()
        calls.send(outcome)


class Apart:
    """A process in which ``make(*arguments)`` returns a function that does one trial for each call.

    The function raises AssertionError for a wrong result and TimeoutError for a trial that takes too long.
    """

    def __init__(self, make: Callable[..., Callable[[Any], str]], *arguments: Any) -> None:
        self.make, self.arguments = make, arguments
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.calls, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs, self.make, self.arguments), daemon=True)
        self.process.start()
        theirs.close()
        self.calls.recv()

    def trial(self, call: Any, patience: float) -> Outcome:
        """Outcome of a trial; a trial that takes longer than ``patience`` (s, wall time) is ended."""
        self.calls.send(call)
        try:
            if self.calls.poll(patience):
                column, word = self.calls.recv()
                return column, word
            outcome = "hung", f"no answer in {patience:g} s"
        except EOFError:
            self.process.join()
            outcome = "tracebacks", f"the process ended with {self.process.exitcode}"
        self.end()
        self._start()
        return outcome

    def end(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()
