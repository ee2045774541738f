"""Shapes and orientations of particles, and the contact of two of them: the contract of effects that give
them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.backend.taichi import ti
from tisim.effects.base.effect import Effect
from tisim.errors import must
from tisim.shapes.particle_shape import ParticleShape
from tisim.state.fields import Field

ORIENTATION = Field("orientation", "", 1, "keep", slots=4, recorded=True)
"""Orientation of a body, a unit quaternion w, x, y, z from its body frame to space."""
SHAPE = Field("shape", "", 1, "keep", integer=True, minimum=0.0)
"""Index of the shape of a body."""
LENGTH_TOLERANCE = 1e-6
"""Tolerance of the length of the quaternions of a start; rounding in single precision is smaller."""


class Shaped(Effect):
    """Particles have shapes and orientations.

    A body is a copy of its shape, enlarged such that its bounding sphere has the radius of the particle. Its
    principal moments of inertia are m R^2 times ``moment_x(w, k)`` and so on for the shape of index k, with
    the radius R of the particle. Bodies without an orientation at the start get a random one.

    moves : whether bodies move under contact laws, which then act between their surfaces. corners : number of
    points of a body that touch a plane separately.
    """

    contract: ClassVar[bool] = True
    moves: ClassVar[bool] = False
    corners: ClassVar[int] = 1
    fields: ClassVar[tuple[str | Field, ...]] = (ORIENTATION, SHAPE)

    def shapes(self) -> Sequence[ParticleShape]:
        """Return the shapes; the field ``shape`` of a particle is an index into them."""
        raise NotImplementedError

    @property
    def spheres(self) -> bool:
        """Return whether all bodies are spheres, which no force between two of them turns."""
        return False

    def structure(self) -> tuple[Any, ...]:
        # Rows of derived numbers have one for each shape.
        return (*super().structure(), len(self.shapes()))

    def derived_rows(self) -> dict[str, Sequence[float]]:
        shapes = self.shapes()
        moments = np.array([one.moments() / one.bounding_radius() ** 2 for one in shapes])
        return {
            "bounding": [one.bounding_radius() for one in shapes],
            "shape_volume": [one.volume() for one in shapes],
            "contact_radius": [one.contact_radius() for one in shapes],
            "slenderness": [min(float(one.half_extents().min()) / one.bounding_radius() for one in shapes)],
            "thickness": [float(one.half_extents().min()) for one in shapes],
            **{f"moment_{axis}": moments[:, k].tolist() for k, axis in enumerate("xyz")},
        }

    def given_at_start(self, start: Mapping[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
        number, draw = len(start["mass"]), np.random.default_rng([seed, 0x0B0D])
        given = {
            SHAPE.name: np.zeros(number, int),
            ORIENTATION.name: Rotation.random(number, rng=draw).as_quat(scalar_first=True),
        }
        return {name: values for name, values in given.items() if name not in start}

    def check_shapes(self, start: Mapping[str, np.ndarray]) -> None:
        """Raise InputError unless the orientations of a start are unit quaternions and its shapes exist."""
        lengths = np.linalg.norm(start[ORIENTATION.name], axis=1)
        unit = bool((np.abs(lengths - 1) <= LENGTH_TOLERANCE).all())
        must(unit, "particles.orientation", "unit quaternions", float(lengths.max(initial=1.0)))
        last, number = int(start[SHAPE.name].max(initial=0)), len(self.shapes())
        must(last < number, "particles.shape", f"below {number}, the shapes", last)

    def sizes(self, start: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the size of each body of a start over the size of its shape, shape (n,)."""
        bounding = np.array([one.bounding_radius() for one in self.shapes()])
        sizes: np.ndarray = start["radius"] / bounding[start[SHAPE.name].astype(int)]
        return sizes

    def thicknesses(self, start: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return half the smallest extent (m) of each body of a start, shape (n,)."""
        thickness = np.array([one.half_extents().min() for one in self.shapes()])
        half: np.ndarray = thickness[start[SHAPE.name].astype(int)] * self.sizes(start)
        return half

    def farthest_points(self, start: Mapping[str, np.ndarray], direction: np.ndarray) -> np.ndarray:
        """Return the points (m) of the bodies of a start that are farthest along their unit vectors, relative
        to their centres, shape (n, 3). direction : one for each, shape (n, 3), or one for all."""
        turns = Rotation.from_quat(start[ORIENTATION.name], scalar_first=True)
        inside = turns.apply(direction, inverse=True)
        points = np.zeros((len(start["mass"]), 3))
        for k, shape in enumerate(self.shapes()):
            these = start[SHAPE.name].astype(int) == k
            points[these] = shape.support(inside[these])
        farthest: np.ndarray = turns.apply(points * self.sizes(start)[:, None])
        return farthest

    @ti.func
    def size(self, s, w, i):
        """Return the size of a body over the size of its shape."""
        return s.radius[w, i] / self.bounding(w, s.shape[w, i])

    @ti.func
    def turn(self, s, w, i):
        """Return the orientation of a body, a unit quaternion."""
        return ti.Vector([s.orientation[w, i, k] for k in ti.static(range(4))])

    @ti.func
    def inertia(self, s, w, i):
        """Return the principal moments of inertia of a body over m R^2, with its mass m and the radius R of
        its bounding sphere."""
        k = s.shape[w, i]
        return ti.Vector([self.moment_x(w, k), self.moment_y(w, k), self.moment_z(w, k)])

    @ti.func
    def between(self, s, w, i, j, q_i, q_j, separation, far):
        """Return the gap between two bodies (m, negative if they overlap), the unit normal from i to j, and
        the points of contact (m), each relative to the centre of its body.

        q_i, q_j : unit quaternions of the orientations. separation : centre of j minus centre of i (m).
            far : gap (m) beyond which a lower bound of the gap and a normal that separates the bodies are
            sufficient.
        """
        return separation[0], separation, separation, separation

    @ti.func
    def apart(self, s, w, i, j, separation, gap):
        """Return whether the gap between two bodies is wider than ``gap`` (m)."""
        q_i, q_j = self.turn(s, w, i), self.turn(s, w, j)
        found, _normal, _here, _there = self.between(s, w, i, j, q_i, q_j, separation, gap)
        return found > gap

    @ti.func
    def beside_rod(self, s, w, i, q, separation, axis, half, radius):
        """Return the gap (m) between a body and a rod, the unit normal from the body to the rod, and the
        point of contact of the body (m), relative to its centre.

        q : orientation of the body. separation : centre of the rod minus centre of the body (m). axis : unit
        vector along the rod; 0 for a sphere. half : half the length of its segment (m). radius : m.
        """
        return separation[0], separation, separation
