"""The list of the pairs with an event in this step, and the search of near pairs that fills it."""

from typing import Any

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.effects.base import PairEvent
from tisim.pairs.near_list import NearList
from tisim.program.evaluation_stage import AtStage, EvaluationStage
from tisim.program.phases import PerParticle, Phase
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.state.status import WorldStatus

CONTACTS_PER_PARTICLE = 8
"""Capacity for overlapping pairs, per particle. Spheres of any sizes that only touch have fewer than 14.93
contacts on average, which makes half this number of pairs per particle (G. Kuperberg and O. Schramm, Math.
Res. Lett. 1 (1994) 339)."""


@ti.data_oriented
class ContactList:
    """A contact list holds the pairs with an event in this step."""

    def __init__(self, s: State, domain: Bound[Domain], events: tuple[Bound[PairEvent], ...]) -> None:
        self.s, self.domain, self.events = s, domain, events
        self.capacity = CONTACTS_PER_PARTICLE * s.capacity
        builder = Builder()
        self.first, self.second = ti.field(ti.i32), ti.field(ti.i32)
        self.bid, self.best = ti.field(ti.i64), ti.field(ti.i64)
        self.size, self.waiting, self.overlaps = ti.field(ti.i32), ti.field(ti.i32), ti.field(ti.i32)
        for column in (self.first, self.second, self.bid):
            builder.dense(ti.i, s.worlds).dense(ti.j, self.capacity).place(column)
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(self.best)
        for column in (self.size, self.waiting, self.overlaps):
            builder.dense(ti.i, s.worlds).place(column)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        return self.tree.bytes

    @ti.func
    def add(self, w, i, j, due):
        """Enter a pair whose event fell due ``due`` seconds ago (>= 0)."""
        c = ti.atomic_add(self.size[w], 1)
        if c < self.capacity:
            self.first[w, c], self.second[w, c] = i, j
            # The bits of a positive f32 have the same order as its value; the low half breaks ties.
            order = ti.cast(ti.bit_cast(ti.cast(due, ti.f32), ti.i32), ti.i64)
            self.bid[w, c] = ((order + 1) << 31) + i + j
            self.waiting[w] += 1
        else:
            self.overflow(w)

    @ti.func
    def count_overlaps(self, w, overlaps):
        """Add the overlapping pairs of a particle to the count; stop a world with too many."""
        if ti.atomic_add(self.overlaps[w], overlaps) + overlaps > CONTACTS_PER_PARTICLE * self.s.count[w]:
            self.overflow(w)

    @ti.func
    def overflow(self, w):
        """Stop a world without a failing particle: the pair that overflows depends on the order of
        threads."""
        ti.atomic_max(self.s.failed[w], WorldStatus.CONTACT_OVERFLOW)


class ClearContacts(Phase):
    """This phase empties the list before a search, as a failed step does not clear it."""

    def __init__(self, contacts: ContactList) -> None:
        self.c = contacts

    @ti.func
    def run(self, w, _k):
        self.c.size[w] = 0
        self.c.waiting[w] = 0
        self.c.overlaps[w] = 0


class FindContacts(AtStage, PerParticle):
    """This phase visits every near pair: it enters pairs in contact, and passes all pairs to the step
    control.

    After events it serves the step control only, as the contacts have been resolved.
    """

    def __init__(self, near: NearList, contacts: ContactList, control: Bound[Any]) -> None:
        super().__init__(near.s)
        self.near, self.contacts, self.control = near, contacts, control
        self.hard = any(event.hard for event in contacts.events)

    @ti.func
    def enter(self, w, i, j, separation):
        """Enter a pair if it has an event; return 1 if it overlaps."""
        due = ti.cast(-1.0, self.s.real)
        for event in ti.static(self.contacts.events):
            due = ti.max(due, event.contact(self.s, w, i, j, separation))
        if due >= 0.0:
            self.contacts.add(w, i, j, due)
        reach = self.s.radius[w, i] + self.s.radius[w, j]
        return ti.cast(separation.norm_sqr() <= reach * reach, ti.i32)

    @ti.func
    def run(self, w, i):
        near, s, listed = self.near, self.s, self.near.listed(w)
        soonest, overlaps = ti.cast(ti.math.inf, ti.f64), 0
        enters = s.evaluation_stage[w] != EvaluationStage.AFTER_EVENTS
        for k in range(near.offered(w, i, listed)):
            j = near.candidate(w, i, k, listed)
            leads = near.leads(w, i, j)
            # A list has each pair once; without a list the leading particle takes the pair.
            if leads or listed:
                a, b = ti.select(leads, i, j), ti.select(leads, j, i)
                d = near.domain.separation(w, s.position[w, a], s.position[w, b], s.time[w])
                if enters:
                    overlaps += self.enter(w, a, b, d)
                soonest = ti.min(soonest, self.control.pair(s, w, a, b, d))
        self.control.note(self.s, w, i, soonest)
        if ti.static(self.hard) and enters:
            self.contacts.count_overlaps(w, overlaps)
