"""The walk through a tree of cells, which sums the gravity of all particles on the particles of a leaf.

The particles of a leaf visit the same cells in the same order. On a CPU they are therefore the lanes of one
loop, which compilers vectorise. On other devices each particle is a thread, and neighbouring threads take the
same path.
"""

from typing import Any

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.effects.base.long_range import LongRangeSum
from tisim.effects.gravitation.cell_moments import CellMoments
from tisim.effects.gravitation.cell_tree import FAN, LEAF, CellTree
from tisim.program.evaluation_stage import AtStage
from tisim.program.phases import MANY, Item, Phase
from tisim.state.bound import Bound
from tisim.state.state import State


@ti.data_oriented
class TreeSum(LongRangeSum):
    """A tree sum is the acceleration of each particle by the gravity of all others.

    acceleration : m/s^2, by particle.
    """

    def __init__(self, s: State, effect: Bound[Any]) -> None:
        self.s, self.effect = s, effect
        self.t = CellTree(s)
        self.moments = CellMoments(self.t, effect)
        self.acceleration = ti.Vector.field(3, s.real)
        builder = Builder()
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(self.acceleration)
        self.tree = Tree(builder)

    def bytes(self) -> int:
        return self.t.bytes() + self.moments.bytes() + self.tree.bytes

    def phases(self) -> tuple[Item, ...]:
        return (*self.t.phases(), *self.moments.phases(), WalkTree(self))


