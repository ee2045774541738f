"""The part of an Ewald sum of dipoles that is summed over waves: structure factors, then fields and
forces."""

import math
from typing import Any

from scipy.constants import mu_0

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.effects.base.long_range import LongRangeSum
from tisim.numerics import elementary
from tisim.program.evaluation_stage import AtStage
from tisim.program.phases import MANY, Item, PerParticle, Phase
from tisim.program.scans import BlockSums, PerBlock
from tisim.state.bound import Bound
from tisim.state.state import State


@ti.data_oriented
class WaveSum(LongRangeSum):
    """A wave sum gives the field of all dipoles of a periodic box at each dipole, and the force, except near
    pairs.

        B_i = -2 mu_0 / V sum_k g k Re[exp(-i k.r_i) S(k)] + mu_0 alpha^3 / (3 pi^(3/2)) m_i - mu_0 N M / V
        F_i =  2 mu_0 / V sum_k g k (m_i.k) Im[exp(i k.r_i) S*(k)],    g = exp(-k^2 / (4 alpha^2)) / k^2

    k_a = 2 pi n_a / L_a are summed over one half of all wave vectors, as k and -k contribute equally. They
    are arranged in columns along z. Column 0, with n_x = n_y = 0, has n_z > 0; the others follow in the order
    of n_x and n_y.

    turns : exp(i 2 pi n x_a / L_a) of each particle along each axis, for n from 0 on. amplitude : 2 mu_0 / V
    g S(k). top : the largest n_z of a column; -1 for none. moments : sums over blocks of all moments, in
    total M, A m^2. mean : -mu_0 N M / V, T. field : T. force : N.
    """

    def __init__(self, s: State, effect: Bound[Any], domain: Bound[Any], forces: bool) -> None:
        self.s, self.effect, self.domain, self.forces = s, effect, domain, forces
        self.joined = domain.data.imaged()
        x, y, self.z = self.waves = effect.data.waves
        self.first = (0, x + 1, x + y + 2)
        self.row, self.height = 2 * y + 1, 2 * self.z + 1
        self.centre = x * self.row + y
        self.columns = self.centre + 1
        self.turns, self.amplitude = (ti.Vector.field(2, s.real) for _ in range(2))
        self.mean, self.field, *force = (ti.Vector.field(3, s.real) for _ in range(2 + forces))
        self.top = ti.field(ti.i32)
        builder = Builder()
        worlds = builder.dense(ti.i, s.worlds)
        worlds.place(self.mean)
        worlds.dense(ti.j, sum(self.waves) + 3).dense(ti.k, s.capacity).place(self.turns)
        builder.dense(ti.i, s.worlds).dense(ti.j, self.columns).place(self.top)
        builder.dense(ti.i, s.worlds).dense(ti.j, self.columns * self.height).place(self.amplitude)
        for column in (self.field, *force):
            builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(column)
        if forces:
            (self.force,) = force
        self.tree, self.moments = Tree(builder), BlockSums(s, 3)

    def phases(self) -> tuple[Item, ...]:
        return (
            MeasureColumns(self),
            TurnParticles(self),
            SumMoments(self.moments),
            FieldOfPoles(self),
            StructureFactors(self),
            Waves(self),
        )

    def bytes(self) -> int:
        return self.tree.bytes + self.moments.bytes()

    @ti.func
    def period(self, w):
        """Return the periods of the images, m."""
        period = self.domain.side(w)
        for a in ti.static(range(3)):
            if ti.static(not self.joined[a]):
                period[a] *= self.effect.slab_factor(w)
        return period

    @ti.func
    def volume(self, w):
        """Return the volume of a period, m^3."""
        period = self.period(w)
        return period[0] * period[1] * period[2]

    @ti.func
    def is_inside(self, w, i):
        """Return whether a particle is between the faces of the box along an open axis."""
        inside, place, side = True, self.s.position[w, i] - self.domain.origin(w), self.domain.side(w)
        for a in ti.static(range(3)):
            if ti.static(not self.joined[a]):
                inside = inside and place[a] >= 0.0 and place[a] <= side[a]
        return inside

    @ti.func
    def wave_numbers(self, column):
        """Return n_x and n_y of a column."""
        return (self.centre + column) // self.row - self.waves[0], (
            self.centre + column
        ) % self.row - self.waves[1]

    @ti.func
    def turn(self, w, a: ti.template(), n, i):  # type: ignore[valid-type]
        """Return exp(i 2 pi n x_a / L_a) of a particle."""
        turn = self.turns[w, self.first[a] + ti.abs(n), i]
        return ti.Vector([turn[0], ti.select(n < 0, -turn[1], turn[1])])


@ti.func
def times(a, b):
    """Return the product of two complex numbers."""
    return ti.Vector([a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]])


