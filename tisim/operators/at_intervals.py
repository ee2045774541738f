"""The contract of operators that act on a world at intervals of time."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.operators.base import Operator
from tisim.state.fields import WorldField


class AtIntervals(Operator):
    """An operator of this kind acts on a world after the first step of each interval of time.

    Its ``world`` calls ``count_interval``. The number of intervals already counted is stored, because a
    number computed again from the time before the step could be rounded into another interval.
    """

    contract: ClassVar[bool] = True

    def required_world_fields(self) -> tuple[WorldField, ...]:
        return *super().required_world_fields(), WorldField(f"{self.label}_intervals", "real")

    def bind_fields(self, s: Any) -> dict[str, Any]:
        """Return the field with the number of counted intervals."""
        return {**super().bind_fields(s), "counted": getattr(s, f"{self.label}_intervals")}

    @ti.func
    def elapsed(self, s, w):
        """Return the number of intervals that have passed, as a real number (f64). By default each lasts
        ``interval``, a parameter, and the first begins at the start of the run, so that the operator first
        acts when it is over."""
        return s.time[w] / ti.cast(self.interval(w), ti.f64)

    @ti.func
    def intervals(self, s, w):
        """Return the number of whole intervals that have passed (f64: the number of short intervals may
        exceed the range of an integer)."""
        return ti.max(0.0, ti.floor(self.elapsed(s, w)))

    @ti.func
    def acts(self, s, w):
        return ti.cast(self.intervals(s, w) > self.counted[w], ti.i32)

    @ti.func
    def count_interval(self, s, w):
        """Count the present interval as one in which the operator has acted."""
        self.counted[w] = self.intervals(s, w)
