"""Sweeps that settle a quantity which particles give each other, such as induced dipoles (effect.Mutual)."""

from typing import ClassVar

from tisim._taichi import ti
from tisim.domain import Domain
from tisim.effect import Mutual
from tisim.halves import Halves
from tisim.pairs import PairSum
from tisim.program import PerParticle, Phase, Repeat
from tisim.state import UNSETTLED, State


@ti.func
def _length(value):
    return value.norm()


@ti.func
def _magnitude(value):
    return ti.abs(value)


@ti.func
def _packed(number):
    return ti.Vector([number])


@ti.func
def _unpacked(vector):
    return vector[0]


@ti.func
def _same(vector):
    return vector


@ti.data_oriented
class Settling:
    """One mutual quantity on its way: the values of the next sweep, and whether there must be one."""

    def __init__(self, s: State, domain: Domain, effect: Mutual, halves: Halves | None) -> None:
        self.s, self.domain, self.effect, self.halves = s, domain, effect, halves
        declared = [f.components for f in s.fields if f.name == effect.quantity]
        if not declared:
            raise TypeError(f"{type(effect).__name__}.needs must name its quantity, {effect.quantity!r}")
        self.value, self.components = getattr(s, effect.quantity), declared[0]
        self.next = ti.Vector.field(3, s.real) if self.components == 3 else ti.field(s.real)
        self.size = _length if self.components == 3 else _magnitude
        self.pending, self.sweeps, self.again = (ti.field(ti.i32) for _ in range(3))
        self.largest = ti.field(s.real)
        builder = ti.FieldsBuilder()
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(self.next)
        for column in (self.pending, self.sweeps, self.again, self.largest):
            builder.dense(ti.i, s.worlds).place(column)
        self._tree = builder.finalize()

    def phases(self, again: bool = False) -> tuple[Phase | Repeat, ...]:
        """Settle it; ``again``, only in worlds where events have changed who is where."""
        start = (StartAgain if again else Start)(self)
        return (start, Sweeps(self))

    def bytes(self) -> int:
        """Device memory, in bytes."""
        real = 8 if self.s.real == ti.f64 else 4
        return self.s.worlds * (real * (1 + self.components * self.s.capacity) + 12)

    def destroy(self) -> None:
        """Give the memory back."""
        ti.sync()
        self._tree.destroy()

    @ti.func
    def start(self, w):
        self.pending[w], self.sweeps[w], self.again[w], self.largest[w] = 1, 0, 0, 0.0


class Start(Phase):
    """There must be a sweep."""

    def __init__(self, settling: Settling) -> None:
        self.settling = settling

    @ti.func
    def run(self, w, _k):
        self.settling.start(w)


class StartAgain(Start):
    """The same after events."""

    conditional: ClassVar[bool] = True

    @ti.func
    def when(self, w):
        return self.settling.s.events[w]


class Sweeps(Repeat):
    """Sweep until it has settled."""

    def __init__(self, settling: Settling) -> None:
        super().__init__((Sweep(settling), Take(settling), Judge(settling)))
        self.settling = settling

    @ti.func
    def pending(self, w):
        return self.settling.pending[w]


class Sweep(PairSum):
    """next_i = response(sum_j influence(value_j))."""

    def __init__(self, settling: Settling) -> None:
        super().__init__(settling.s, settling.domain, (settling.effect,), settling.halves)
        self.settling, self.effect, self.components = settling, settling.effect, settling.components
        self.packed, self.unpacked = (_packed, _unpacked) if self.components == 1 else (_same, _same)

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        influence = effect.influence(self.s, w, i, j, separation, distance, t)
        return self.packed(influence)

    @ti.func
    def finish(self, w, i, total, t):
        new = self.effect.response(self.s, w, i, self.unpacked(total), t)
        self.settling.next[w, i] = new
        size = self.settling.size(new)
        if size > self.settling.largest[w]:
            ti.atomic_max(self.settling.largest[w], size)
        # Not below infinity: also true of NaN.
        if not (size < ti.math.inf):
            self.s.fault(w, i, self.effect.index)


class Take(PerParticle):
    """The new values take the place of the old, and are compared with them."""

    def __init__(self, settling: Settling) -> None:
        super().__init__(settling.s)
        self.settling, self.effect = settling, settling.effect

    @ti.func
    def run(self, w, i):
        a, s = self.settling, self.s
        change = a.size(a.next[w, i] - a.value[w, i])
        a.value[w, i] = a.next[w, i]
        if ti.static(self.effect.sweeps > 0):
            unsettled = change > self.effect.tolerance(w) * a.largest[w]
            if unsettled and a.sweeps[w] + 1 < self.effect.sweeps:
                ti.atomic_max(a.again[w], 1)
            elif unsettled:
                s.fail(w, UNSETTLED, i)
                ti.atomic_min(s.blame[w], self.effect.index)


class Judge(Phase):
    """One sweep more, or none."""

    def __init__(self, settling: Settling) -> None:
        self.settling = settling

    @ti.func
    def run(self, w, _k):
        a = self.settling
        a.s.mutual_sweeps[w] += 1
        a.sweeps[w] += 1
        a.pending[w] = a.again[w]
        a.again[w], a.largest[w] = 0, 0.0
