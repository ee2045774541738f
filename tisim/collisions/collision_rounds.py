"""Sudden events between pairs, such as impacts: many at once, in parallel, deterministic, conservative.

After a step has moved the particles, pairs in contact are entered into a list with the time since their event
fell due. They are then resolved in rounds. In a round every waiting pair bids for both its particles, and a
pair that holds the highest bid at both is resolved. The bid is the time since the event fell due, so earlier
events go first. Properties:

- Exclusive: a particle has one highest bid, so pairs of one round share no particle, and each is a binary
  event as the laws define it. Momentum and mass are conserved pair by pair, hence in total.
- Complete: the waiting pair with the highest bid of all always wins, so every round resolves at least one
  pair, and each pair is resolved once; the rounds end.
- Ordered: a pair waits until every earlier pair of either of its particles is resolved, and then uses the
  changed velocities, sizes and temperatures. The result equals the sequential resolution of the whole list,
  earliest first.
- Deterministic: bids are integers, compared by atomic maxima, which do not depend on order. Two pairs that
  share a particle never bid the same, as the sum of their indices breaks ties.

Simultaneous impacts are therefore also resolved one after another, and their result is the limit of
successive impacts. It conserves momentum and never gains energy, but for e < 1 it may be less symmetric than
the grains were: see docs/agglomeration.md.
"""

from tisim.backend.taichi import ti
from tisim.collisions.contact_list import ContactList
from tisim.numerics.ieee import finite
from tisim.program.phases import Phase, Repeat


class PerContact(Phase):
    """This phase loops over the contacts of this step."""

    def __init__(self, contacts: ContactList) -> None:
        self.c, self.s, self.extent = contacts, contacts.s, contacts.capacity

    @ti.func
    def size(self, w):
        return ti.min(self.c.size[w], self.c.capacity)


class OpenContacts(PerContact):
    """This phase clears the bids of the previous round."""

    @ti.func
    def run(self, w, k):
        self.c.best[w, self.c.first[w, k]] = 0
        self.c.best[w, self.c.second[w, k]] = 0


class Bid(PerContact):
    """In this phase every waiting pair bids for both its particles."""

    @ti.func
    def run(self, w, k):
        bid = self.c.bid[w, k]
        if bid > 0:
            ti.atomic_max(self.c.best[w, self.c.first[w, k]], bid)
            ti.atomic_max(self.c.best[w, self.c.second[w, k]], bid)


class Resolve(PerContact):
    """This phase resolves a pair that holds both its particles, if its event is still due."""

    @ti.func
    def run(self, w, k):
        c, s = self.c, self.s
        i, j, bid = c.first[w, k], c.second[w, k], c.bid[w, k]
        if bid > 0 and c.best[w, i] == bid and c.best[w, j] == bid:
            c.bid[w, k] = 0
            ti.atomic_sub(c.waiting[w], 1)
            if s.mass[w, i] > 0.0 and s.mass[w, j] > 0.0:
                d = c.domain.separation(w, s.position[w, i], s.position[w, j], s.time[w])
                for event in ti.static(c.events):
                    if event.contact(s, w, i, j, d) >= 0.0:
                        event.resolve(s, w, i, j, d)
                        if not finite((s.velocity[w, i] + s.velocity[w, j]).norm_sqr()):
                            s.fail_by_effect(w, i, event.index)
                        ti.atomic_max(s.events[w], 1)


class Rounds(Repeat):
    """This item repeats rounds of bidding until no pair waits."""

    def __init__(self, contacts: ContactList) -> None:
        super().__init__((OpenContacts(contacts), Bid(contacts), Resolve(contacts)))
        self.c = contacts

    @ti.func
    def pending(self, w):
        return self.c.waiting[w]
