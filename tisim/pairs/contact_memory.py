"""What pairs that touch remember of each other, such as how far they have slid, for one law.

In a step it lies with the pair in the list. In between it is stored with the smaller particle of the pair (of
equals, the one of lower id), which has few larger neighbours, under the id of the other. So it survives new
lists, indices that move and restarts, and goes with the particle that carries it.
"""

from typing import Any

from tisim.backend.taichi import ti
from tisim.effects.base import PairForce
from tisim.state.bound import Bound
from tisim.state.fields import Field
from tisim.state.state import State
from tisim.state.status import WorldStatus

PARTNERS = 16
"""A particle can store this many pairs. Thirteen spheres of its size or larger do not find room around it."""
NO_PARTNER, NO_SLOT = -1, -1
"""The first is the id in a free slot; the second is what a search gives when there is none."""


def memory_fields(effect: PairForce) -> tuple[Field, ...]:
    """Return the fields in which a law stores what its pairs remember: with whom, and what."""
    if not effect.memory:
        return ()
    if not effect.short_ranged:
        raise TypeError(f"{type(effect).__name__} must be short-ranged: pairs remember while they are near")
    name = effect.label
    return (
        Field(f"{name}_partners", "", 1, "keep", integer=True, slots=PARTNERS, default=NO_PARTNER),
        Field(f"{name}_past", "", 1, "keep", slots=PARTNERS * effect.memory),
    )


@ti.data_oriented
class ContactMemory:
    """A contact memory holds, for one law, values of each listed pair, as the particle of lower id sees
    them."""

    def __init__(self, s: State, law: Bound[PairForce]) -> None:
        partners, past = memory_fields(law.data)
        self.s, self.size = s, law.data.memory
        self.partners, self.past = getattr(s, partners.name), getattr(s, past.name)
        self.values: tuple[Any, ...] = ()

    def make_fields(self) -> tuple[Any, ...]:
        """Make the fields, to be placed with the pairs, and return them. Not before that: one that is placed
        nowhere, as there is no room for what comes first, would be a fault of every later kernel."""
        self.values = tuple(ti.field(self.s.real) for _ in range(self.size))
        return self.values

    @ti.func
    def read(self, w, m):
        """Return what pair m remembers; a vector."""
        known = ti.Vector.zero(self.s.real, self.size)
        for c in ti.static(range(self.size)):
            known[c] = self.values[c][w, m]
        return known

    @ti.func
    def write(self, w, m, known):
        for c in ti.static(range(self.size)):
            self.values[c][w, m] = known[c]

    @ti.func
    def forget(self, w, m):
        """Have pair m remember nothing."""
        for c in ti.static(range(self.size)):
            self.values[c][w, m] = 0.0

    @ti.func
    def find(self, w, i, other):
        """Return the slot in which i has stored something of the particle with this id."""
        slot = NO_SLOT
        for k in range(PARTNERS):
            if self.partners[w, i, k] == other:
                slot = k
        return slot

    @ti.func
    def clear(self, w, i):
        """Have i store nothing. No trace is left, which would tell how often something was stored."""
        for k in range(PARTNERS):
            if self.partners[w, i, k] != NO_PARTNER:
                self.partners[w, i, k] = NO_PARTNER
                for c in ti.static(range(self.size)):
                    self.past[w, i, k * self.size + c] = 0.0

    @ti.func
    def store(self, w, m, i, j):
        """Store with i what pair m, of i and j, remembers, where it remembers anything."""
        known = self.read(w, m)
        if (known != 0.0).any():
            slot = self.find(w, i, NO_PARTNER)
            if slot < 0:
                self.s.fail(w, WorldStatus.CONTACT_OVERFLOW, i)
            else:
                self.partners[w, i, slot] = self.s.id[w, j]
                for c in ti.static(range(self.size)):
                    self.past[w, i, slot * self.size + c] = known[c]

    @ti.func
    def stored(self, w, i, j):
        """Return what i has stored of j; zero when it has nothing."""
        known, slot = ti.Vector.zero(self.s.real, self.size), self.find(w, i, self.s.id[w, j])
        if slot >= 0:
            for c in ti.static(range(self.size)):
                known[c] = self.past[w, i, slot * self.size + c]
        return known

    @ti.func
    def recall(self, w, m, i, j):
        """Put into pair m what either of the two has stored of the other."""
        self.write(w, m, self.stored(w, i, j) + self.stored(w, j, i))
