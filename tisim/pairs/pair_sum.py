"""Sums over the other particles in a fixed order, independent of the physics.

On a CPU a sum over all pairs is computed for a tile of particles at once, one per lane. The inner loop runs
over the lanes without branches, and its sums have no other readers, so compilers vectorise it. Each particle
adds up the others in the order of their indices, for any tile size.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics.roots import inverse_root
from tisim.program.evaluation_stage import AtStage
from tisim.program.phases import PerParticle

if TYPE_CHECKING:
    from tisim.domains.domain import Domain
    from tisim.pairs.pair_chunks import PairChunks
    from tisim.state.bound import Bound
    from tisim.state.state import State


TILE = 32
"""Particles of a tile. This measured best of 8 to 128 with AVX-512: the sums of more particles do not fit the
registers, and shorter loops are unrolled before they are vectorised. From 96 on some kernels are not
vectorised."""


VECTOR_BYTES = 32
"""The widest vectors used (256 bits); a tile computes a whole number of them."""


class ListedLaws:
    """Laws of a sum that are computed together for each listed pair within the range of any of them.

    placed : each law with the index of its contact history among the values of a pair.
    remembering : the placed laws that have a contact history. reaching : the laws that act beyond contact.
    values : number of values of a pair.
    """

    def __init__(self, laws: tuple[Any, ...], begin: int, remember: bool) -> None:
        placed, self.values = [], begin
        for law in laws:
            placed.append((law, self.values))
            self.values += law.data.memory if remember else 0
        self.placed = tuple(placed)
        # Sums that must not update the history have no room for it in their values.
        self.remembering = tuple(one for one in placed if remember and one[0].data.memory)
        self.reaching = tuple(law for law in laws if law.data.reaches())


class PairSum(AtStage, PerParticle):
    """A pair sum is, for each particle, a sum over all other particles, then over listed pairs.

    A subclass defines the initial value in ``start``, the contribution of one other particle in ``term``, and
    the use of the result in ``finish``; ``components`` is the length of the sum. With listed pairs it also
    defines ``write_sum`` and ``read_sum`` for intermediate sums, ``compute_pair`` for the vector of values of
    a pair by some of the laws, and ``pair_contributions`` for the terms added to both particles.

    commits : whether the sum may update the contact history, by ``write_memory``.
    by_inverse : whether the terms of all pairs are computed by ``term_by_inverse``.
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
        # A tile may extend past the live particles, but not past the last slot.
        self.tiled = bool(self.long_ranged) and runtime.current().device == "cpu" and s.capacity >= TILE

    @ti.func
    def start(self, w, i, t):
        """Return the initial value of the sum of i; a vector of ``components``."""
        return ti.Vector.zero(self.s.real, self.components)

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        """Return the contribution of j to the sum of i; a vector of ``components``."""
        return ti.Vector.zero(self.s.real, self.components)

    @ti.func
    def term_by_inverse(self, effect: ti.template(), w, i, j, separation, inverse, t):  # type: ignore[valid-type]
        """Return the contribution of j to the sum of i, given 1 / distance (1/m)."""
        return ti.Vector.zero(self.s.real, self.components)

    @ti.func
    def finish(self, w, i, total, t):
        """Use the finished sum of i."""

    @ti.func
    def write_sum(self, w, i, total):
        """Store the intermediate sum of i."""

    @ti.func
    def read_sum(self, w, i):
        """Return the intermediate sum of i."""
        return ti.Vector.zero(self.s.real, self.components)

    def listed_laws(self) -> tuple[ListedLaws, ...]:
        """Return the short-ranged laws in groups that are computed together: laws truncated far from contact,
        and the others."""
        cut = tuple(law for law in self.short_ranged if law.data.truncated)
        close = tuple(law for law in self.short_ranged if not law.data.truncated)
        return tuple(self.together(laws) for laws in (close, cut) if laws)

    def together(self, laws: tuple[Any, ...]) -> ListedLaws:
        """Return laws as one group that is computed together."""
        raise NotImplementedError

    @ti.func
    def compute_pair(self, laws: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        """Return the values of listed pair m of i and j for some laws, a vector of ``laws.values``; i has the
        lower id.

        The values are terms of the sums and contact history. This function writes nothing, because pairs are
        computed side by side and some more than once.
        """
        return ti.Vector.zero(self.s.real, laws.values)

    @ti.func
    def pair_contributions(self, values):
        """Return the contributions of the values of a pair to the sums of i and of j."""
        nothing = ti.Vector.zero(self.s.real, self.components)
        return nothing, nothing

    @ti.func
    def combine(self, a, b):
        """Return two partial sums of listed pairs as one; a maximum is also possible, whose start is 0."""
        return a + b

    @ti.func
    def updates_memory(self, w):
        """Return whether the current sum updates the contact history."""
        return False

    @ti.func
    def write_memory(self, laws: ti.template(), w, m, values):  # type: ignore[valid-type]
        """Store the contact history of listed pair m from the values computed for it."""

    @ti.func
    def out_of_reach(self, laws: ti.template(), w, m):  # type: ignore[valid-type]
        """Handle listed pair m, which is beyond the range of all of these laws."""

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
        """End the sum of i over all others: store it if listed pairs follow, or finish it."""
        if ti.static(len(self.short_ranged) > 0):
            self.write_sum(w, i, total)
        else:
            self.finish(w, i, total, t)

    @ti.func
    def tile(self, w, begin, t):
        """Sum over the others for a tile of particles from ``begin`` on; results of lanes without a particle
        are not read."""
        n = self.s.count[w]
        first, end = ti.min(begin, self.s.capacity - TILE), ti.min(begin + TILE, n)
        # Vectors without any live particle are skipped.
        vector = ti.static(VECTOR_BYTES // (8 if self.s.real == ti.f64 else 4))
        low, high = (begin - first) // vector * vector, (end - first + vector - 1) // vector * vector
        # One array for each component. With a single array of 96 numbers, some kernels read parameters again
        # for each pair and were not vectorised (presumably LLVM stops following its uses when it checks for
        # aliases; each initial value counts as one use).
        sums = [ti.Vector([0.0] * TILE, self.s.real) for _ in ti.static(range(self.components))]
        # Lane numbers are reals as wide as the sums: comparing 64-bit integers would halve the lanes in f32.
        number = ti.Vector([float(lane) for lane in range(TILE)], self.s.real)
        inverses = ti.Vector([0.0] * TILE, self.s.real)
        for i in range(begin, end):
            total = self.start(w, i, t)
            for c in ti.static(range(self.components)):
                sums[c][i - first] = total[c]
        for j in range(n):
            itself = ti.cast(j - first, self.s.real)
            if ti.static(self.by_inverse):
                # Loops of a length known to the compiler are faster by a tenth.
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
        """Add the terms of j to the sums of the lanes, given 1 / distance.

        All inverses are computed first, as work that waits for a root would keep the processor from starting
        the next root.
        """
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
        """Return the terms of j for i; zero if j is i."""
        total = ti.Vector.zero(self.s.real, self.components)
        if i != j:
            total = self.terms(effects, w, i, j, t)
        return total

    @ti.func
    def separation(self, w, i, j, t):
        """Return the separation r_j - r_i (m) used by forces."""
        return self.domain.separation(w, self.s.position[w, i], self.s.position[w, j], t)

    @ti.func
    def terms(self, effects: ti.template(), w, i, j, t):  # type: ignore[valid-type]
        """Return the terms of j for i; j must not be i."""
        d = self.separation(w, i, j, t)
        distance = d.norm()
        total = self.term(effects[0], w, i, j, d, distance, t)
        for effect in ti.static(effects[1:]):
            total += self.term(effect, w, i, j, d, distance, t)
        return total
