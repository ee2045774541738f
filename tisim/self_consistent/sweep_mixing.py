"""Anderson's mixing of the sweeps for a self-consistent quantity, of depth 1; and how it shows that there is
nothing to converge to (D. G. Anderson, J. ACM 12 (1965) 547-560).

A sweep takes the values x to f(x); r = f(x) - x is the residual. In place of f the next values are the
combination of the last two sweeps that would make the residual smallest if f were linear:

    x = f - theta (f - f_last),    theta = <r, r - r_last> / |r - r_last|^2

So values are found also where plain sweeps overshoot, and would be where there is nothing to be found: where
what others do to a particle grows with its own value by more than that value itself (an eigenvalue of f above
1), as in spheres of iron that lie in each other. Of f linear, and alike from i to j and from j to i in the
inner product, <x - x_last, r - r_last> / |x - x_last|^2 + 1 is a mean of its eigenvalues. Above 1 it shows
that one of them is: a linear law then has no solution, and of one that saturates plain sweeps go on to that
which is stable.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite
from tisim.program.phases import Phase
from tisim.program.scans import PerBlock

if TYPE_CHECKING:
    from tisim.self_consistent.self_consistent import SelfConsistentSolver

MIXING_TERMS = 5
"""The sums: <r, r - r_last>, |r - r_last|^2, <x - x_last, r - r_last>, |x - x_last|^2 and |f|^2."""
EXCESS = 1e-3
"""An eigenvalue so much above 1 is taken for one; what is less may be rounding."""
SEEN = 1e4
"""Changes of so many units in the last place show what eigenvalues there are."""


class CompareSweeps(PerBlock):
    """This phase sums what tells how a sweep differs from the last, where there was one."""

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
    """This phase chooses theta by those sums, and notes whether there is nothing to converge to."""

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
        # Where residuals grow along the way there is nothing to extrapolate to, but what plain sweeps leave.
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
