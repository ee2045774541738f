"""Anderson's acceleration of the fixed-point iteration (D. G. Anderson, J. ACM 12 (1965) 547-560), of depth
1.

The unknown is the force x used for an iterate; f(x) is the force at that iterate, and r = f(x) - x the
residual. Instead of x = f, the next x is the combination of the last two that would minimise the residual if
f were linear: x = f - theta (f - f_last), theta = <r, r - r_last> / |r - r_last|^2. Forces enter the inner
product as the displacements that they would cause. Torques are treated together with forces.
"""

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite
from tisim.program.phases import Item, PerParticle
from tisim.program.scans import BlockSums, PerBlock
from tisim.state.fields import Field
from tisim.steppers.context import StepContext


def memory_of_iterates(turning: bool) -> tuple[Field, ...]:
    """Return the fields of the force used for an iterate, of the last force, and of its residual; also for
    torques."""
    names = [("force", "N"), *([("torque", "N m")] if turning else [])]
    return tuple(
        Field(f"{name}_{what}", unit, 3, "keep", scratch=True)
        for name, unit in names
        for what in ("used", "last", "residual")
    )


def accelerated(context: StepContext, forces: tuple[Item, ...], sums: BlockSums) -> tuple[Item, ...]:
    """Return the phases ``forces`` within an iteration, and the phases that mix the result with the last
    one."""
    return (Used(context), *forces, Compare(context, sums), Mix(context, sums))


class Mixed:
    """The mixed quantities, each with its value, the used value, the value of the last iterate, its residual,
    and whether it is a torque."""

    def __init__(self, context: StepContext) -> None:
        s = context.s
        names = ("force", "torque") if context.turning else ("force",)
        self.columns = tuple(
            (*(getattr(s, name + what) for what in ("", "_used", "_last", "_residual")), name == "torque")
            for name in names
        )


class Used(PerParticle):
    """This phase stores the force used for the present iterate."""

    def __init__(self, context: StepContext) -> None:
        super().__init__(context.s)
        self.columns = Mixed(context).columns

    @ti.func
    def run(self, w, i):
        for column in ti.static(self.columns):
            column[1][w, i] = column[0][w, i]


class Compare(PerBlock):
    """This phase sums <r, r - r_last> and |r - r_last|^2, as displacements."""

    def __init__(self, context: StepContext, sums: BlockSums) -> None:
        super().__init__(sums)
        self.columns = Mixed(context).columns

    @ti.func
    def each(self, w, i):
        s = self.s
        total = ti.Vector.zero(ti.f64, 2)
        for column in ti.static(self.columns):
            inertia = s.mass[w, i]
            if ti.static(column[4]):
                # A torque moves the surface like a force of 5/2 times torque over R: I = 2/5 m R^2.
                inertia *= 0.4 * s.radius[w, i]
            here = (column[0][w, i] - column[1][w, i]) / inertia
            change = here - column[3][w, i] / inertia
            total += ti.cast(ti.Vector([here.dot(change), change.norm_sqr()]), ti.f64)
        return total


class Mix(PerParticle):
    """This phase takes x = f - theta (f - f_last), or f itself if theta is not defined, as in the
    first iteration."""

    def __init__(self, context: StepContext, sums: BlockSums) -> None:
        super().__init__(context.s)
        self.columns, self.sums = Mixed(context).columns, sums

    @ti.func
    def run(self, w, i):
        s = self.s
        total = self.sums.total(w)
        theta = ti.cast(0.0, ti.f64)
        if s.solver_iteration[w] > 1 and total[1] > 0.0 and finite(total[0]):
            theta = total[0] / total[1]
        for column in ti.static(self.columns):
            new, last = column[0][w, i], column[2][w, i]
            column[3][w, i] = new - column[1][w, i]
            column[2][w, i] = new
            if theta != 0.0:
                column[0][w, i] = new - ti.cast(theta, s.real) * (new - last)
