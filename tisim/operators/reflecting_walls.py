"""Reflecting walls: particles bounce off planes, and off cylinders and spheres around them, as light does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint, SceneParts
from tisim.effects.walls.placement import WallBody, wall_body
from tisim.errors import Words, must
from tisim.geometry.cylinder import CylindricalSurface
from tisim.geometry.plane import Plane
from tisim.geometry.sphere import SphericalSurface
from tisim.operators.base import Operator, option
from tisim.operators.capture import Capture
from tisim.operators.outlet import Outlet

MOST_REFLECTIONS = 64
"""Largest number of reflections of a particle in a step, at all walls together."""


class ReflectingWalls(Operator):
    """A particle that has moved into a wall in a step is mirrored at the wall, with its velocity.

        r' = r + 2 h n,    v' = v - 2 min(v.n, 0) n

    h is the depth of the particle's surface behind the wall and n the normal of the wall at its nearest
    point, towards the particles. They are on the side of a plane to which its normal points, and inside
    cylinders and spheres. Cylinders have no end here: they reach beyond ``start`` and ``end``. Reflections
    are repeated until the particle is inside all walls, as in corners.

    For Brownian particles this is the boundary without flux. Free diffusion between parallel planes has its
    exact distribution for any step; with forces and at curved walls the error is of first order in the step
    (M. Bossy, E. Gobet and D. Talay, J. Appl. Probab. 41 (2004) 877). For particles with inertia the speed is
    kept. A force F changes their energy by up to 2 |F.n| h in a reflection, and a curved wall is taken as its
    tangent plane: both errors are of first order in the step. Bodies of several particles are refused; for
    contacts with walls, use ``walls``.
    """

    excludes: ClassVar = (Constraint,)
    precedes: ClassVar = (Capture, Outlet)
    any_order: ClassVar[bool] = True
    fields: ClassVar = ("radius",)

    planes: tuple[Plane, ...] = option(
        "planes, with particles on the side to which the normals point", (), examples=[(Plane(),)]
    )
    cylinders: tuple[CylindricalSurface, ...] = option("cylinders, with particles inside", ())
    spheres: tuple[SphericalSurface, ...] = option("spheres, with particles inside", ())

    @model_validator(mode="after")
    def _some(self) -> Self:
        rule = "given, or cylinders or spheres"
        must(
            bool(self.planes or self.cylinders or self.spheres),
            f"{self.label}.planes",
            rule,
            Words("nothing"),
        )
        return self

    def depths(self, places: np.ndarray) -> np.ndarray:
        """Return the depth (m) of points behind each wall, negative inside, shape (n, walls)."""
        within = [-plane.distances(places) for plane in self.planes]
        for cylinder in self.cylinders:
            origin, axis = np.array(cylinder.start), np.subtract(cylinder.end, cylinder.start)
            away = np.cross(places - origin, axis / np.linalg.norm(axis))
            within.append(np.linalg.norm(away, axis=1) - cylinder.radius)
        for ball in self.spheres:
            within.append(np.linalg.norm(places - np.array(ball.centre), axis=1) - ball.radius)
        return np.stack(within, axis=1)

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        # Fixed particles are not reflected; those of an inlet wait anywhere.
        free = start.get("fixed", np.zeros(len(start["radius"]))) == 0
        largest = float(start["radius"].max(initial=0.0))
        radii = {f"cylinders.{k}": one.radius for k, one in enumerate(self.cylinders)}
        radii |= {f"spheres.{k}": one.radius for k, one in enumerate(self.spheres)}
        for name, radius in radii.items():
            rule = f"above the radius of the largest particle, {largest:g} m"
            must(radius > largest, f"{self.label}.{name}.radius", rule, radius)
        if free.any():
            place = start["position"][free]
            depth = self.depths(place).max(axis=1)
            worst = place[depth.argmax()].tolist()
            must(depth.max() <= 0, "particles.position", f"inside all walls of {self.label}", worst)

    @ti.func
    def particle(self, s, w, i, t, dt):
        free = True
        if ti.static(hasattr(s, "fixed")):
            free = s.fixed[w, i] == 0
        if free:
            r, v, tries, deepest = s.position[w, i], s.velocity[w, i], 0, ti.cast(1.0, s.real)
            while deepest > 0.0 and tries < MOST_REFLECTIONS:
                deepest, normal = self.deepest(w, r, s.radius[w, i])
                if deepest > 0.0:
                    r += 2.0 * deepest * normal
                    v -= 2.0 * ti.min(v.dot(normal), 0.0) * normal
                tries += 1
            s.position[w, i], s.velocity[w, i] = r, v

    @ti.func
    def deepest(self, w, r, radius):
        """Return the depth (m) of a particle's surface in the wall that it is deepest in, negative if it
        touches none, and the normal of this wall towards the particle."""
        depth, normal = 0.0 * radius - ti.math.inf, 0.0 * r
        for k in range(self.planes.size(w)):
            h = radius - self.planes.distance(w, k, r)
            if h > depth:
                depth, normal = h, self.planes.direction(w, k)
        for k in range(self.cylinders.size(w)):
            out, axis = r - self.cylinders.origin(w, k), self.cylinders.axis(w, k)
            h, inwards = self.inside(out - out.dot(axis) * axis, self.cylinders.low_radius(w, k) - radius)
            if h > depth:
                depth, normal = h, inwards
        for k in range(self.spheres.size(w)):
            h, inwards = self.inside(r - self.spheres.centre(w, k), self.spheres.radius(w, k) - radius)
            if h > depth:
                depth, normal = h, inwards
        return depth, normal

    @ti.func
    def inside(self, out, radius):
        """Return how far a vector from an axis or a centre is longer than a radius (m), and the unit vector
        back."""
        size = out.norm()
        return size - radius, -out / ti.select(size > 0.0, size, 1.0)


@wall_body.register
def _(effect: ReflectingWalls) -> WallBody:
    return WallBody(effect.label, effect.planes, (*effect.cylinders, *effect.spheres))
