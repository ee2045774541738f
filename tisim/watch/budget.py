"""A limit of the processor time that watching takes from the run that is watched."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tisim.backend import runtime

CORES_SHARE = 0.008
"""Largest share of all cores together, averaged over time. A run that uses all of them is slowed by it; one
that leaves a core idle is not."""
CREDIT = 0.5
"""Processor time that may be used at once after a time with less work, s."""


class Budget:
    """Work is allowed as long as the processor time of this process is at most CREDIT and a share of the time
    that has passed (a leaky bucket).

    All of the process counts, also answers without news, except work within ``exempt``.

    share : of one core; by default CORES_SHARE of all that this process may use.
    clock, processor : functions that return the time, and the processor time of this process, s.
    """

    def __init__(
        self,
        share: float | None = None,
        credit: float = CREDIT,
        clock: Callable[[], float] = time.monotonic,
        processor: Callable[[], float] = time.process_time,
    ) -> None:
        self._share = share or CORES_SHARE * runtime.cores()
        self._saved = credit / self._share
        self._clock, self._processor = clock, processor
        self._counted, self._allowed = processor(), clock() - self._saved

    def wait(self) -> float:
        """Return the time until work is allowed, s; 0 if it is."""
        now, used = self._clock(), self._processor()
        self._allowed = max(self._allowed, now - self._saved) + (used - self._counted) / self._share
        self._counted = used
        return max(0.0, self._allowed - now)

    @contextmanager
    def exempt(self) -> Iterator[None]:
        """Do not count the work within this context, such as the first page."""
        self.wait()
        try:
            yield
        finally:
            self._counted = self._processor()
