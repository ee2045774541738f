"""The shapes of inserted grains, spheres and rigid clumps of spheres, as seen by kernels."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.components.component import Component
from tisim.effects.base import Effect, option
from tisim.effects.constraint.rigid_clumps import RigidClumps
from tisim.numerics.vectors import rotated
from tisim.packing.clump import length
from tisim.packing.grains import GrainClass


class GrainShapes(Effect):
    """Each class of grains consists of spheres or of rigid clumps of spheres."""

    contract: ClassVar[bool] = True

    grains: tuple[GrainClass, ...] = option("classes of the inserted grains", min_length=1)

    @property
    def has_clumps(self) -> bool:
        """Return whether the grains of any class are rigid clumps."""
        return any(one.clump is not None for one in self.grains)

    def required_effects(self) -> tuple[type[Component], ...]:
        return (*self.requires, RigidClumps) if self.has_clumps else self.requires

    def most_spheres(self) -> int:
        """Return the largest number of spheres of a grain."""
        return max(len(one.spheres()) for one in self.grains)

    def largest_spheres(self) -> list[float]:
        """Return the radius (m) of the largest sphere that a grain of each class may have."""
        return [float(one.sizes.nodes()[0][-1] * one.spheres()[:, 3].max()) for one in self.grains]

    def longest(self) -> list[float]:
        """Return the length (m), from surface to surface, of the largest grain of each class."""
        return [
            float(one.sizes.nodes()[0][-1] * length(one.spheres()[:, :3], one.spheres()[:, 3]))
            for one in self.grains
        ]

    def farthest(self) -> float:
        """Return the largest distance (m) of a surface point of a grain from the centre of the grain."""
        return max(float(one.sizes.nodes()[0][-1]) * one.outer_radius() for one in self.grains)

    def lookups(self) -> dict[str, np.ndarray]:
        spheres = [one.spheres() for one in self.grains]
        ends = np.cumsum([len(rows) for rows in spheres])
        bodies = [
            (end - len(rows), end, one.clump is not None, one.outer_radius(), *one.inertia())
            for one, rows, end in zip(self.grains, spheres, ends, strict=True)
        ]
        return {"spheres": np.concatenate(spheres), "bodies": np.array(bodies, float)}

    @ti.func
    def first_sphere(self, c):
        """Return the index of the first sphere of a grain of class c in the list of the spheres of all
        classes."""
        return ti.cast(self.bodies[c, 0], ti.i32)

    @ti.func
    def end_sphere(self, c):
        """Return the index after the last sphere of a grain of class c."""
        return ti.cast(self.bodies[c, 1], ti.i32)

    @ti.func
    def outer(self, c, radius):
        """Return the distance (m) of the outermost point of a grain of class c and this radius (m) from its
        centre."""
        return radius * ti.cast(self.bodies[c, 3], float)

    @ti.func
    def sphere_radius(self, m, radius):
        """Return the radius (m) of sphere m of a grain of this radius (m)."""
        return radius * ti.cast(self.spheres[m, 3], float)

    @ti.func
    def sphere_mass(self, m, mass):
        """Return the mass (kg) of sphere m of a grain of this mass (kg)."""
        return mass * ti.cast(self.spheres[m, 4], float)

    @ti.func
    def offset(self, m, radius):
        """Return the position (m) of sphere m relative to the centre of a grain, along the axes of the
        grain."""
        return radius * ti.Vector([self.spheres[m, 0], self.spheres[m, 1], self.spheres[m, 2]])

    @ti.func
    def arm(self, m, q, radius):
        """Return the position (m) of sphere m relative to the centre in space, for a grain turned by q."""
        return rotated(q, self.offset(m, radius))

    @ti.func
    def join(self, s, w, c, lead, first, place, q, velocity, mass, radius):
        """Make a clump of the last inserted spheres, which form a grain of class c, from slot ``lead`` and id
        ``first`` on."""
        size = self.end_sphere(c) - self.first_sphere(c)
        if self.bodies[c, 2] > 0.0:
            for k in range(size):
                i = lead + k
                # Members are numbered by ids, which do not collide with those of initial members.
                s.clump_index[w, first + k] = i
                s.clump[w, i], s.clump_first[w, i], s.clump_member[w, i] = first, first, first + k
                s.clump_size[w, i], s.body_mass[w, i] = size, mass
                s.clump_offset[w, i] = self.offset(self.first_sphere(c) + k, radius)
            s.clump_position[w, lead], s.clump_velocity[w, lead] = place, velocity
            for k in ti.static(range(4)):
                s.clump_orientation[w, lead, k] = q[k]
            unit = ti.Vector([self.bodies[c, 4], self.bodies[c, 5], self.bodies[c, 6]])
            s.clump_inertia[w, lead] = mass * radius * radius * unit
            s.clump_volume[w, lead] = ti.cast(4.0 / 3.0 * ti.math.pi, s.real) * radius**3
