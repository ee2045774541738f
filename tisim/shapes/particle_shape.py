"""The contract of particle shapes."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, Self

import numpy as np

from tisim.components.component import Component, Vector
from tisim.components.ranges import LEAST, MOST
from tisim.errors import must

THINNEST = 1e-7
"""Smallest thickness of a shape over the diameter of its bounding sphere; a thinner one is lost to rounding
in single precision."""
BISECTIONS = 60
"""Bisections along a ray, after which its end is on the surface to rounding."""


class ParticleShape(Component):
    """A particle shape is a strictly convex solid, or one that is convex with a smooth surface.

    It is centred at the origin and symmetric under reflection in the three coordinate planes of its body
    frame, so its principal axes are x, y and z, and its support function is even. Kernels know two families:
    rods, spheres swept along a segment (``tisim/shapes/rod_pairs.py``), and superquadrics
    (``tisim/shapes/superquadric_pairs.py``). A sphere belongs to both.
    """

    contract: ClassVar[bool] = True

    @abstractmethod
    def volume(self) -> float:
        """Return the volume (m^3)."""

    @abstractmethod
    def moments(self) -> np.ndarray:
        """Return the principal moments of inertia about x, y and z per unit mass (m^2), shape (3,), for a
        uniform density."""

    @abstractmethod
    def half_extents(self) -> np.ndarray:
        """Return half the sides (m) of the smallest box along x, y and z around the shape, shape (3,)."""

    @abstractmethod
    def bounding_radius(self) -> float:
        """Return the radius (m) of the smallest sphere around the shape."""

    @abstractmethod
    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the points (m) of the shape that are farthest along directions, shape (..., 3) each. A
        direction may have any length but 0."""

    @abstractmethod
    def contains(self, points: np.ndarray) -> np.ndarray:
        """Return whether points (m, shape (..., 3)) are inside or on the surface, shape (...)."""

    def rod(self) -> tuple[float, float] | None:
        """Return half the length of the segment along z and the radius (m) as kernels for rods take them;
        None if the shape is not a rod."""
        return None

    def superquadric(self) -> tuple[Vector, Vector] | None:
        """Return the semi-axes (m) and the exponents as kernels for superquadrics take them; None if the
        shape is not a superquadric."""
        return None

    @classmethod
    def of(cls, shape: ParticleShape) -> Self | None:
        """Return the shape of this class with the form of another shape; None if there is none."""
        return shape if isinstance(shape, cls) else None

    def equal_volume_radius(self) -> float:
        """Return the radius (m) of the sphere of the same volume."""
        return float(np.cbrt(0.75 * self.volume() / np.pi))

    def contact_radius(self) -> float:
        """Return the radius (m) of the sphere by which contact laws replace the shape at a point of contact;
        by default the sphere of the same volume."""
        return self.equal_volume_radius()

    def surface_points(self, count: int) -> np.ndarray:
        """Return points (m) on the surface, shape (count, 3), accurate to rounding.

        They are the points at which rays from the centre leave the shape. The rays go through points of an
        even spiral on the sphere, scaled by the extents of the shape.
        """
        must(count > 0, "count", "greater than 0", count)
        rank = np.arange(count) + 0.5
        angle, z = np.pi * (1 + np.sqrt(5)) * rank, 1 - 2 * rank / count
        across = np.sqrt(1 - z * z)
        ray = self.half_extents() * np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=-1)
        inside, outside = np.zeros(count), 2 * self.bounding_radius() / np.linalg.norm(ray, axis=-1)
        for _ in range(BISECTIONS):
            middle = (inside + outside) / 2
            within = self.contains(middle[:, None] * ray)
            inside, outside = np.where(within, middle, inside), np.where(within, outside, middle)
        points: np.ndarray = inside[:, None] * ray
        return points


def converted(kind: type[ParticleShape], names: str, where: str, shapes: Any) -> Any:
    """Return a list of shapes as shapes of one class; other values, such as tables of a file, as they are.
    InputError, with ``where`` and the ``names`` of suitable shapes, if a shape has no equal of this class."""
    if not isinstance(shapes, list | tuple):
        return shapes
    rule = f"a {names}"
    of = [kind.of(one) if isinstance(one, ParticleShape) else one for one in shapes]
    for k, (one, shape) in enumerate(zip(of, shapes, strict=True)):
        must(one is not None, f"{where}[{k}]", rule, shape)
    return tuple(of)


def check_thickness(shape: ParticleShape) -> None:
    """Raise InputError if a shape is too thin for its length."""
    half, radius = shape.half_extents().min(), shape.bounding_radius()
    rule = f"at least {THINNEST:g} of the diameter of its bounding sphere, {2 * radius:.3g} m"
    must(bool(half >= THINNEST * radius), f"the thickness of {shape.label}", rule, float(2 * half))


def positive(name: str, values: Vector) -> None:
    """Raise InputError unless all components of a vector (m) are greater than 0 and within the limits of
    lengths."""
    must(all(value > 0 for value in values), name, "three numbers greater than 0", values)
    rule = f"three numbers from {LEAST:g} to {MOST:g} m"
    must(all(LEAST <= value <= MOST for value in values), name, rule, values)