class MeasureColumns(AtStage, Phase):
    """This phase sets the extent of each column within k_max."""

    def __init__(self, total: WaveSum) -> None:
        self.sum, self.s, self.extent = total, total.s, total.columns

    @ti.func
    def size(self, w):
        return self.extent

    @ti.func
    def run(self, w, column):
        a, unit = self.sum, 2.0 * math.pi / self.sum.period(w)
        nx, ny = a.wave_numbers(column)
        kx, ky, limit = unit[0] * nx, unit[1] * ny, a.effect.wave_cutoff(w)
        square, top = limit * limit - kx * kx - ky * ky, -1
        if square >= 0.0:
            top = ti.min(ti.cast(ti.sqrt(square) / unit[2], ti.i32), a.z)
        a.top[w, column] = top


class TurnParticles(AtStage, PerParticle):
    """This phase sets the phase factor of each wave along an axis at each particle."""

    def __init__(self, total: WaveSum) -> None:
        super().__init__(total.s)
        self.sum = total

    @ti.func
    def run(self, w, i):
        a = self.sum
        r, period = a.s.position[w, i] - a.domain.origin(w), a.period(w)
        for axis in ti.static(range(3)):
            angle = ti.f64(2.0 * math.pi) * (ti.cast(r[axis], ti.f64) / ti.cast(period[axis], ti.f64))
            one = ti.Vector([elementary.cos(angle), elementary.sin(angle)])
            turn = ti.Vector([ti.f64(1.0), ti.f64(0.0)])
            for n in range(a.waves[axis] + 1):
                a.turns[w, a.first[axis] + n, i] = ti.cast(turn, a.s.real)
                turn = times(turn, one)


class SumMoments(AtStage, PerBlock):
    """This phase sums the moments of all particles, by blocks."""

    @ti.func
    def each(self, w, i):
        return ti.cast(self.s.moment[w, i], ti.f64)


class FieldOfPoles(AtStage, Phase):
    """This phase sets the field of the poles of the sample."""

    def __init__(self, total: WaveSum) -> None:
        self.sum, self.s = total, total.s

    @ti.func
    def run(self, w, _k):
        a, total = self.sum, ti.cast(self.sum.moments.total(w), self.s.real)
        factors = a.effect.demagnetising_factors(w)
        for axis in ti.static(range(3)):
            if ti.static(not a.joined[axis]):
                factors[axis] += 1.0
        a.mean[w] = -mu_0 / a.volume(w) * (factors * total)


class StructureFactors(AtStage, Phase):
    """This phase sets the amplitude of each wave, 2 mu_0 / V g S(k)."""

    light = False

    def __init__(self, total: WaveSum) -> None:
        self.sum, self.s = total, total.s
        self.extent = total.columns * total.height
        self.long = self.s.worlds < runtime.current().threads and self.s.capacity >= MANY

    @ti.func
    def size(self, w):
        return self.extent

    @ti.func
    def run(self, w, item):
        a = self.sum
        column, nz = item // a.height, item % a.height - a.z
        if ti.abs(nz) <= a.top[w, column] and item > a.z:
            nx, ny = a.wave_numbers(column)
            k = 2.0 * math.pi * ti.Vector([nx, ny, nz]) / a.period(w)
            factor = ti.Vector.zero(self.s.real, 2)
            for i in range(self.s.count[w]):
                turn = times(times(a.turn(w, 0, nx, i), a.turn(w, 1, ny, i)), a.turn(w, 2, nz, i))
                factor += k.dot(self.s.moment[w, i]) * turn
            square, alpha = k.norm_sqr(), a.effect.screening(w)
            decay = elementary.exp(-0.25 * square / (alpha * alpha))
            a.amplitude[w, item] = 2.0 * mu_0 / a.volume(w) / square * decay * factor


class Waves(AtStage, PerParticle):
    """This phase sums the waves at each particle, and adds the self and surface terms."""

    light = False

    def __init__(self, total: WaveSum) -> None:
        super().__init__(total.s)
        self.sum = total
        self.long = self.s.worlds < runtime.current().threads and self.s.capacity >= MANY

    @ti.func
    def run(self, w, i):
        a, m, unit = self.sum, self.s.moment[w, i], 2.0 * math.pi / self.sum.period(w)
        alpha = a.effect.screening(w)
        own = mu_0 / (3.0 * math.pi**1.5) * alpha * alpha * alpha
        field, force = a.mean[w] + own * m, ti.Vector.zero(self.s.real, 3)
        for column in range(a.columns):
            nx, ny = a.wave_numbers(column)
            top, across = a.top[w, column], times(a.turn(w, 0, nx, i), a.turn(w, 1, ny, i))
            for nz in range(ti.select(column == 0, 1, -top), top + 1):
                k = unit * ti.Vector([nx, ny, nz])
                turn, wave = times(across, a.turn(w, 2, nz, i)), a.amplitude[w, column * a.height + a.z + nz]
                field -= (turn[0] * wave[0] + turn[1] * wave[1]) * k
                if ti.static(a.forces):
                    force += (turn[1] * wave[0] - turn[0] * wave[1]) * k.dot(m) * k
        if not a.is_inside(w, i):
            # The effect that uses it reports the error, as this may be a trial state that is rejected.
            field, force = ti.math.nan * field, ti.math.nan * force
        a.field[w, i] = field
        if ti.static(a.forces):
            a.force[w, i] = force
