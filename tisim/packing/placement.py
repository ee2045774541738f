"""Initial positions of spheres: random in a domain, a box, a ball or a cylinder, or on a lattice."""

from __future__ import annotations

import math
from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.components.component import Component, Vector, option, parameter
from tisim.components.ranges import PARTICLES, check_direction, check_resolved
from tisim.domains.domain import Domain
from tisim.errors import Words, must
from tisim.geometry.directions import along_axis
from tisim.packing import region
from tisim.packing.random_sequential import place
from tisim.packing.region import Region
from tisim.packing.tried_places import Packing


class Placement(Component):
    """Contract of a placement, which gives initial positions to spheres."""

    contract: ClassVar[bool] = True

    def sites(self) -> int | None:
        """Return the number of spheres that it can place; None if there is no fixed number."""
        return None

    def centres(self, radii: np.ndarray, domain: Domain, seed: int) -> np.ndarray:
        """Return centres, shape (n, 3) in m, of non-overlapping spheres with these radii (m), shape (n,).

        InputError is raised if there is not enough space. The centres depend on the arguments only.
        """
        raise NotImplementedError(f"{type(self).__name__} must define centres")


class RandomSequential(Placement):
    """Contract of a placement by random sequential addition within a region.

    In a batch, the spheres of all worlds are placed in parallel; the result for each world is the same as
    alone.
    """

    contract: ClassVar[bool] = True

    def region(self, radii: np.ndarray, domain: Domain) -> Region:
        """Return the region of the centres of the largest of these spheres (m), from ``inside_box``,
        ``inside_round`` or ``in_domain`` of ``tisim.packing.region``."""
        raise NotImplementedError(f"{type(self).__name__} must define region")

    def packing(self, radii: np.ndarray, domain: Domain, seed: int) -> Packing:
        """Return the packing that ``centres`` places."""
        return Packing(radii, self.region(radii, domain), seed)

    def centres(self, radii: np.ndarray, domain: Domain, seed: int) -> np.ndarray:
        return place(radii, self.region(radii, domain), seed)


class RandomInDomain(RandomSequential):
    """Spheres with random centres in the domain, by random sequential addition.

    They may extend across periodic faces of the domain, and do not overlap images if particles interact with
    images. Along a non-periodic axis they are completely inside the faces.

    Source: Z04 section 8.
    """

    def region(self, radii: np.ndarray, domain: Domain) -> Region:
        return region.in_domain(domain, float(radii.max()))


class RandomInBox(RandomSequential):
    """Spheres at random positions completely inside a box, by random sequential addition."""

    low: Vector = parameter("m", "lower corner of the box", examples=[(0.0, 0.0, 0.0)])
    high: Vector = parameter("m", "upper corner of the box", examples=[(0.01, 0.01, 0.01)])

    def region(self, radii: np.ndarray, domain: Domain) -> Region:
        return region.inside_box(np.asarray(self.low), np.asarray(self.high), float(radii.max()))


class RandomInBall(RandomSequential):
    """Spheres at random positions completely inside a ball, by random sequential addition.

    Source: Z16 sections 6.1, 9.
    """

    radius: float = parameter("m", "radius of the ball", examples=[0.01], gt=0)
    centre: Vector = parameter("m", "centre of the ball", (0.0, 0.0, 0.0))

    def region(self, radii: np.ndarray, domain: Domain) -> Region:
        half = (self.radius, self.radius, self.radius)
        return region.inside_round("ball", self.centre, half, float(radii.max()))


class RandomInCylinder(RandomSequential):
    """Spheres at random positions completely inside a cylinder, by random sequential addition."""

    centre: Vector = parameter("m", "centre of the cylinder", (0.0, 0.0, 0.0))
    axis: Vector = parameter("", "direction of the axis, of any length but 0", (0.0, 0.0, 1.0))
    radius: float = parameter("m", "radius of the cylinder", examples=[0.01], gt=0)
    length: float = parameter("m", "length of the cylinder", examples=[0.04], gt=0)

    @model_validator(mode="after")
    def _directed(self) -> Self:
        check_direction(f"{self.label}.axis", self.axis)
        return self

    def region(self, radii: np.ndarray, domain: Domain) -> Region:
        half = (self.radius, self.radius, self.length / 2)
        return region.inside_round("cylinder", (0.0, 0.0, 0.0), half, float(radii.max()))

    def centres(self, radii: np.ndarray, domain: Domain, seed: int) -> np.ndarray:
        farthest = np.abs(self.centre) + self.region(radii, domain).high
        check_resolved("places in the cylinder", farthest, float(radii.min()))
        return np.asarray(self.centre) + along_axis(super().centres(radii, domain, seed), self.axis)


class Lattice(Placement):
    """Spheres on a simple cubic lattice, or one with different spacings along the axes.

    Give the spacing or the size, not both. An axis with one site has size 0.

    Source: Z13 section 4.
    """

    shape: tuple[int, int, int] = option("number of sites along x, y and z", examples=[(3, 3, 3)])
    spacing: float | None = parameter(
        "m", "distance between neighbours, the same along all axes", None, gt=0, examples=[1e-2]
    )
    size: Vector | None = parameter("m", "distance between the first and the last site along each axis", None)
    centre: Vector = parameter("m", "centre of the lattice", (0.0, 0.0, 0.0))

    @model_validator(mode="after")
    def _sound(self) -> Self:
        must(min(self.shape) > 0, "lattice.shape", "at least 1 in each direction", self.shape)
        rule = f"of at most {PARTICLES:.0e} sites together"
        must(self.sites() <= PARTICLES, "lattice.shape", rule, self.shape)
        received = Words("both" if self.size is not None else "neither")
        must((self.spacing is None) != (self.size is None), "lattice", "given spacing or size", received)
        for n, length in zip(self.shape, self.size or (), strict=False):
            rule = "above 0 along an axis with several sites, and 0 along others"
            must(length > 0 if n > 1 else length == 0, "lattice.size", rule, self.size)
        return self

    def sites(self) -> int:
        return math.prod(self.shape)

    def steps(self) -> np.ndarray:
        """Return the distance between neighbours along each axis, m, shape (3,)."""
        gaps = np.maximum(np.asarray(self.shape) - 1, 1)
        return np.full(3, self.spacing) if self.size is None else np.asarray(self.size) / gaps

    def centres(self, radii: np.ndarray, domain: Domain, seed: int) -> np.ndarray:
        radius = float(radii.max())
        several = np.asarray(self.shape) > 1
        closest = self.steps()[several].min(initial=np.inf)
        # Sites may touch, within rounding.
        rule = f"at least a diameter, {2 * radius:g} m, apart"
        must(bool(closest >= 2 * radius * (1 - 1e-12)), "lattice sites", rule, float(closest))
        half = (np.asarray(self.shape) - 1) / 2 * self.steps()
        check_resolved("lattice sites", np.abs(self.centre) + half, radius)
        index = np.indices(self.shape).reshape(3, -1).T
        return np.asarray(self.centre) + (index - (np.asarray(self.shape) - 1) / 2) * self.steps()
