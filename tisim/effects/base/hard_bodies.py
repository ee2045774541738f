"""Hard bodies of given shapes: the contract of their overlaps, which packing steppers remove."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.backend.taichi import ti
from tisim.effects.base.confinement import confinement
from tisim.effects.base.effect import SceneParts
from tisim.effects.base.pairwise import Pairwise
from tisim.errors import must
from tisim.numerics.vectors import rotated
from tisim.shapes.particle_shape import ParticleShape
from tisim.state.fields import Field

ORIENTATION = Field("orientation", "", 1, "keep", slots=4, recorded=True)
"""Orientation of a body, a unit quaternion w, x, y, z from its body frame to space."""
SHAPE = Field("shape", "", 1, "keep", integer=True, minimum=0.0)
"""Index of the shape of a body."""
LENGTH_TOLERANCE = 1e-6
"""Tolerance of the length of the quaternions of a start; rounding in single precision is smaller."""


class HardBodies(Pairwise):
    """Hard bodies have shapes and orientations and may not overlap.

    A body is a copy of its shape, enlarged such that its bounding sphere has the radius of the particle. It
    exerts no force: a packing stepper moves and turns bodies until none overlap.

    unit : the shortest side D of the box around the first shape. Packing steppers measure lengths in it.
    round_ends : whether each body is the hull of spheres, its ends, so that it touches curved walls there.
    """

    contract: ClassVar[bool] = True
    short_ranged: ClassVar = True
    memory: ClassVar[int] = 0
    fields: ClassVar = (ORIENTATION, SHAPE)
    round_ends: ClassVar[bool] = False

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
        around, sizes = confinement(scene), self.sizes(start)
        if around is not None and len(sizes):
            container = around.container
            same = float(np.ptp(sizes)) <= LENGTH_TOLERANCE * float(sizes.max())
            equal = same or not any(container.scaled())
            rule = f"in one ratio to their shapes, as the {container.kind()} grows with them"
            must(equal, "particles.radius", rule, float(sizes.max() / sizes.min()))

    def sizes(self, start: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the size of each body of a start over the size of its shape, shape (n,)."""
        bounding = np.array([one.bounding_radius() for one in self.shapes()])
        ratio: np.ndarray = start["radius"] / bounding[start[SHAPE.name]]
        return ratio

    def unit_of(self, start: Mapping[str, np.ndarray]) -> float:
        """Return D (m) at a start."""
        return 2 * float(self.shapes()[0].half_extents().min()) * float(self.sizes(start)[0])

    def check(self, scene: SceneParts) -> None:
        around = confinement(scene)
        if around is None:
            return
        container = around.container
        rule = f"rods or spheres in a {container.kind()}, as round ends touch curved walls"
        must(self.round_ends or not container.curved, f"effects.{self.label}", rule, self.kind())
        known = self.offers("support") and (around.treatment == "exact" or self.offers("closest_virtual"))
        must(known, f"effects.{around.label}.treatment", f"one for {self.kind()}", around.treatment)

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
