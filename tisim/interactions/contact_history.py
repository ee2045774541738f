"""What pairs that touch remember of each other, such as how far they have slid.

It lies with the smaller particle of a pair (of equals, the one with the lower id), which has few larger
neighbours, under the id of the other. So it survives new pair lists, indices that move and restarts, and
goes with the particle that carries it. A particle that changes size may start its contacts anew.
"""

from tisim.backend.taichi import ti
from tisim.components.domain import Domain
from tisim.effects.base import PairForce
from tisim.neighbours.full_list import FullNeighbourList
from tisim.worlds.bound import Bound
from tisim.worlds.fields import Field
from tisim.worlds.program import PerParticle
from tisim.worlds.state import State
from tisim.worlds.status import WorldStatus

PARTNERS = 16
"""Pairs that a particle can keep. Thirteen spheres of its size or larger do not find room around it."""
NO_PARTNER, NO_SLOT, UNKNOWN = -1, -1, -2
"""The id in a free slot; what a look at a pair gives when it is not to be kept, and when it is new."""


def memory_fields(effect: PairForce) -> tuple[Field, ...]:
    """Where an effect keeps what its pairs remember: with whom, and what."""
    if not effect.memory:
        return ()
    if not effect.short_ranged:
        raise TypeError(f"{type(effect).__name__} must be short-ranged: pairs remember while they touch")
    name = effect.label
    return (
        Field(f"{name}_partners", "", 1, "keep", integer=True, slots=PARTNERS, default=NO_PARTNER),
        Field(f"{name}_past", "", 1, "keep", slots=PARTNERS * effect.memory),
    )


@ti.data_oriented
class ContactHistory:
    """The memory of one effect; ``recall`` and ``sign`` are what the effect itself uses."""

    def __init__(self, s: State, effect: PairForce) -> None:
        partners, past = memory_fields(effect)
        self.size = effect.memory
        self.partners, self.past = getattr(s, partners.name), getattr(s, past.name)

    @ti.func
    def is_keeper(self, s, w, i, j):
        """Whether i is the one of the pair who remembers."""
        a, b = s.radius[w, i], s.radius[w, j]
        return a < b or (a == b and s.id[w, i] < s.id[w, j])

    @ti.func
    def sign(self, s, w, i, j):
        """1 when what the pair remembers is seen from i, -1 when it is seen from j."""
        return ti.cast(ti.select(self.is_keeper(s, w, i, j), 1, -1), s.real)

    @ti.func
    def find(self, w, i, other):
        """Slot in which i keeps what it knows of the particle with this id, or -1."""
        slot = -1
        for k in range(PARTNERS):
            if self.partners[w, i, k] == other:
                slot = k
        return slot

    @ti.func
    def read(self, s, w, i, slot):
        known = ti.Vector.zero(s.real, self.size)
        if slot >= 0:
            for c in ti.static(range(self.size)):
                known[c] = self.past[w, i, slot * self.size + c]
        return known

    @ti.func
    def recall(self, s, w, i, j):
        """What the pair remembers, whoever keeps it; zero when they have just met."""
        keeper, other = i, j
        if not self.is_keeper(s, w, i, j):
            keeper, other = j, i
        return self.read(s, w, keeper, self.find(w, keeper, s.id[w, other]))


class UpdateContactHistory(PerParticle):
    """Bring up to date what each particle keeps for one effect: pairs that go on touching, then those that
    no longer do, which are forgotten, and last those that have just met."""

    def __init__(
        self, s: State, domain: Bound[Domain], effect: Bound[PairForce], full_list: FullNeighbourList
    ) -> None:
        super().__init__(s)
        self.domain, self.effect, self.full_list = domain, effect, full_list
        self.history = effect.past

    @ti.func
    def run(self, w, i):
        met, known = self.update_pairs(w, i, False)
        for k in range(PARTNERS):
            if not (known >> k) & 1:
                self.history.partners[w, i, k] = NO_PARTNER
        if met > 0:
            self.update_pairs(w, i, True)

    @ti.func
    def update_pairs(self, w, i, new: ti.template()):  # type: ignore[valid-type]
        """Go through the pairs that i keeps; returns how many are new to it, and the slots of the others."""
        met, known = 0, 0
        for k in range(self.full_list.size(w, i)):
            slot = self.update_pair(w, i, self.full_list.candidate(w, i, k), new)
            met += ti.select(slot == UNKNOWN, 1, 0)
            known |= ti.select(slot >= 0, 1 << ti.max(slot, 0), 0)
        return met, known

    @ti.func
    def update_pair(self, w, i, j, new: ti.template()):  # type: ignore[valid-type]
        """Remember a pair that is known, or, when it is their turn, one that is new; where i keeps it."""
        s, h = self.s, self.history
        place = NO_SLOT
        if i != j and h.is_keeper(s, w, i, j):
            d = self.domain.separation(w, s.position[w, i], s.position[w, j])
            distance = d.norm()
            if self.effect.touching(s, w, i, j, d, distance):
                slot = h.find(w, i, s.id[w, j])
                place = ti.select(slot < 0, UNKNOWN, slot)
                if ti.static(new):
                    if slot < 0:
                        self.write(w, i, j, d, distance, h.find(w, i, NO_PARTNER), h.read(s, w, i, NO_SLOT))
                elif slot >= 0:
                    self.write(w, i, j, d, distance, slot, h.read(s, w, i, slot))
        return place

    @ti.func
    def write(self, w, i, j, separation, distance, slot, past):
        s, h = self.s, self.history
        if slot < 0:
            s.fail(w, WorldStatus.CONTACT_OVERFLOW, i)
        else:
            dt = ti.cast(s.dt[w], s.real)
            knows = self.effect.remember(s, w, i, j, separation, distance, past, dt)
            h.partners[w, i, slot] = s.id[w, j]
            for c in ti.static(range(h.size)):
                h.past[w, i, slot * h.size + c] = knows[c]
