"""Particle quantities that are set before forces are summed (``DerivedQuantity``)."""

from typing import Any

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite
from tisim.program.evaluation_stage import AtStage
from tisim.program.phases import Item, PerParticle
from tisim.state.bound import Bound
from tisim.state.state import State


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
class DerivedSolver:
    """A derived solver sets a quantity that depends only on the state of its particle, not on other particles
    or earlier values."""

    def __init__(self, s: State, effect: Bound[Any]) -> None:
        self.s, self.effect = s, effect
        declared = [f.components for f in s.fields if f.name == effect.quantity]
        if not declared:
            raise TypeError(
                f"{type(effect.data).__name__}.fields must name its quantity, {effect.quantity!r}"
            )
        self.value, self.components = getattr(s, effect.quantity), declared[0]
        vector = self.components == 3
        self.packed, self.unpacked = (_same, _same) if vector else (_packed, _unpacked)
        self.size = _length if vector else _magnitude

    def phases(self, trial: bool = False) -> tuple[Item, ...]:
        """Return the phases that set the quantity.

        trial : whether for a trial state, which may be far from any solution; values that are not finite are
        then detected in the forces.
        """
        return (SetDerived(self, trial),)

    @ti.func
    def set(self, s, w, i, t):
        """Set the quantity of particle i from its state in s."""
        nothing = self.unpacked(ti.Vector.zero(self.s.real, self.components))
        self.value[w, i] = self.effect.response(s, w, i, nothing, t)


class SetDerived(AtStage, PerParticle):
    """This phase sets value_i = response(0)."""

    def __init__(self, solver: DerivedSolver, trial: bool) -> None:
        super().__init__(solver.s)
        self.solver, self.trial = solver, trial

    @ti.func
    def run(self, w, i):
        self.solver.set(self.s, w, i, self.s.time[w])
        if ti.static(not self.trial):
            self.check(w, i)

    @ti.func
    def check(self, w, i):
        a = self.solver
        if not finite(a.size(a.value[w, i])):
            self.s.fail_by_effect(w, i, a.effect.index)