class WalkTree(AtStage, Phase):
    """This phase sums the gravity on the particles of each leaf, on other devices than CPUs on each particle.

    All particles of a cell are within ``extent`` of its centre of mass. The cell is used as a whole if the
    box of the leaf is farther from this centre than extent / theta. Otherwise it is opened, or, if it is a
    leaf, its particles are summed.
    """

    light = False

    def __init__(self, total: TreeSum) -> None:
        self.sum, self.s, self.t, self.m = total, total.s, total.t, total.moments
        self.effect = total.effect
        self.lanes = LEAF if runtime.current().device == "cpu" else 1
        self.extent = -(-self.s.capacity // self.lanes)
        self.long = self.s.worlds < runtime.current().threads and self.s.capacity >= MANY

    @ti.func
    def size(self, w):
        return (self.s.count[w] + self.lanes - 1) // self.lanes

    @ti.func
    def run(self, w, item):
        t, real = self.t, self.s.real
        begin, count = item * self.lanes, self.s.count[w]
        leaf = begin // LEAF
        # An array for each component, as in sums over all pairs (interactions/pair_sum.py).
        place = [ti.Vector([0.0] * self.lanes, real) for _ in ti.static(range(3))]
        sums = [ti.Vector([0.0] * self.lanes, real) for _ in ti.static(range(3))]
        number = ti.Vector([float(lane) for lane in range(self.lanes)], real)
        for lane in range(self.lanes):
            # Results of lanes without a particle are not used.
            r = t.place[w, ti.min(begin + lane, count - 1)]
            for a in ti.static(range(3)):
                place[a][lane] = r[a]
        low, high = t.low[w, leaf], t.high[w, leaf]
        soft = self.effect.softening_length(w)
        level, k = t.levels[w] - 1, 0
        while level < t.levels[w]:
            c = t.first(level) + k
            if self.far(w, c, low, high):
                self.add_cell(w, c, soft, place, sums)
                level, k = t.next_cell(w, level, k)
            elif level > 0:
                level, k = level - 1, k * FAN
            else:
                if k == leaf:
                    self.add_own(w, begin, soft, place, number, sums)
                else:
                    self.add_leaf(w, k, soft, place, sums)
                level, k = t.next_cell(w, level, k)
        for lane in range(ti.min(self.lanes, count - begin)):
            i = t.order[w, begin + lane]
            for a in ti.static(range(3)):
                self.sum.acceleration[w, i][a] = sums[a][lane]

    @ti.func
    def far(self, w, c, low, high):
        """Return whether a cell is far enough from a box to be represented by its moments."""
        centre = self.m.centre[w, c]
        apart = ti.max(ti.max(low - centre, centre - high), 0.0)
        return apart.norm_sqr() > self.m.opens_within[w, c]

    @ti.func
    def add_cell(self, w, c, soft, place: ti.template(), sums: ti.template()):  # type: ignore[valid-type]
        """Add the attraction of a cell, from its mass and second moments Q about its centre.

            a = M d / s^3 + (15/2 d.Q.d / s^7 - 3/2 tr Q / s^5) d - 3 Q d / s^5,    s^2 = d^2 + eps^2

        d is the vector to the centre. It is the gradient of -(M / s + 1/2 sum Q_ab d_a d_b (1 / s)).
        """
        m = self.m
        total, centre, q, p = m.total[w, c], m.centre[w, c], m.diagonal[w, c], m.mixed[w, c]
        trace = 1.5 * q.sum()
        for lane in range(self.lanes):
            x, y, z = centre[0] - place[0][lane], centre[1] - place[1][lane], centre[2] - place[2][lane]
            inverse = 1.0 / ti.sqrt(x * x + y * y + z * z + soft * soft)
            square = inverse * inverse
            # Divided by the distance at once: in f32 its seventh power may underflow.
            x, y, z = inverse * x, inverse * y, inverse * z
            qx, qy, qz = (
                q[0] * x + p[2] * y + p[1] * z,
                p[2] * x + q[1] * y + p[0] * z,
                p[1] * x + p[0] * y + q[2] * z,
            )
            along = total + square * (7.5 * (x * qx + y * qy + z * qz) - trace)
            across = 3.0 * square
            sums[0][lane] = sums[0][lane] + square * (along * x - across * qx)
            sums[1][lane] = sums[1][lane] + square * (along * y - across * qy)
            sums[2][lane] = sums[2][lane] + square * (along * z - across * qz)

    @ti.func
    def add_leaf(self, w, k, soft, place: ti.template(), sums: ti.template()):  # type: ignore[valid-type]
        """Add the attraction of each particle of another leaf."""
        for j in range(k * LEAF, self.t.leaf_end(w, k)):
            strength, other = self.m.strength[w, j], self.t.place[w, j]
            for lane in range(self.lanes):
                x, y, z = other[0] - place[0][lane], other[1] - place[1][lane], other[2] - place[2][lane]
                inverse = 1.0 / ti.sqrt(x * x + y * y + z * z + soft * soft)
                pull = strength * inverse * (inverse * inverse)
                sums[0][lane] = sums[0][lane] + pull * x
                sums[1][lane] = sums[1][lane] + pull * y
                sums[2][lane] = sums[2][lane] + pull * z

    @ti.func
    def add_own(
        self,
        w,
        begin,
        soft,
        place: ti.template(),  # type: ignore[valid-type]
        number: ti.template(),  # type: ignore[valid-type]
        sums: ti.template(),  # type: ignore[valid-type]
    ):
        """Add the attraction between the particles of the leaf itself, without self-attraction."""
        leaf = begin // LEAF
        for j in range(leaf * LEAF, self.t.leaf_end(w, leaf)):
            strength, other, itself = (
                self.m.strength[w, j],
                self.t.place[w, j],
                ti.cast(j - begin, self.s.real),
            )
            for lane in range(self.lanes):
                x, y, z = other[0] - place[0][lane], other[1] - place[1][lane], other[2] - place[2][lane]
                inverse = 1.0 / ti.sqrt(x * x + y * y + z * z + soft * soft)
                pull = ti.select(number[lane] != itself, strength * inverse * (inverse * inverse), 0.0)
                sums[0][lane] = sums[0][lane] + pull * x
                sums[1][lane] = sums[1][lane] + pull * y
                sums[2][lane] = sums[2][lane] + pull * z
