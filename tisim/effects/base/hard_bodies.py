"""Hard bodies of given shapes: the contract of their overlaps, which packing steppers remove."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.backend.taichi import ti
from tisim.effects.base.effect import SceneParts
from tisim.effects.base.pairwise import Pairwise
from tisim.errors import must
from tisim.numerics.vectors import rotated
from tisim.shapes.particle_shape import ParticleShape
from tisim.state.fields import Field

ORIENTATION = Field("orientation", "", 1, "keep", slots=4)
"""Orientation of a body, a unit quaternion w, x, y, z from its body frame to space."""
SHAPE = Field("shape", "", 1, "keep", integer=True, minimum=0.0)
"""Index of the shape of a body."""
DENSEST_PACKING = 0.75
"""Packing fraction up to which a box must be wide enough for its bodies."""
LENGTH_TOLERANCE = 1e-6
"""Tolerance of the length of the quaternions of a start; rounding in single precision is smaller."""


class HardBodies(Pairwise):
    """Hard bodies have shapes and orientations and may not overlap.

    A body is a copy of its shape, enlarged such that its bounding sphere has the radius of the particle. It
    exerts no force: a packing stepper moves and turns bodies until none overlap.

    unit : the shortest side D of the box around the first shape. Packing steppers measure lengths in it.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar = True
    memory: ClassVar[int] = 0
    fields: ClassVar = (ORIENTATION, SHAPE)

    def shapes(self) -> Sequence[ParticleShape]:
        """Return the shapes; the field ``shape`` of a particle is an index into them."""
        raise NotImplementedError

    def derived_rows(self) -> dict[str, list[float]]:
        shapes = self.shapes()
        moments = np.array([one.moments() for one in shapes])
        return {
            "bounding": [one.bounding_radius() for one in shapes],
            "volume": [one.volume() for one in shapes],
            "unit": [2 * float(shapes[0].half_extents().min())],
            **{f"moment_{axis}": moments[:, k].tolist() for k, axis in enumerate("xyz")},
        }

    def given_at_start(self, start: Mapping[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
        number, draw = len(start["mass"]), np.random.default_rng([seed, 0x0B0D])
        given = {
            SHAPE.name: np.zeros(number, int),
            ORIENTATION.name: Rotation.random(number, rng=draw).as_quat(scalar_first=True),
        }
        return {name: values for name, values in given.items() if name not in start}

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        lengths = np.linalg.norm(start[ORIENTATION.name], axis=1)
        unit = bool((np.abs(lengths - 1) <= LENGTH_TOLERANCE).all())
        must(unit, "particles.orientation", "unit quaternions", float(lengths.max(initial=1.0)))
        last = int(start[SHAPE.name].max(initial=0))
        shapes = self.shapes()
        must(last < len(shapes), "particles.shape", f"below {len(shapes)}, the shapes", last)
        low, high = scene.domain.bounds()
        if low is None or high is None or not len(lengths):
            return
        kinds = start[SHAPE.name]
        sizes = start["radius"] / np.array([one.bounding_radius() for one in shapes])[kinds]
        volume = float((np.array([one.volume() for one in shapes])[kinds] * sizes**3).sum())
        # In a box of this density two bodies must not touch on both sides at once.
        side = float((high - low).min()) * (volume / (DENSEST_PACKING * float(np.prod(high - low)))) ** (
            1 / 3
        )
        longest = 2 * float(start["radius"].max())
        wide = f"at least {2 * longest:.4g} m wide at a packing fraction of {DENSEST_PACKING:g}"
        rule = f"{wide}, twice the length of a body (take more bodies)"
        must(side >= 2 * longest, "box", rule, side)

    @ti.func
    def size(self, s, w, i):
        """Return the size of a body over the size of its shape."""
        return s.radius[w, i] / self.bounding(w, s.shape[w, i])

    @ti.func
    def turn(self, s, w, i):
        """Return the orientation of a body, a unit quaternion."""
        return ti.Vector([s.orientation[w, i, k] for k in ti.static(range(4))])

    @ti.func
    def spun(self, s, w, i, torque):
        """Return the inverse of the inertia tensor of a body times a torque.

        Both are in the units of packing steppers: masses in D^3 at density 1, lengths in D of the body.
        """
        k, q, d = s.shape[w, i], self.turn(s, w, i), self.unit(w, 0)
        square, mass = d * d, self.volume(w, k) / (d * d * d)
        back = ti.Vector([q[0], -q[1], -q[2], -q[3]])
        inside = rotated(back, torque)
        inside[0] *= square / (mass * self.moment_x(w, k))
        inside[1] *= square / (mass * self.moment_y(w, k))
        inside[2] *= square / (mass * self.moment_z(w, k))
        return rotated(q, inside)

    @ti.func
    def mass(self, s, w, i):
        """Return the mass of a body in D^3 at density 1."""
        d = self.unit(w, 0)
        return self.volume(w, s.shape[w, i]) / (d * d * d)

    @ti.func
    def closest(self, s, w, i, j, separation):
        """Return the gap between two bodies (m, negative if they overlap), the unit normal from i to j, and
        the points of contact (m), each relative to the centre of its body.

        separation : centre of j minus centre of i (m).
        """
        return separation[0], separation, separation, separation

    @ti.func
    def apart(self, s, w, i, j, separation, gap):
        """Return whether the gap between two bodies is wider than ``gap`` (m)."""
        found, _normal, _here, _there = self.closest(s, w, i, j, separation)
        return found > gap
