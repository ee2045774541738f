"""The normal force of soft adhesive spheres."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.jump import spread
from tisim.effects.contact.granular.parts import NormalForce, Overlap
from tisim.materials.materials import Touching
from tisim.numerics.roots import cube_root

LEAST_ROOT = 1e-9
"""Lower bound of square roots of lengths, m^(1/2): the fourth power still fits f32."""
CIRCLES = 8192
"""Number of contact circles on the curve from which the force at given overlaps is interpolated."""
BEGINNING = 0.5
"""History value of a contact in its first two steps; later it is 1."""


class JKR(NormalForce):
    """Soft adhesive spheres repel and attract each other by the law of Johnson, Kendall and Roberts.

        delta = a^2/R* - 2 sqrt(pi gamma a / E*)
        F_n = 4 E* a^3 / (3 R*) - 4 sqrt(pi gamma E* a^3),    S_n = 2 E* a

    gamma is the surface energy, half the work of adhesion. Contact begins at delta = 0 with F_n = -8/9 F_c;
    the largest attraction is F_c = 3 pi gamma R*. Contact lasts to delta = -3/2 (pi gamma / E*)^(2/3)
    (R*/2)^(1/3), the end of the solution, at F_n = -5/9 F_c; LAMMPS ends it at the largest attraction. Two
    grains without load rest at delta = (pi gamma / E*)^(2/3) (3 R*)^(1/3), for any gamma: deeper overlaps
    give repulsion. Coulomb's limit uses |F_n + 2 F_c|. When a contact begins or ends, the attraction is
    ramped over two steps, so that its work does not depend on when within a step this happens (jump.py).

    Source: K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. Lond. A 324 (1971) 301; C. Thornton and
    Z. Ning, Powder Technol. 99 (1998) 154; J. S. Marshall, J. Comput. Phys. 228 (2009) 1541, for the limit.
    """

    uses: ClassVar = ("young", "poisson", "surface_energy")
    restitution_factor: ClassVar[float] = math.sqrt(5 / 6)
    adhesive: ClassVar[bool] = True
    beyond_contact: ClassVar[bool] = True
    memory: ClassVar[int] = 1

    def mix(self, pair: Touching) -> dict[str, float]:
        young, energy = pair.effective_young, pair.mixed("surface_energy")
        ratio = math.pi * energy / young
        return {
            "modulus": 2 * young,
            "bond": 2 * math.sqrt(ratio),
            "most": 3 * math.pi * energy,
            "stretch": 1.5 * (ratio * ratio / 2) ** (1 / 3),
        }

    def push(self, pair: Touching, radius: float | np.ndarray, overlap: Overlap) -> Overlap:
        if isinstance(radius, np.ndarray):
            # The law is the same at all R* for forces over R* and overlaps over its cube root.
            largest = float(radius.max())
            scaled: Overlap = radius / largest * self.push(pair, largest, overlap * np.cbrt(largest / radius))
            return scaled
        young, ratio = pair.effective_young, math.pi * pair.mixed("surface_energy") / pair.effective_young
        smallest = (0.25 * radius * radius * ratio) ** (1 / 3)  # where the equation ends
        widest = 2 * (np.sqrt(radius * np.max(overlap)) + smallest)
        circle = smallest + (widest - smallest) * np.linspace(0, 1, CIRCLES) ** 2
        depth = circle**2 / radius - 2 * np.sqrt(ratio * circle)
        force = 4 / 3 * young * circle**3 / radius - 4 * young * np.sqrt(ratio * circle**3)
        pushes: Overlap = np.interp(overlap, depth, force)
        return pushes

    @ti.func
    def circle(self, w, pair, radius, overlap):
        """Return a = x^2, with x the largest root of x^4 = c x + d, c = R* bond and d = R* delta. It is found
        with Ferrari's resolvent cubic, in a unit of length in which c and d are at most 1."""
        d, line = radius * overlap, cube_root(radius * self.bond(w, pair))
        unit = ti.max(line + ti.sqrt(ti.sqrt(ti.abs(d))), LEAST_ROOT)
        share = line / unit
        c, third = share * share * share, d / (unit * unit * unit * unit) / 3.0
        q = c * c / 16.0
        # Both are 0 without adhesion when surfaces just touch.
        first = ti.max(cube_root(q + ti.sqrt(ti.max(q * q + third * third * third, 0.0))), LEAST_ROOT)
        second = third / first
        square = first * first + third + second * second
        width = ti.sqrt(square)
        x = 0.25 * c / width + 0.5 * ti.sqrt(ti.max(4.0 * width - 0.25 * c * c / square, 0.0))
        return (unit * x) * (unit * x)

    @ti.func
    def stiffness(self, w, pair, circle):
        return self.modulus(w, pair) * circle

    @ti.func
    def elastic(self, w, pair, radius, overlap, circle):
        pressed = 2.0 / 3.0 * circle * circle * circle / radius
        return self.modulus(w, pair) * (pressed - self.bond(w, pair) * circle * ti.sqrt(circle))

    @ti.func
    def pull_off(self, w, pair, radius):
        return self.most(w, pair) * radius

    @ti.func
    def spread_jumps(self, w, pair, radius, mass, overlap, opening, begun, dt):
        speed = ti.abs(opening)
        first, last = 8.0 / 9.0 * self.most(w, pair) * radius, 5.0 / 9.0 * self.most(w, pair) * radius
        # A contact can only end at the gap of its end; at 0 it either begins or is passed again.
        left = overlap + self.separation_gap(w, pair, radius)
        ends = ti.select(opening > 0.0, 1.0 - spread(left, speed, dt, last, mass), 0.0)
        begins = ti.select(begun < 1.0, 1.0 - spread(overlap, speed, dt, first, mass), 0.0)
        beginning = (begun < 1.0) & (opening < 0.0) & (overlap < 2.0 * speed * dt)
        return first * begins + last * ends, ti.select(beginning, BEGINNING, 1.0)

    @ti.func
    def separation_gap(self, w, pair, radius):
        return self.stretch(w, pair) * cube_root(radius)

    @ti.func
    def reach(self, w, radius):
        stretch = self.stretch(w, 0)
        for pair in ti.static(range(1, self.number_of_materials**2)):
            stretch = ti.max(stretch, self.stretch(w, pair))
        return stretch * cube_root(radius)
