"""Contact history of one law: values that touching pairs keep between steps, such as their sliding
displacement.

During steps the history is kept with the pair in the list. Before a list is rebuilt, indices change or the
state is read, it is stored on the smaller particle of the pair (for equal sizes, on the particle of lower
id), which has few larger neighbours, under the id of the other particle. It is therefore kept when lists are
rebuilt, when indices change and after a restart, and moves in memory with its particle.
"""

from typing import Any

from tisim.backend.taichi import ti
from tisim.effects.base import PairForce
from tisim.state.bound import Bound
from tisim.state.fields import Field
from tisim.state.state import State
from tisim.state.status import WorldStatus

PARTNERS = 16
"""Largest number of pairs stored on a particle; fewer than thirteen spheres of its size or larger can touch
it."""
NO_PARTNER, NO_SLOT = -1, -1
"""NO_PARTNER is the id in a free slot; NO_SLOT is the result of a search without a match."""


def memory_fields(effect: PairForce) -> tuple[Field, ...]:
    """Return the two fields for the contact history of a law: the ids of the partners, and the values."""
    if not effect.memory:
        return ()
    if not effect.short_ranged:
        raise TypeError(
            f"{type(effect).__name__} must be short-ranged: contact history is kept for listed pairs"
        )
    name = effect.label
    return (
        Field(f"{name}_partners", "", 1, "keep", integer=True, slots=PARTNERS, default=NO_PARTNER),
        Field(f"{name}_past", "", 1, "keep", slots=PARTNERS * effect.memory),
    )


@ti.data_oriented
class ContactMemory:
    """A contact memory holds, for one law, the contact history of each listed pair as seen from the particle
    of lower id."""

    def __init__(self, s: State, law: Bound[PairForce]) -> None:
        partners, past = memory_fields(law.data)
        self.s, self.size = s, law.data.memory
        self.partners, self.past = getattr(s, partners.name), getattr(s, past.name)
        self.values: tuple[Any, ...] = ()

    def make_fields(self) -> tuple[Any, ...]:
        """Make the fields that are to be placed with the pairs, and return them.

        They must not be made earlier: a field that is never placed, because memory ran out before, would
        break every later kernel.
        """
        self.values = tuple(ti.field(self.s.real) for _ in range(self.size))
        return self.values

    @ti.func
    def read(self, w, m):
        """Return the contact history of pair m; a vector."""
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
        """Clear the contact history of pair m."""
        for c in ti.static(range(self.size)):
            self.values[c][w, m] = 0.0

    @ti.func
    def find(self, w, i, other):
        """Return the slot in which i has stored the history with the particle of this id."""
        slot = NO_SLOT
        for k in range(PARTNERS):
            if self.partners[w, i, k] == other:
                slot = k
        return slot

    @ti.func
    def clear(self, w, i):
        """Clear the stored history of i. All values are reset, so the state does not depend on how often it
        was stored."""
        for k in range(PARTNERS):
            if self.partners[w, i, k] != NO_PARTNER:
                self.partners[w, i, k] = NO_PARTNER
                for c in ti.static(range(self.size)):
                    self.past[w, i, k * self.size + c] = 0.0

    @ti.func
    def store(self, w, m, i, j):
        """Store the history of pair m, of i and j, on i unless it is zero."""
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
        """Return the history that i has stored with j; zero if there is none."""
        known, slot = ti.Vector.zero(self.s.real, self.size), self.find(w, i, self.s.id[w, j])
        if slot >= 0:
            for c in ti.static(range(self.size)):
                known[c] = self.past[w, i, slot * self.size + c]
        return known

    @ti.func
    def recall(self, w, m, i, j):
        """Set the history of pair m from the one stored on either particle."""
        self.write(w, m, self.stored(w, i, j) + self.stored(w, j, i))
