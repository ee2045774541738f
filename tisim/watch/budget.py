"""A limit of the processor time that watching takes from the run that is watched."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SHARE = 0.01
"""Largest share of one core, averaged over time."""


class Budget:
    """Work is allowed again when its processor time so far is at most a share of the time that has passed.

    clock, processor : functions that return the time, and the processor time of this process, s.
    """

    def __init__(
        self,
        share: float = SHARE,
        clock: Callable[[], float] = time.monotonic,
        processor: Callable[[], float] = time.process_time,
    ) -> None:
        self._share, self._clock, self._processor = share, clock, processor
        self.next = 0.0

    def wait(self) -> float:
        """Return the time until work is allowed, s; 0 if it is."""
        return max(0.0, self.next - self._clock())

    @contextmanager
    def spend(self) -> Iterator[None]:
        """Work within this context, and afterwards wait until its time is a share of the time since."""
        before = self._processor()
        try:
            yield
        finally:
            self.next = self._clock() + (self._processor() - before) / self._share
