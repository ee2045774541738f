"""Ctrl-C is made to wait for a good moment: between two steps, where a state is whole.

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
    """Return the exit code of a process that was stopped: 128 + the number of the signal that came last."""
    return 128 + _last


class Interrupt:
    """Within ``with Interrupt(notify) as ctrl_c``, the first Ctrl-C is pending: ``notify`` is called, and the
    next ``ctrl_c.check()`` raises KeyboardInterrupt. A second one is raised at once, and sets ``forced``.

    SIGTERM and SIGHUP count as a first one: whoever ends a session may send them several times.
    """

    def __init__(self, notify: Callable[[], None]) -> None:
        self.notify, self.pending, self.forced = notify, False, False
        self._handlers = handle_signals(self._receive)

    def __enter__(self) -> Interrupt:
        self._handlers.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._handlers.__exit__(kind, error, trace)

    def _receive(self, number: int) -> None:
        if self.pending and number == signal.SIGINT:
            self.forced = True
            raise KeyboardInterrupt
        if not self.pending:
            self.pending = True
            self.notify()

    def check(self) -> None:
        """Raise KeyboardInterrupt if a Ctrl-C is pending."""
        if self.pending:
            raise KeyboardInterrupt


@contextlib.contextmanager
def handle_signals(handle: Callable[[int], None]) -> Iterator[None]:
    """Call ``handle`` with the number of each signal that asks to stop, within this context.

    Nothing is done outside of the main thread, as Python handles signals in no other.
    """

    def on_signal(number: int, frame: FrameType | None) -> None:
        global _last
        _last = signal.Signals(number)
        _redirect_dead_terminals()
        handle(number)

    in_main_thread = threading.current_thread() is threading.main_thread()
    previous = {number: signal.getsignal(number) for number in SIGNALS if in_main_thread}
    handled = [number for number in previous if previous[number] not in (signal.SIG_IGN, None)]
    for number in handled:
        signal.signal(number, on_signal)
    try:
        yield
    finally:
        for number in handled:
            signal.signal(number, previous[number])


@contextlib.contextmanager
def defer_signals() -> Iterator[None]:
    """Hold signals that ask to stop within this context, and raise them again at its end.

    It is for a library that calls back into Python and does not bear an exception from there.
    """
    received: list[int] = []
    try:
        with handle_signals(received.append):
            yield
    finally:
        for number in received:
            signal.raise_signal(number)


def raise_interrupt(number: int) -> None:
    """Raise the KeyboardInterrupt of Ctrl-C, whatever the signal is."""
    raise KeyboardInterrupt


def _redirect_dead_terminals() -> None:
    """Send what is still printed to the null device where the terminal is gone, to avoid an error."""
    for descriptor in (1, 2):
        try:
            os.write(descriptor, b"")
        except OSError:
            devnull = os.open(os.devnull, os.O_WRONLY)
            os.dup2(devnull, descriptor)
            os.close(devnull)
