"""Which force it was that stopped a world: asked afterwards, by a kernel that is compiled only then.

In the kernels of a step the laws of all forces would stand once more for it, and take as long to compile.
"""

from __future__ import annotations

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.interactions.force_sum import SumForces
from tisim.worlds.status import ASKED


@ti.data_oriented
class FailureAttribution:
    """A failure attribution names the force that has stopped each world of a batch that failed by one."""

    def __init__(self, summed: SumForces) -> None:
        self.s, self.summed = summed.s, summed

    @in_taichi_thread
    def name_failing_effect(self) -> None:
        """Name the effect whose force on the failing particle is largest, or not finite, where it was when
        asked."""
        self._name()

    @ti.kernel
    def _name(self):
        for w in range(self.s.worlds):
            if self.s.failing_effect[w] == ASKED:
                for i in range(self.s.count[w]):
                    if self.s.id[w, i] == self.s.failing_particle[w]:
                        self.s.failing_effect[w] = self.summed.largest(w, i, self.s.failure_time[w])
