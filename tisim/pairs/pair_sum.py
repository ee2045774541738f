"""Sums over the other particles, in a fixed order; they know no physics.

On a CPU, sums over all pairs are made for a tile of particles at once, one lane each: the inner loop is over
the lanes, without a branch, and its sums have no other readers, so compilers vectorise it.
The order in which a particle adds up the others is that of their indices all the same, whatever the tile.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics.roots import inverse_root
from tisim.program.occasion import OnOccasion
from tisim.program.phases import PerParticle

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.pairs.pair_chunks import PairChunks
    from tisim.state.bound import Bound
    from tisim.state.state import State


TILE = 32
"""A tile has this many particles. It measured best of 8 to 128 with AVX-512: the sums of more do not fit the
registers, and loops over fewer are unrolled before they are vectorised. From 96 on some kernels are not
vectorised."""


VECTOR_BYTES = 32
"""The widest vectors used (256 bits); the lanes of a tile that are computed are a whole number of them."""


class ListedLaws:
    """These laws of a sum are computed together for each listed pair within the reach of one of them.

    placed : each law with where what it has a pair remember begins among the values of a pair. remembering :
    those that have any. reaching : the laws that act beyond contact. values : how many numbers a pair comes
    to.
    """

    def __init__(self, laws: tuple[Any, ...], begin: int, remember: bool) -> None:
        placed, self.values = [], begin
        for law in laws:
            placed.append((law, self.values))
            self.values += law.data.memory if remember else 0
        self.placed = tuple(placed)
        # Values have no room for memory where the sum may not advance it.
        self.remembering = tuple(one for one in placed if remember and one[0].data.memory)
        self.reaching = tuple(law for law in laws if law.data.reaches())


class PairSum(OnOccasion, PerParticle):
    """A pair sum is, for each particle, a sum over the others: all of them, then those near enough to be
    listed.

    A subclass says what the sum begins with, in ``start``, what one other contributes, in ``term``, and what
    becomes of it, in ``finish``; ``components`` is its length. Where pairs are listed it also says where the
    sum is kept meanwhile, in ``write_sum`` and ``read_sum``, what is computed for a pair by some of the laws,
    a vector, in ``compute_pair``, and what of it is added to the sums of the two, in ``pair_contributions``.

    commits : whether what pairs remember may be brought up to date with the sum, by ``write_memory``.
    by_inverse : whether terms of all pairs are made by ``term_by_inverse``.
    """

    components: int = 3
    by_inverse: bool = False
    commits: ClassVar[bool] = False

    def __init__(
        self,
        s: "State",
        domain: "Bound[Domain]",
        effects: Sequence[Any],
        pairs: "PairChunks | None",
    ) -> None:
        super().__init__(s)
        self.domain, self.pairs = domain, pairs
        self.long_ranged = tuple(e for e in effects if not e.short_ranged)
        self.short_ranged = tuple(e for e in effects if e.short_ranged)
        self.others = s.capacity if self.long_ranged else 0
        # A tile may reach past the particles alive, but not past the slots that there are.
        self.tiled = bool(self.long_ranged) and runtime.current().device == "cpu" and s.capacity >= TILE

    @ti.func
    def start(self, w, i, t):
        """Return what the sum of i begins with; a vector of ``components``."""
        return ti.Vector.zero(self.s.real, self.components)

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        """Return what j contributes to the sum of i; a vector of ``components``."""
        return ti.Vector.zero(self.s.real, self.components)

    @ti.func
    def term_by_inverse(self, effect: ti.template(), w, i, j, separation, inverse, t):  # type: ignore[valid-type]
        """Return what j contributes to the sum of i, given 1 / distance (1/m)."""
        return ti.Vector.zero(self.s.real, self.components)

    @ti.func
    def finish(self, w, i, total, t):
        """Make use of the sum of i."""

    @ti.func
    def write_sum(self, w, i, total):
        """Store the sum of i so far."""

    @ti.func
    def read_sum(self, w, i):
        """Return the sum of i so far."""
        return ti.Vector.zero(self.s.real, self.components)

    def listed_laws(self) -> tuple[ListedLaws, ...]:
        """Return the short-ranged laws, those that are computed together as one: what is truncated far from
        contact, and the others."""
        cut = tuple(law for law in self.short_ranged if law.data.truncated)
        close = tuple(law for law in self.short_ranged if not law.data.truncated)
        return tuple(self.together(laws) for laws in (close, cut) if laws)

    def together(self, laws: tuple[Any, ...]) -> ListedLaws:
        """Return laws as they are computed together."""
        raise NotImplementedError

    @ti.func
    def compute_pair(self, laws: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        """Return what is summed or remembered, by some laws, of listed pair m of i and j, a vector of
        ``laws.values``; i has the lower id. It writes nothing: pairs are computed side by side, and some more
        than once."""
        return ti.Vector.zero(self.s.real, laws.values)

    @ti.func
    def pair_contributions(self, values):
        """Return what the values computed for a pair add to the sums of i and of j."""
        nothing = ti.Vector.zero(self.s.real, self.components)
        return nothing, nothing

    @ti.func
    def updates_memory(self, w):
        """Return whether what pairs remember is now brought up to date with the sum."""
        return False

    @ti.func
    def write_memory(self, laws: ti.template(), w, m, values):  # type: ignore[valid-type]
        """Store what listed pair m remembers from now on, by the values computed for it."""

    @ti.func
    def out_of_reach(self, laws: ti.template(), w, m):  # type: ignore[valid-type]
        """Take note that listed pair m is farther apart than any of these laws reaches."""

    @ti.func
    def run(self, w, i):
        t = self.s.time[w]
        if ti.static(self.tiled):
            if i % TILE == 0:
                self.tile(w, i, t)
        else:
            total = self.start(w, i, t)
            if ti.static(len(self.long_ranged) > 0):
                for j in range(self.s.count[w]):
                    total += self.terms_of(self.long_ranged, w, i, j, t)
            self.end_sum(w, i, total, t)

    @ti.func
    def end_sum(self, w, i, total, t):
        """End the sum of i over all others: store it for the listed pairs, or finish it where there are
        none."""
        if ti.static(len(self.short_ranged) > 0):
            self.write_sum(w, i, total)
        else:
            self.finish(w, i, total, t)

    @ti.func
    def tile(self, w, begin, t):
        """Sum over the others for a tile of particles from ``begin`` on; what lanes without one compute,
        nobody reads."""
        n = self.s.count[w]
        first, end = ti.min(begin, self.s.capacity - TILE), ti.min(begin + TILE, n)
        # Vectors of lanes in which none has a particle are left out.
        vector = ti.static(VECTOR_BYTES // (8 if self.s.real == ti.f64 else 4))
        low, high = (begin - first) // vector * vector, (end - first + vector - 1) // vector * vector
        # An array for each component: with one of 96 numbers for all, some kernels read parameters again for
        # each pair and did not vectorise (presumably it has more uses than LLVM follows to see that nothing
        # else points to it; each number it starts with is one).
        sums = [ti.Vector([0.0] * TILE, self.s.real) for _ in ti.static(range(self.components))]
        # Numbers of lanes as wide as the sums: comparing integers of 64 bits would halve the lanes in f32.
        number = ti.Vector([float(lane) for lane in range(TILE)], self.s.real)
        inverses = ti.Vector([0.0] * TILE, self.s.real)
        for i in range(begin, end):
            total = self.start(w, i, t)
            for c in ti.static(range(self.components)):
                sums[c][i - first] = total[c]
        for j in range(n):
            itself = ti.cast(j - first, self.s.real)
            if ti.static(self.by_inverse):
                # Loops of a length that compilers know are faster by a tenth.
                if high - low == TILE:
                    self.add_by_inverse(w, first, j, 0, TILE, number, inverses, sums, t)
                else:
                    self.add_by_inverse(w, first, j, low, high, number, inverses, sums, t)
            else:
                for lane in range(low, high):
                    terms = self.terms(self.long_ranged, w, first + lane, j, t)
                    for c in ti.static(range(self.components)):
                        total = sums[c][lane]
                        sums[c][lane] = ti.select(number[lane] != itself, total + terms[c], total)
        for i in range(begin, end):
            total = ti.Vector.zero(self.s.real, self.components)
            for c in ti.static(range(self.components)):
                total[c] = sums[c][i - first]
            self.end_sum(w, i, total, t)

    @ti.func
    def add_by_inverse(
        self,
        w,
        first,
        j,
        low,
        high,
        number: ti.template(),  # type: ignore[valid-type]
        inverses: ti.template(),  # type: ignore[valid-type]
        sums: ti.template(),  # type: ignore[valid-type]
        t,
    ):
        """Add the terms of j to the sums of lanes, by 1 / distance, which is made by itself: what waits for a
        root would keep the processor from starting the next."""
        itself = ti.cast(j - first, self.s.real)
        for lane in range(low, high):
            inverse = inverse_root(self.separation(w, first + lane, j, t).norm_sqr())
            inverses[lane] = ti.select(number[lane] != itself, inverse, 0.0)
        for lane in range(low, high):
            d = self.separation(w, first + lane, j, t)
            for effect in ti.static(self.long_ranged):
                terms = self.term_by_inverse(effect, w, first + lane, j, d, inverses[lane], t)
                for c in ti.static(range(self.components)):
                    sums[c][lane] = sums[c][lane] + terms[c]

    @ti.func
    def terms_of(self, effects: ti.template(), w, i, j, t):  # type: ignore[valid-type]
        """Return the terms of j for i; none of itself."""
        total = ti.Vector.zero(self.s.real, self.components)
        if i != j:
            total = self.terms(effects, w, i, j, t)
        return total

    @ti.func
    def separation(self, w, i, j, t):
        """Return r_j - r_i (m), as forces see it."""
        return self.domain.separation(w, self.s.position[w, i], self.s.position[w, j], t)

    @ti.func
    def terms(self, effects: ti.template(), w, i, j, t):  # type: ignore[valid-type]
        """Return the terms of j for i, which are not the same."""
        d = self.separation(w, i, j, t)
        distance = d.norm()
        total = self.term(effects[0], w, i, j, d, distance, t)
        for effect in ti.static(effects[1:]):
            total += self.term(effect, w, i, j, d, distance, t)
        return total
