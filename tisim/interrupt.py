"""Handling of Ctrl-C, deferred to a moment between two steps, when the state is complete.

SIGTERM and SIGHUP are treated like Ctrl-C. Signals that are ignored when the program starts, such as SIGHUP
under nohup, remain ignored.
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
    """Return the exit code of a stopped process: 128 + the number of the last signal."""
    return 128 + _last


class Interrupt:
    """Within ``with Interrupt(notify) as ctrl_c``, the first Ctrl-C is pending: ``notify`` is called, and the
    next ``ctrl_c.check()`` raises KeyboardInterrupt. A second one is raised at once, and sets ``forced``.

    SIGTERM and SIGHUP always count as a first one, because a system may send them several times.
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
    """Call ``handle`` with the number of each signal that requests a stop, within this context.

    It has no effect outside of the main thread, because Python handles signals only there.
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
    """Hold signals that request a stop within this context, and raise them again at its end.

    It is for a library that calls back into Python and cannot handle an exception there.
    """
    received: list[int] = []
    try:
        with handle_signals(received.append):
            yield
    finally:
        for number in received:
            signal.raise_signal(number)


def raise_interrupt(number: int) -> None:
    """Raise KeyboardInterrupt for any signal."""
    raise KeyboardInterrupt


def _redirect_dead_terminals() -> None:
    """Redirect output to the null device if the terminal is gone, to avoid an error."""
    for descriptor in (1, 2):
        try:
            os.write(descriptor, b"")
        except OSError:
            devnull = os.open(os.devnull, os.O_WRONLY)
            os.dup2(devnull, descriptor)
            os.close(devnull)
