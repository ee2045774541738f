"""Ctrl-C that waits for a good moment: between two steps, where a state is whole.

SIGTERM and SIGHUP, by which a system asks to stop, are taken as Ctrl-C. Signals that are ignored when a
program begins, as SIGHUP under nohup, stay so.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))

_last = signal.SIGINT


def exit_code() -> int:
    """The exit code of a process that was stopped: 128 + the number of the signal that came last."""
    return 128 + _last


class Interrupt:
    """Within ``with Interrupt(say) as ctrl_c``, the first Ctrl-C is noted, reported by ``say``, and raised
    (KeyboardInterrupt) by the next ``ctrl_c.check()``; a second one is raised at once, and ``forced`` set.

    SIGTERM and SIGHUP count as a first one: whoever ends a session may send them several times.
    """

    def __init__(self, say: Callable[[], None]) -> None:
        self.say, self.noted, self.forced = say, False, False
        self._handled = handled(self._note)

    def __enter__(self) -> Interrupt:
        self._handled.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._handled.__exit__(kind, error, trace)

    def _note(self, number: int) -> None:
        if self.noted and number == signal.SIGINT:
            self.forced = True
            raise KeyboardInterrupt
        if not self.noted:
            self.noted = True
            self.say()

    def check(self) -> None:
        """Raise a noted Ctrl-C."""
        if self.noted:
            raise KeyboardInterrupt


@contextlib.contextmanager
def handled(handle: Callable[[int], None]) -> Iterator[None]:
    """Within it, ``handle`` is called with the number of each signal that asks to stop.

    In the main thread, that is: Python handles signals in no other, and leaves those of others alone.
    """

    def take(number: int, frame: FrameType | None) -> None:
        global _last
        _last = signal.Signals(number)
        _leave_dead_terminals()
        handle(number)

    here = threading.current_thread() is threading.main_thread()
    before = {number: signal.getsignal(number) for number in SIGNALS if here}
    mine = [number for number in before if before[number] not in (signal.SIG_IGN, None)]
    for number in mine:
        signal.signal(number, take)
    try:
        yield
    finally:
        for number in mine:
            signal.signal(number, before[number])


@contextlib.contextmanager
def deferred() -> Iterator[None]:
    """Within it signals that ask to stop wait, and are raised again at its end: for a library that calls back
    into Python and does not bear an exception from there.
    """
    came: list[int] = []
    try:
        with handled(came.append):
            yield
    finally:
        for number in came:
            signal.raise_signal(number)


def stop(number: int) -> None:
    """Raise the KeyboardInterrupt of Ctrl-C, whatever the signal."""
    raise KeyboardInterrupt


def _leave_dead_terminals() -> None:
    """Have what is still printed go nowhere where the terminal is gone, instead of ending in an error."""
    for descriptor in (1, 2):
        try:
            os.write(descriptor, b"")
        except OSError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, descriptor)
            os.close(nowhere)
