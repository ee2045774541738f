"""The contract of operators that act on a world at intervals of time."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.operators.base import Operator


class AtIntervals(Operator):
    """An operator of this kind acts on a world after the first step of each interval of time.

    Its ``world`` calls ``count_interval``. The number of intervals that have been counted is kept, as the one
    before a step, found anew from the times, may be rounded into another.
    """

    contract: ClassVar[bool] = True

    def keeps(self, what: str) -> tuple[str, ...]:
        own = (f"{self.label}_intervals",) if what == "clocks" else ()
        return *super().keeps(what), *own

    def remembers(self, s: Any) -> dict[str, Any]:
        """Return the field of the intervals that have been counted."""
        return {**super().remembers(s), "counted": getattr(s, f"{self.label}_intervals")}

    @ti.func
    def elapsed(self, s, w):
        """Return how many intervals have gone by, as a real number, f64; by default of ``interval`` each, a
        parameter, since the start: it first acts when one is over."""
        return s.time[w] / ti.cast(self.interval(w), ti.f64)

    @ti.func
    def intervals(self, s, w):
        """Return how many whole intervals have gone by, f64: of short ones they are more than an integer
        holds."""
        return ti.max(0.0, ti.floor(self.elapsed(s, w)))

    @ti.func
    def acts(self, s, w):
        return ti.cast(self.intervals(s, w) > self.counted[w], ti.i32)

    @ti.func
    def count_interval(self, s, w):
        """Note that it has acted in this interval."""
        self.counted[w] = self.intervals(s, w)
