"""A limit of the processor time that watching takes from the run that is watched."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

CORE_SHARE = 0.01
"""Largest share of one core, averaged over time."""
SHORTEST_WAIT = 0.5
"""A shorter wait is left out, s."""


class Budget:
    """Work is allowed again when the processor time of this process is a share of the time that has passed.

    All of the process counts, also answers without news, except work within ``exempt``. Time without work is
    not saved up.

    clock, processor : functions that return the time, and the processor time of this process, s.
    """

    def __init__(
        self,
        share: float = CORE_SHARE,
        clock: Callable[[], float] = time.monotonic,
        processor: Callable[[], float] = time.process_time,
    ) -> None:
        self._share, self._clock, self._processor = share, clock, processor
        self._counted, self._allowed = processor(), clock()

    def wait(self) -> float:
        """Return the time until work is allowed, s; 0 if it is."""
        now, used = self._clock(), self._processor()
        self._allowed = max(self._allowed, now) + (used - self._counted) / self._share
        self._counted = used
        wait = self._allowed - now
        # Short answers alone do not delay the next work.
        return wait if wait > SHORTEST_WAIT else 0.0

    @contextmanager
    def exempt(self) -> Iterator[None]:
        """Do not count the work within this context, such as the first page."""
        self.wait()
        try:
            yield
        finally:
            self._counted = self._processor()
