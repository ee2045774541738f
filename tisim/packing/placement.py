"""Where equal spheres lie at the start: at random in a domain, a box or a ball, or on a lattice."""

from __future__ import annotations

import math
from typing import ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.components.component import Component, Vector, parameter
from tisim.components.domain import Domain
from tisim.components.ranges import PARTICLES, check_resolved
from tisim.errors import InputError, must
from tisim.packing import region
from tisim.packing.random_sequential import place


class Placement(Component):
    """Places for equal spheres; the contract of a placement."""

    contract: ClassVar[bool] = True

    def sites(self) -> int | None:
        """How many spheres it has room for, where that is fixed; None where any number may be asked for."""
        return None

    def centres(self, number: int, radius: float, domain: Domain, seed: int) -> np.ndarray:
        """Centres, shape (number, 3) in m, of spheres of ``radius`` (m) that do not overlap.

        InputError when there is no room for them. Depends on the arguments alone.
        """
        raise NotImplementedError(f"{type(self).__name__} must define centres")


class RandomInDomain(Placement):
    """Random sequential addition with centres anywhere in the domain, as Z04 section 8.

    Spheres may reach over its faces, across which they keep apart where the domain is periodic.
    """

    def centres(self, number: int, radius: float, domain: Domain, seed: int) -> np.ndarray:
        low, high = domain.bounds()
        if low is None or high is None:
            raise InputError("domain must be bounded to hold a random cloud; received an open one")
        return place(number, radius, region.box(low, high, domain.periodic()), seed)


class RandomInBox(Placement):
    """Random sequential addition of spheres that lie wholly inside a box low..high (m)."""

    low: Vector = parameter("m")
    high: Vector = parameter("m")

    def centres(self, number: int, radius: float, domain: Domain, seed: int) -> np.ndarray:
        return place(
            number, radius, region.inside_box(np.asarray(self.low), np.asarray(self.high), radius), seed
        )


class RandomInBall(Placement):
    """Random sequential addition of spheres that lie wholly inside a ball (Z16 sections 6.1 and 9).

    radius : of the ball, m. centre : m.
    """

    radius: float = parameter("m", gt=0)
    centre: Vector = parameter("m", (0.0, 0.0, 0.0))

    def centres(self, number: int, radius: float, domain: Domain, seed: int) -> np.ndarray:
        return place(number, radius, region.inside_ball(np.asarray(self.centre), self.radius, radius), seed)


class Lattice(Placement):
    """A simple cubic lattice about ``centre`` (m), as the 7 x 7 x 7 array of Z13 section 4.

    shape : sites along x, y and z. Give spacing (m), the distance of neighbours, or size (m): that of the
    box from the first to the last site along each axis. An axis with one site has size 0.
    """

    shape: tuple[int, int, int]
    spacing: float | None = parameter("m", None, gt=0)
    size: Vector | None = parameter("m", None)
    centre: Vector = parameter("m", (0.0, 0.0, 0.0))

    @model_validator(mode="after")
    def _sound(self) -> Self:
        must(min(self.shape) > 0, "lattice.shape", "at least 1 in each direction", self.shape)
        rule = f"of at most {PARTICLES:.0e} sites together"
        must(self.sites() <= PARTICLES, "lattice.shape", rule, self.shape)
        given = "both" if self.size is not None else "neither"
        must((self.spacing is None) != (self.size is None), "lattice", "given spacing or size", given)
        for n, length in zip(self.shape, self.size or (), strict=False):
            rule = "above 0 along an axis with several sites, and 0 along others"
            must(length > 0 if n > 1 else length == 0, "lattice.size", rule, self.size)
        return self

    def sites(self) -> int:
        return math.prod(self.shape)

    def steps(self) -> np.ndarray:
        """Distance of neighbours along each axis, m, shape (3,)."""
        gaps = np.maximum(np.asarray(self.shape) - 1, 1)
        return np.full(3, self.spacing) if self.size is None else np.asarray(self.size) / gaps

    def centres(self, number: int, radius: float, domain: Domain, seed: int) -> np.ndarray:
        several = np.asarray(self.shape) > 1
        closest = self.steps()[several].min(initial=np.inf)
        # Touching is allowed, to rounding.
        rule = f"at least a diameter, {2 * radius:g} m, apart"
        must(bool(closest >= 2 * radius * (1 - 1e-12)), "lattice sites", rule, float(closest))
        half = (np.asarray(self.shape) - 1) / 2 * self.steps()
        check_resolved("lattice sites", np.abs(self.centre) + half, radius)
        index = np.indices(self.shape).reshape(3, -1).T
        return np.asarray(self.centre) + (index - (np.asarray(self.shape) - 1) / 2) * self.steps()
