"""Ctrl-C that waits for a good moment: between two steps, where a state is whole."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType, TracebackType


class Interrupt:
    """Within ``with Interrupt(say) as ctrl_c``, the first Ctrl-C is noted, told by ``say``, and raised
    (KeyboardInterrupt) by the next ``ctrl_c.check()``; a second one is raised at once, and ``forced`` set.
    """

    def __init__(self, say: Callable[[], None]) -> None:
        self.say, self.noted, self.forced = say, False, False

    def __enter__(self) -> Interrupt:
        self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        signal.signal(signal.SIGINT, self._before)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.noted:
            self.forced = True
            raise KeyboardInterrupt
        self.noted = True
        self.say()

    def check(self) -> None:
        """Raise a noted Ctrl-C."""
        if self.noted:
            raise KeyboardInterrupt
