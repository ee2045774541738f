"""Sweeps that solve for a self-consistent quantity of particles, such as induced dipoles
(``SelfConsistentQuantity``).

Sweeps are mixed by Anderson acceleration of depth 1 (D. G. Anderson, J. ACM 12 (1965) 547-560). A sweep maps
the values x to f(x), with the residual r = f(x) - x. The next values combine the last two sweeps such that
the residual would be smallest if f were linear:

    x = f - theta (f - f_last),    theta = <r, r - r_last> / |r - r_last|^2

Mixing converges also in cases in which plain sweeps overshoot. It would even return values if there is no
solution: if the feedback through the other particles exceeds the value that causes it (an eigenvalue of f
above 1), as in overlapping iron spheres. For f linear and symmetric in the inner product (the same from i to
j as from j to i), <x - x_last, r - r_last> / |x - x_last|^2 + 1 is a weighted mean of its eigenvalues. If it
is above 1, so is one of the eigenvalues. A linear law then has no solution, and for a law that saturates
plain sweeps continue to the stable solution.
"""

from typing import Any

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.domains.domain import Domain
from tisim.effects.base import DerivedQuantity, LongRange, SelfConsistentQuantity
from tisim.effects.base.derived_quantity import SWEEPS
from tisim.forces.derived import DerivedSolver
from tisim.numerics.ieee import finite
from tisim.numerics.vectors import piece
from tisim.pairs.listed_pairs import ExportedTerms, sum_phases
from tisim.pairs.pair_chunks import PairChunks
from tisim.pairs.pair_sum import ListedLaws, PairSum
from tisim.program.evaluation_stage import AtStage
from tisim.program.phases import Item, PerParticle, Phase, Repeat
from tisim.program.scans import BlockSums, PerBlock
from tisim.state.bound import Bound
from tisim.state.state import State
from tisim.state.status import WorldStatus

ROUNDING_UNITS = 4.0
"""Changes of this many units in the last place count as none; sweeps in f32 might otherwise never end."""


class SelfConsistentSolver(DerivedSolver):
    """A self-consistent solver computes the sweeps of a quantity that depends on its values on other
    particles.

    changes : the largest change of a particle in this sweep, the last one, and the one before.
    before : the largest value before the first sweep.
    once : whether a step makes a single sweep as long as that suffices.
    mixed : whether sweeps are mixed with the last one.
    """

    def __init__(
        self,
        s: State,
        effect: Bound[Any],
        domain: Bound[Domain],
        pairs: PairChunks | None,
    ) -> None:
        super().__init__(s, effect)
        self.domain, self.pairs = domain, pairs
        listed = pairs is not None and effect.data.short_ranged
        self.exported = ExportedTerms(pairs, self.components) if pairs and listed else None
        self.once, self.most = effect.data.sweeps == 0, effect.data.sweeps or SWEEPS
        self.mixed = effect.data.acceleration == "anderson"
        self.next, *memory = (self.column() for _ in range(3 if self.mixed else 1))
        self.pending, self.sweeps, self.unconverged = (ti.field(ti.i32) for _ in range(3))
        self.largest, self.before, *self.changes = (ti.field(s.real) for _ in range(5))
        builder = Builder()
        for column in (self.next, *memory):
            builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(column)
        if self.mixed:
            self.last, self.residual = memory
            self.theta, self.unsolvable = ti.field(ti.f64), ti.field(ti.i32)
            builder.dense(ti.i, s.worlds).place(self.theta)
            builder.dense(ti.i, s.worlds).place(self.unsolvable)
            self.sums = BlockSums(s, MIXING_TERMS)
        limits = (self.largest, self.before, *self.changes)
        for column in (self.pending, self.sweeps, self.unconverged, *limits):
            builder.dense(ti.i, s.worlds).place(column)
        self.tree = Tree(builder)

    def column(self) -> Any:
        """Return a field for values of the quantity."""
        return ti.Vector.field(3, self.s.real) if self.components == 3 else ti.field(self.s.real)

    def phases(self, trial: bool = False) -> tuple[Item, ...]:
        return BeginSweeps(self), SweepUntilConverged(self, trial)

    def bytes(self) -> int:
        """Return the device memory, in bytes."""
        parts = (self.exported, self.sums if self.mixed else None)
        return self.tree.bytes + sum(part.bytes() for part in parts if part)


class BeginSweeps(AtStage, PerParticle):
    """This phase requests a sweep from the last values, or from zero if these are not finite."""

    def __init__(self, solver: SelfConsistentSolver) -> None:
        super().__init__(solver.s)
        self.solver = solver

    @ti.func
    def run(self, w, i):
        a = self.solver
        if i == 0:
            a.pending[w], a.sweeps[w], a.unconverged[w] = 1, 0, 0
            a.largest[w], a.before[w] = 0.0, 0.0
            for change in ti.static(a.changes):
                change[w] = 0.0
        if not finite(a.size(a.value[w, i])):
            a.value[w, i] = a.unpacked(ti.Vector.zero(self.s.real, a.components))


