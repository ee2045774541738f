"""Hard bodies of given shapes: the contract of their overlaps, which packing steppers remove."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base.effect import SceneParts
from tisim.effects.base.pairwise import Pairwise
from tisim.effects.base.shaped import Shaped
from tisim.numerics.vectors import conjugate, rotated


class HardBodies(Shaped, Pairwise):
    """Hard bodies have shapes and orientations and may not overlap.

    They exert no forces: a packing stepper moves and turns bodies until none overlap.

    unit : the shortest side D of the box around the first shape. Packing steppers measure lengths in it.
    round_ends : whether each body is the hull of spheres, its ends, so that it touches curved walls there.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar = True
    memory: ClassVar[int] = 0
    round_ends: ClassVar[bool] = False

    def derived_rows(self) -> dict[str, Sequence[float]]:
        return {**super().derived_rows(), "unit": [2 * float(self.shapes()[0].half_extents().min())]}

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        self.check_shapes(start)

    def unit_of(self, start: Mapping[str, np.ndarray]) -> float:
        """Return D (m) at a start."""
        return 2 * float(self.shapes()[0].half_extents().min()) * float(self.sizes(start)[0])

    @ti.func
    def spun(self, s, w, i, torque):
        """Return the inverse of the inertia tensor of a body times a torque.

        Both are in the units of packing steppers: masses in D^3 at density 1, lengths in D of the body.
        """
        length = self.bounding(w, s.shape[w, i]) / self.unit(w, 0)
        moments = self.mass(s, w, i) * length * length * self.inertia(s, w, i)
        spin = torque / moments
        if ti.static(not self.spheres):
            q = self.turn(s, w, i)
            spin = rotated(q, rotated(conjugate(q), torque) / moments)
        return spin

    @ti.func
    def mass(self, s, w, i):
        """Return the mass of a body in D^3 at density 1."""
        d = self.unit(w, 0)
        return self.shape_volume(w, s.shape[w, i]) / (d * d * d)

    @ti.func
    def half_width(self, s, w, i):
        """Return half the shortest side (m) of the box around a body: the radius of a rod."""
        return self.size(s, w, i) * self.thickness(w, s.shape[w, i])

    @ti.func
    def closest(self, s, w, i, j, separation, far):
        """Return the gap between two bodies (m, negative if they overlap), the unit normal from i to j, and
        the points of contact (m), each relative to the centre of its body. A gap wider than ``far`` may be a
        lower bound, not below ``far``.

        separation : centre of j minus centre of i (m). far : m; negative where shallow overlaps do not count.
        """
        return self.between(s, w, i, j, self.turn(s, w, i), self.turn(s, w, j), separation, far)

    @ti.func
    def end_count(self, s, w, i):
        """Return the number of convex ends whose hull is the body: 2 for a rod, which may touch a wall with
        both, and 1 for a body that is its own end."""
        return 1

    @ti.func
    def end_centre(self, s, w, i, k):
        """Return the centre of end k (m), relative to the centre of the body."""
        return 0.0 * s.position[w, i]

    @ti.func
    def support(self, s, w, i, k, direction):
        """Return the farthest point of end k along a unit vector (m), relative to the centre of the body."""
        return direction

    @ti.func
    def closest_virtual(self, s, w, i, point, outward, along):
        """Return gap, normal and points of contact, as ``closest``, of a body and a virtual one: a copy of it
        with its z axis along the unit vector ``along``, beyond a wall that it touches.

        point : of the wall at which it touches (m, relative to the centre of the body). outward : unit normal
            of the wall there, towards the virtual body.
        """
        return point[0], point, point, point
