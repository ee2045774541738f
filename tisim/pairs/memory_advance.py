"""What pairs and particles remember, brought up to date with the end of a step that was found by trial."""

from typing import TYPE_CHECKING

from tisim.backend.taichi import ti
from tisim.pairs.listed_pairs import ComputePairs, ExportedTerms
from tisim.program.phases import PerParticle, Phase

if TYPE_CHECKING:
    from tisim.forces.force_sum import SumForces


class AdvanceParticles(PerParticle):
    """This phase brings what particles remember by themselves up to date with the end of a step found by
    trial."""

    def __init__(self, total: "SumForces") -> None:
        super().__init__(total.s)
        self.total = total

    @ti.func
    def run(self, w, i):
        self.total.external_load(w, i, self.s.time[w])


def advance_phases(total: "SumForces", exported: ExportedTerms) -> tuple[Phase, ...]:
    """Return the phases that bring up to date what pairs remember."""
    return tuple(AdvancePairs(total, exported, laws) for laws in total.listed_laws() if laws.remembering)


class AdvancePairs(ComputePairs):
    """This phase brings what pairs remember up to date with the end of a step that was found by trial."""

    @ti.func
    def run(self, w, c):
        self.note_memory(w)
        self.compute_pairs(w, c)

    @ti.func
    def process_pair(self, w, c, m, values):
        self.total.write_memory(self.laws, w, m, values)

    @ti.func
    def process_distant_pair(self, w, c, m):
        self.total.out_of_reach(self.laws, w, m)