class SweepUntilConverged(Repeat):
    """This item repeats the sweeps of a world until it has converged."""

    def __init__(self, solver: SelfConsistentSolver, trial: bool) -> None:
        far = solver.effect.sum.phases() if isinstance(solver.effect.data, LongRange) else ()
        sweep = (*far, *sum_phases(JacobiSweep(solver, trial), solver.exported))
        mixing = (CompareSweeps(solver), ChooseMixing(solver)) if solver.mixed else ()
        super().__init__((*sweep, *mixing, ReplaceValues(solver, trial), CheckConvergence(solver)))
        self.solver, self.usual = solver, 1 if solver.once else 2

    @ti.func
    def pending(self, w):
        return self.solver.pending[w]


class JacobiSweep(PairSum):
    """This sweep sets next_i = (1 - a) value_i + a response(sum_j influence(value_j))."""

    def __init__(self, solver: SelfConsistentSolver, trial: bool) -> None:
        super().__init__(solver.s, solver.domain, (solver.effect,), solver.pairs)
        self.solver, self.effect, self.trial = solver, solver.effect, trial
        self.components = solver.components

    def together(self, laws: tuple[Any, ...]) -> ListedLaws:
        return ListedLaws(laws, 2 * self.components, remember=False)

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        return self.solver.packed(effect.influence(self.s, w, i, j, separation, distance, t))

    @ti.func
    def write_sum(self, w, i, total):
        self.solver.next[w, i] = self.solver.unpacked(total)

    @ti.func
    def read_sum(self, w, i):
        return self.solver.packed(self.solver.next[w, i])

    @ti.func
    def compute_pair(self, laws: ti.template(), w, m, i, j, separation, distance, t):  # type: ignore[valid-type]
        here = self.term(self.effect, w, i, j, separation, distance, t)
        there = self.term(self.effect, w, j, i, -separation, distance, t)
        values = ti.Vector.zero(self.s.real, laws.values)
        for k in ti.static(range(self.components)):
            values[k], values[self.components + k] = here[k], there[k]
        return values

    @ti.func
    def pair_contributions(self, values):
        return piece(values, 0, self.components), piece(values, self.components, self.components)

    @ti.func
    def finish(self, w, i, total, t):
        a, part = self.solver, self.effect.relaxation(w)
        new = self.effect.response(self.s, w, i, a.unpacked(total), t)
        a.next[w, i] = (1.0 - part) * a.value[w, i] + part * new
        size, before = a.size(new), a.size(a.value[w, i])
        if a.sweeps[w] == 0 and before > a.before[w]:
            ti.atomic_max(a.before[w], before)
        largest = size
        if ti.static(a.once):
            # After a field is switched off, the previous value sets the scale of the remaining one.
            largest = ti.max(size, before)
        if largest > a.largest[w]:
            ti.atomic_max(a.largest[w], largest)
        if ti.static(not self.trial):
            self.check(w, i, size)

    @ti.func
    def check(self, w, i, size):
        """Fail a world with a value that is not finite.

        In the first sweep this is a fault of the effect; in later sweeps it counts as a failure to converge.
        """
        if not finite(size):
            if self.solver.sweeps[w] == 0:
                self.s.fail_by_effect(w, i, self.effect.index)
            else:
                fail_to_converge(self.s, w, i, self.effect)


class ReplaceValues(PerParticle):
    """This phase replaces the old values by the new ones, and records the change."""

    def __init__(self, solver: SelfConsistentSolver, trial: bool) -> None:
        super().__init__(solver.s)
        self.solver, self.effect, self.trial = solver, solver.effect, trial
        real = np.float64 if solver.s.real == ti.f64 else np.float32
        self.least = ROUNDING_UNITS * float(np.finfo(real).eps)

    @ti.func
    def run(self, w, i):
        a = self.solver
        new, residual = a.next[w, i], a.next[w, i] - a.value[w, i]
        change, unsolvable = a.size(residual), False
        a.value[w, i] = new
        if ti.static(a.mixed):
            if a.theta[w] != 0.0:
                a.value[w, i] = new - ti.cast(a.theta[w], self.s.real) * (new - a.last[w, i])
            a.last[w, i], a.residual[w, i] = new, residual
            unsolvable = a.unsolvable[w] > 0
        if change > a.changes[0][w]:
            ti.atomic_max(a.changes[0][w], change)
        relative = ti.max(self.effect.relaxation(w) * self.tolerance(w), self.least)
        on = change > relative * a.largest[w]
        if on and not unsolvable and a.sweeps[w] + 1 < a.most:
            ti.atomic_max(a.unconverged[w], 1)
        # Values that vanish after a field is switched off change by the same factor in every sweep; what
        # remains at the last one is compared with the values before.
        elif (on and change > relative * a.before[w]) or unsolvable:
            if ti.static(self.trial):
                # The forces are then not finite, and the step is rejected.
                a.value[w, i] *= ti.math.nan
            else:
                fail_to_converge(self.s, w, i, self.effect)

    @ti.func
    def tolerance(self, w):
        """Return the relative change, over the largest value, below which no further sweep is made."""
        tolerance = self.effect.tolerance(w)
        if ti.static(self.solver.once):
            first = self.solver.sweeps[w] == 0
            tolerance = ti.select(first, self.effect.largest_change(w), tolerance)
        return tolerance


