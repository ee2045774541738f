"""Sudden events between pairs, such as impacts, many at once: in parallel, deterministic, conservative.

A step that has moved the particles is surveyed for pairs in contact, which go into a list with the time
since their event fell due. They are then resolved in rounds. In a round every waiting pair bids for both
its particles, and a pair that holds the highest bid at both is resolved. The bid is the time since the
event fell due, so earlier events go first. Why this is right:

- Exclusive: a particle has one highest bid, so pairs of one round share no particle, and each is a binary
  event as the laws define it. Momentum and mass are conserved pair by pair, hence in all.
- Complete: the waiting pair with the highest bid of all always wins, so every round settles at least one
  pair, and each pair is settled once; the rounds end.
- Ordered: a pair waits until every earlier pair of either of its particles is settled, and then sees what
  those have done to velocity, size and temperature. The outcome is that of resolving the whole list one
  after another, earliest first.
- Deterministic: bids are integers, compared by atomic maxima, which do not depend on order. Two pairs that
  share a particle never bid the same, as the sum of their indices breaks ties.

Impacts in the same instant are therefore resolved one after another too, and their outcome is the limit of
impacts that follow each other. It keeps momentum and never gains energy, but where e < 1 it need not be as
symmetric as the grains were: see docs/agglomeration.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.components.domain import Domain
from tisim.effects.base import PairEvent
from tisim.neighbours.pair_list import NeighbourList
from tisim.worlds.program import PerParticle, Phase, Repeat
from tisim.worlds.state import State, WorldStatus

if TYPE_CHECKING:
    from tisim.steppers.step_control import Controller

CONTACTS_PER_PARTICLE = 8
"""Room for pairs that overlap. Spheres that only touch, of any sizes, touch fewer than 14.93 others in the
mean, and make half as many pairs (G. Kuperberg and O. Schramm, Math. Res. Lett. 1 (1994) 339)."""


@ti.data_oriented
class ContactList:
    """The pairs of this step in which something falls due."""

    def __init__(self, s: State, domain: Domain, events: tuple[PairEvent, ...]) -> None:
        self.s, self.domain, self.events = s, domain, events
        self.capacity = CONTACTS_PER_PARTICLE * s.capacity
        builder = ti.FieldsBuilder()
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
        """Device memory, in bytes."""
        return self.s.worlds * (16 * self.capacity + 8 * self.s.capacity + 12)

    @ti.func
    def add(self, w, i, j, due):
        """Enter a pair whose event fell due ``due`` seconds ago (>= 0)."""
        c = ti.atomic_add(self.size[w], 1)
        if c < self.capacity:
            self.first[w, c], self.second[w, c] = i, j
            # The bits of a positive f32 are ordered as its value; the low half breaks ties.
            order = ti.cast(ti.bit_cast(ti.cast(due, ti.f32), ti.i32), ti.i64)
            self.bid[w, c] = ((order + 1) << 31) + i + j
            self.waiting[w] += 1
        else:
            self.overflow(w)

    @ti.func
    def count(self, w, overlaps):
        """Count pairs of a particle that overlap; stop a world in which there are too many."""
        if ti.atomic_add(self.overlaps[w], overlaps) + overlaps > CONTACTS_PER_PARTICLE * self.s.count[w]:
            self.overflow(w)

    @ti.func
    def overflow(self, w):
        """Stop a world, and accuse no particle: whose pair is one too many is up to the order of threads."""
        ti.atomic_max(self.s.failed[w], WorldStatus.CONTACT_OVERFLOW)


class FindContacts(PerParticle):
    """Look at every near pair: enter those in contact, and ask the controller about all."""

    def __init__(self, near: NeighbourList, contacts: ContactList, controller: Controller) -> None:
        super().__init__(near.s)
        self.near, self.contacts, self.controller = near, contacts, controller
        self.hard = any(event.hard for event in contacts.events)

    @ti.func
    def enter(self, w, i, j, separation):
        """Enter a pair in which something falls due; 1 when it overlaps."""
        due = ti.cast(-1.0, self.s.real)
        for event in ti.static(self.contacts.events):
            due = ti.max(due, event.contact(self.s, w, i, j, separation))
        if due >= 0.0:
            self.contacts.add(w, i, j, due)
        reach = self.s.radius[w, i] + self.s.radius[w, j]
        return ti.cast(separation.norm_sqr() <= reach * reach, ti.i32)

    @ti.func
    def run(self, w, i):
        soonest, overlaps = ti.cast(ti.math.inf, ti.f64), 0
        for k in range(self.near.size(w, i)):
            j = self.near.candidate(w, i, k)
            if j != i:
                d = self.near.domain.separation(w, self.s.position[w, i], self.s.position[w, j])
                overlaps += self.enter(w, i, j, d)
                soonest = ti.min(soonest, self.controller.pair(self.s, w, i, j, d))
        self.controller.note(self.s, w, i, soonest)
        if ti.static(self.hard):
            self.contacts.count(w, overlaps)


class FindContactsAgain(FindContacts):
    """After events: look at every near pair once more, for the controller only."""

    conditional = True

    def __init__(self, near: NeighbourList, contacts: ContactList, controller: Controller) -> None:
        super().__init__(near, contacts, controller)
        # Those that overlap have been counted.
        self.hard = False

    @ti.func
    def when(self, w):
        return self.s.events[w]

    @ti.func
    def enter(self, w, i, j, separation):
        return 0


class PerContact(Phase):
    """A loop over the contacts of this step."""

    def __init__(self, contacts: ContactList) -> None:
        self.c, self.s, self.extent = contacts, contacts.s, contacts.capacity

    @ti.func
    def size(self, w):
        return ti.min(self.c.size[w], self.c.capacity)


class OpenContacts(PerContact):
    """Forget earlier bids."""

    @ti.func
    def run(self, w, k):
        self.c.best[w, self.c.first[w, k]] = 0
        self.c.best[w, self.c.second[w, k]] = 0


class Bid(PerContact):
    """Every waiting pair bids for both its particles."""

    @ti.func
    def run(self, w, k):
        bid = self.c.bid[w, k]
        if bid > 0:
            ti.atomic_max(self.c.best[w, self.c.first[w, k]], bid)
            ti.atomic_max(self.c.best[w, self.c.second[w, k]], bid)


class Resolve(PerContact):
    """A pair that holds both its particles is resolved, if its event is still due."""

    @ti.func
    def run(self, w, k):
        c, s = self.c, self.s
        i, j, bid = c.first[w, k], c.second[w, k], c.bid[w, k]
        if bid > 0 and c.best[w, i] == bid and c.best[w, j] == bid:
            c.bid[w, k] = 0
            ti.atomic_sub(c.waiting[w], 1)
            if s.mass[w, i] > 0.0 and s.mass[w, j] > 0.0:
                d = c.domain.separation(w, s.position[w, i], s.position[w, j])
                for event in ti.static(c.events):
                    if event.contact(s, w, i, j, d) >= 0.0:
                        event.resolve(s, w, i, j, d)
                        if not ((s.velocity[w, i] + s.velocity[w, j]).norm_sqr() < ti.math.inf):
                            s.fault(w, i, event.index)
                        ti.atomic_max(s.events[w], 1)


class Rounds(Repeat):
    """Rounds of bidding until no pair waits."""

    def __init__(self, contacts: ContactList) -> None:
        super().__init__((OpenContacts(contacts), Bid(contacts), Resolve(contacts)))
        self.c = contacts

    @ti.func
    def pending(self, w):
        return self.c.waiting[w]


class ClearContacts(Phase):
    """Empty the list before a survey: a step that has failed has left it as it was."""

    def __init__(self, contacts: ContactList) -> None:
        self.c = contacts

    @ti.func
    def run(self, w, _k):
        self.c.size[w] = 0
        self.c.waiting[w] = 0
        self.c.overlaps[w] = 0


class Rearrange(Phase):
    """Let operators act on the world as a whole, and fill the slots of removed particles from the end."""

    def __init__(self, s: State, domain: Domain, operators: tuple, near: NeighbourList | None) -> None:
        self.s, self.domain, self.near, self.lists = s, domain, near, near is not None
        self.operators = tuple(o for o in operators if o.offers("world"))

    @ti.func
    def run(self, w, _k):
        s = self.s
        # Before operators too: a slot that a merger has freed has room for a fragment.
        self.fill(w)
        for operator in ti.static(self.operators):
            operator.world(s, w)
        self.fill(w)
        if s.events[w] > 0:
            # What the survey told the controller is no longer true.
            s.approach_time[w], s.fastest[w] = ti.math.inf, 0.0

    @ti.func
    def fill(self, w):
        s = self.s
        if s.changed[w] > 0:
            i = 0
            count = s.count[w]
            while i < count:
                if s.mass[w, i] > 0.0:
                    s.position[w, i] = self.domain.wrap(w, s.position[w, i])
                    i += 1
                else:
                    count -= 1
                    if i < count:
                        s.copy(w, count, i)
            s.count[w] = count
            s.changed[w] = 0
            s.events[w] = 1
            if ti.static(self.lists):
                self.near.stale[w] = 1
