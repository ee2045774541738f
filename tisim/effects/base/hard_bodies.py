"""Hard bodies of given shapes: the contract of their overlaps, which packing steppers remove."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base.effect import SceneParts
from tisim.effects.base.pairwise import Pairwise
from tisim.effects.base.shaped import SHAPE, Shaped
from tisim.errors import must
from tisim.numerics.vectors import conjugate, rotated

DENSEST_PACKING = 0.75
"""Packing fraction up to which a box must be wide enough for its bodies."""


class HardBodies(Shaped, Pairwise):
    """Hard bodies have shapes and orientations and may not overlap.

    They exert no forces: a packing stepper moves and turns bodies until none overlap.

    unit : the shortest side D of the box around the first shape. Packing steppers measure lengths in it.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar = True
    memory: ClassVar[int] = 0

    def derived_rows(self) -> dict[str, list[float]]:
        return {**super().derived_rows(), "unit": [2 * float(self.shapes()[0].half_extents().min())]}

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        self.check_shapes(start)
        low, high = scene.domain.bounds()
        if low is None or high is None or not len(start["mass"]):
            return
        volumes = np.array([one.volume() for one in self.shapes()])[start[SHAPE.name].astype(int)]
        volume = float((volumes * self.sizes(start) ** 3).sum())
        # In a box of this density two bodies must not touch on both sides at once.
        side = float((high - low).min()) * (volume / (DENSEST_PACKING * float(np.prod(high - low)))) ** (
            1 / 3
        )
        longest = 2 * float(start["radius"].max())
        wide = f"at least {2 * longest:.4g} m wide at a packing fraction of {DENSEST_PACKING:g}"
        rule = f"{wide}, twice the length of a body (take more bodies)"
        must(side >= 2 * longest, "box", rule, side)

    @ti.func
    def spun(self, s, w, i, torque):
        """Return the inverse of the inertia tensor of a body times a torque.

        Both are in the units of packing steppers: masses in D^3 at density 1, lengths in D of the body.
        """
        q, length = self.turn(s, w, i), self.bounding(w, s.shape[w, i]) / self.unit(w, 0)
        moments = self.mass(s, w, i) * length * length * self.inertia(s, w, i)
        return rotated(q, rotated(conjugate(q), torque) / moments)

    @ti.func
    def mass(self, s, w, i):
        """Return the mass of a body in D^3 at density 1."""
        d = self.unit(w, 0)
        return self.shape_volume(w, s.shape[w, i]) / (d * d * d)

    @ti.func
    def closest(self, s, w, i, j, separation):
        """Return the gap between two bodies (m, negative if they overlap), the unit normal from i to j, and
        the points of contact (m), each relative to the centre of its body.

        separation : centre of j minus centre of i (m).
        """
        return self.between(
            s, w, i, j, self.turn(s, w, i), self.turn(s, w, j), separation, ti.cast(ti.math.inf, s.real)
        )