@ti.func
def fail_to_converge(s, w, i, effect: ti.template()):  # type: ignore[valid-type]
    s.fail(w, WorldStatus.NOT_CONVERGED, i)
    ti.atomic_min(s.failing_effect[w], effect.index)


class CheckConvergence(Phase):
    """This phase decides from the changes of a sweep whether to make another one."""

    def __init__(self, solver: SelfConsistentSolver) -> None:
        self.solver = solver

    @ti.func
    def run(self, w, _k):
        a, s = self.solver, self.solver.s
        s.mutual_sweeps[w] += 1
        now, last, before = ti.static(a.changes)
        if before[w] > 0.0 and finite(now[w]):
            # Mean over two sweeps: if positive and negative influences balance, changes alternate in size.
            s.sweep_factor[w] = ti.sqrt(now[w] / before[w])
        s.sweep_change[w] = now[w] / ti.select(a.largest[w] > 0.0, a.largest[w], 1.0)
        before[w], last[w], now[w] = last[w], now[w], 0.0
        a.sweeps[w] += 1
        a.pending[w] = a.unconverged[w]
        a.unconverged[w] = 0
        if ti.static(not a.once):
            a.largest[w] = 0.0


def solver(
    s: State, effect: Bound[DerivedQuantity], domain: Bound[Domain], pairs: PairChunks | None
) -> DerivedSolver:
    """Return the solver for the quantity of an effect."""
    return (
        SelfConsistentSolver(s, effect, domain, pairs)
        if isinstance(effect.data, SelfConsistentQuantity)
        else DerivedSolver(s, effect)
    )


MIXING_TERMS = 5
"""The sums: <r, r - r_last>, |r - r_last|^2, <x - x_last, r - r_last>, |x - x_last|^2 and |f|^2."""
EXCESS = 1e-3
"""An eigenvalue is taken to be above 1 if it exceeds 1 by this much; a smaller excess may be rounding."""
SEEN = 1e4
"""Changes of at least this many units in the last place are used to estimate eigenvalues."""


class CompareSweeps(PerBlock):
    """This phase sums the terms that compare a sweep with the last one, from the second sweep on."""

    conditional = True

    def __init__(self, solver: SelfConsistentSolver) -> None:
        super().__init__(solver.sums)
        self.solver, self.effect = solver, solver.effect

    @ti.func
    def when(self, w):
        return ti.cast(self.solver.sweeps[w] > 0, ti.i32)

    @ti.func
    def each(self, w, i):
        a = self.solver
        x, f = ti.cast(a.packed(a.value[w, i]), ti.f64), ti.cast(a.packed(a.next[w, i]), ti.f64)
        f_last = ti.cast(a.packed(a.last[w, i]), ti.f64)
        r_last = ti.cast(a.packed(a.residual[w, i]), ti.f64)
        r = f - x
        change, moved = r - r_last, x - (f_last - r_last)
        weight = ti.cast(self.effect.weight(self.s, w, i), ti.f64)
        return weight * ti.Vector(
            [r.dot(change), change.norm_sqr(), moved.dot(change), moved.norm_sqr(), f.norm_sqr()]
        )


class ChooseMixing(Phase):
    """This phase chooses theta from those sums, and detects that there is no solution."""

    def __init__(self, solver: SelfConsistentSolver) -> None:
        self.solver = solver
        real = np.float64 if solver.s.real == ti.f64 else np.float32
        self.seen = (SEEN * float(np.finfo(real).eps)) ** 2

    @ti.func
    def run(self, w, _k):
        a = self.solver
        a.theta[w], a.unsolvable[w] = 0.0, 0
        if a.sweeps[w] > 0:
            self.compare(w, a.sums.total(w))

    @ti.func
    def compare(self, w, total):
        a = self.solver
        # If residuals grow along the change there is no value to extrapolate to, and the plain sweep is kept.
        if total[1] > 0.0 and total[2] <= 0.0 and finite(total[0]) and finite(total[1]):
            a.theta[w] = total[0] / total[1]
        if ti.static(a.effect.data.linear):
            self.look_for_growth(w, total)

    @ti.func
    def look_for_growth(self, w, total):
        a = self.solver
        if total[3] > self.seen * total[4] and finite(total[2]):
            excess = total[2] / total[3] / ti.cast(a.effect.relaxation(w), ti.f64)
            if excess > EXCESS:
                a.unsolvable[w], a.s.sweep_factor[w] = 1, 1.0 + excess
