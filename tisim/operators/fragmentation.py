"""Fragmentation of agglomerates that absorb too much kinetic energy (Z04 section 5).

All broken grains of a step write their pieces into memory slots in parallel.
"""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.effects.impact.heating import Heating
from tisim.effects.impact.impact import Impact
from tisim.effects.impact.law import ImpactLaw
from tisim.errors import must
from tisim.numerics import elementary
from tisim.operators.base import AddsParticles, parameter
from tisim.program.phases import Item, PerParticle, Phase, Repeat, WorldAction
from tisim.program.scans import PrefixSum
from tisim.state.bound import Bound, Peers
from tisim.state.fields import Field, WorldField
from tisim.state.state import State
from tisim.state.status import WorldStatus


class Fragmentation(ImpactLaw, AddsParticles):
    """A grain that absorbs much kinetic energy in an impact breaks into equal pieces.

        b = b_0 / (dK / (4 pi gamma b_0^2) + 1)       radius of pieces whose surface costs dK     (5.2)
        n = b_0^3 / b^3                               number of pieces
        dZ = gamma (n 4 pi b^2 - 4 pi b_0^2)          energy of the new surface                   (6.8)

    dK is the absorbed kinetic energy and b_0 the radius of the grain. The grain breaks when b / b_0 is below
    the threshold. n is rounded down, and no piece is lighter than an original grain. The pieces form a
    cluster of touching spheres with the same centre of mass and velocity. Mass, momentum and kinetic energy
    are conserved; dZ is taken from the grain's heat. A grain that breaks does not bond in that impact. Z04
    remark 5.1 uses a threshold of 1/2.

    Source: Z04 Eqs (5.1)-(5.3).
    """

    fields = (
        "radius",
        "mass",
        Field("pieces", "", 1, "keep", integer=True),
        Field("fracture_energy", "J", 1, "sum"),
    )
    world_fields = (WorldField("fractures", "counter"), WorldField("fracture_due", "integer"))
    requires: ClassVar = (Impact,)

    surface_energy: float = parameter("J/m^2", "surface energy gamma", examples=[10.0], gt=0)
    grain_mass: float | None = parameter(
        "kg",
        "mass of an original grain, the smallest piece; default: mass of the lightest initial particle",
        None,
        gt=0,
    )
    threshold: float = parameter(
        "",
        "ratio b / b_0 below which a grain breaks; the default gives at least two pieces",
        2.0 ** (-1.0 / 3.0),
        gt=0,
        lt=1,
    )

    def at_start(self, masses: np.ndarray) -> Self:
        return self.model_copy(update={"grain_mass": self._grain(masses)})

    def capacity(self, masses: np.ndarray) -> int:
        # A particle lighter than an original grain stays one piece.
        return int(np.maximum(masses / self._grain(masses), 1.0).sum() * (1 + 1e-9))

    def _grain(self, masses: np.ndarray) -> float:
        known = self.grain_mass is not None or len(masses) > 0
        must(known, f"{self.label}.grain_mass", "given if a scene starts without particles", None)
        return float(masses.min()) if self.grain_mass is None else self.grain_mass

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"heating": peers.of(Heating)}

    @ti.func
    def fracture(self, s, w, i, absorbed):
        radius = s.radius[w, i]
        surface = 4.0 * ti.math.pi * self.surface_energy(w) * radius * radius
        shrink = absorbed / surface + 1.0
        # The tolerance keeps rounding from losing the last piece of a grain.
        most = ti.cast(s.mass[w, i] / self.grain_mass(w) * (1.0 + 1e-6), ti.i32)
        pieces = ti.cast(ti.min(shrink**3 * (1.0 + 1e-12), ti.cast(most, s.real)), ti.i32)
        # A grain that an earlier impact of this step has broken neither breaks again nor bonds.
        broke = ti.cast(s.pieces[w, i] >= 2, ti.i32)
        if shrink * self.threshold(w) > 1.0 and pieces >= 2 and broke == 0:
            energy = surface * (elementary.pow(ti.cast(pieces, s.real), 1.0 / 3.0) - 1.0)
            s.pieces[w, i] = pieces
            s.fracture_energy[w, i] = s.fracture_energy[w, i] + energy
            for law in ti.static(self.heating):
                s.temperature[w, i] = law.temperature(s, w, i, -energy)
            ti.atomic_add(s.fractures[w], 1)
            ti.atomic_max(s.fracture_due[w], 1)
            broke = 1
        return broke

    @ti.func
    def acts(self, s, w):
        return s.fracture_due[w]

    def world_action(self, own: Bound[Any], s: State) -> WorldAction:
        return Fractures(own, s)

    @ti.func
    def split(self, s, w, i, n, before):
        """Put n equal pieces at the first n sites of a cubic block of touching spheres about the old centre;
        before : number of new pieces of other grains that precede these in memory."""
        edge = 1
        while edge * edge * edge < n:
            edge += 1
        middle = 0.0 * s.position[w, i]
        for k in range(n):
            middle += self.site(k, edge) / n
        centre = s.position[w, i]
        for field in ti.static(s.sums):
            field[w, i] /= n
        s.radius[w, i] *= elementary.pow(ti.cast(n, s.real), -1.0 / 3.0)
        for k in range(n):
            piece = i
            if k > 0:
                piece = s.append_uncounted(w, i, before + k - 1)
            s.position[w, piece] = centre + 2.0 * s.radius[w, i] * (self.site(k, edge) - middle)

    @ti.func
    def site(self, k, edge):
        """Return the k-th site of a cubic block, in diameters."""
        return ti.Vector([k % edge, k // edge % edge, k // (edge * edge)])


@ti.data_oriented
class Fractures(WorldAction):
    """The new pieces of a world's broken grains take the slots after the last one in use, in the order of the
    grains.

    new : number of additional pieces of each grain (one less than its number of pieces), then the cumulative
    sum of it up to and including the grain.
    """

    def __init__(self, fragmentation: Bound[Fragmentation], s: State) -> None:
        self.fragmentation, self.s = fragmentation, s
        self.new = ti.field(ti.i32)
        builder = Builder()
        builder.dense(ti.i, s.worlds).dense(ti.j, s.capacity).place(self.new)
        self.tree = Tree(builder)
        self.sums = PrefixSum(s, PerParticle(s), self.new, self.new)

    def phases(self) -> tuple[Item, ...]:
        return (SplitGrains(self),)

    def bytes(self) -> int:
        return self.tree.bytes + self.sums.bytes()


class SplitGrains(Repeat):
    """This item splits all broken grains of a world."""

    usual = 0

    def __init__(self, fractures: Fractures) -> None:
        find = (CountPieces(fractures), *fractures.sums.phases())
        super().__init__((*find, SplitGrain(fractures), EndFractures(fractures)))
        self.s = fractures.s

    @ti.func
    def pending(self, w):
        return self.s.fracture_due[w]


class CountPieces(PerParticle):
    """This phase counts the new pieces of each grain."""

    def __init__(self, fractures: Fractures) -> None:
        super().__init__(fractures.s)
        self.fractures = fractures

    @ti.func
    def run(self, w, i):
        self.fractures.new[w, i] = ti.max(self.s.pieces[w, i] - 1, 0)


class SplitGrain(PerParticle):
    """This phase splits each broken grain. If there is not enough memory for all pieces, none is split, and
    the first grain whose pieces do not fit stops the world."""

    def __init__(self, fractures: Fractures) -> None:
        super().__init__(fractures.s)
        self.fractures, self.fragmentation = fractures, fractures.fragmentation

    @ti.func
    def run(self, w, i):
        s, fractures, n = self.s, self.fractures, self.s.pieces[w, i]
        if n >= 2:
            s.pieces[w, i] = 0
            upto, free = fractures.new[w, i], s.free_slots(w)
            before = upto - (n - 1)
            if fractures.sums.total[w] <= free:
                self.fragmentation.split(s, w, i, n, before)
            elif before <= free < upto:
                s.fail(w, WorldStatus.OUT_OF_CAPACITY, i)


class EndFractures(Phase):
    """This phase counts the new pieces as particles."""

    def __init__(self, fractures: Fractures) -> None:
        self.s, self.fractures = fractures.s, fractures

    @ti.func
    def run(self, w, _k):
        self.s.lengthen(w, self.fractures.sums.total[w])
        self.s.fracture_due[w] = 0
