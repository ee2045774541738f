"""Where the centres of a random packing may lie."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tisim.components.domain import NO_AXIS, Axes, Domain
from tisim.errors import InputError, must


@dataclass(frozen=True)
class Region:
    """A region is a box ``low``..``high`` (m, shape (3,) each) of centres, or the ball that touches its
    faces.

    periodic : along which axes spheres see each other across opposite faces. ball : see above.
    volume : m^3, of the container that volume fractions are of.
    """

    low: np.ndarray
    high: np.ndarray
    volume: float
    periodic: Axes = NO_AXIS
    ball: bool = False

    @property
    def side(self) -> np.ndarray:
        """Return the lengths of the box along the axes, m, shape (3,)."""
        return self.high - self.low

    @property
    def centre(self) -> np.ndarray:
        """Return the centre of the box, m, shape (3,)."""
        return (self.low + self.high) / 2

    @property
    def reach(self) -> float:
        """Return the radius of the ball, m."""
        return float(self.side[0]) / 2

    def reachable_volume(self, radius: float) -> float:
        """Return the volume that spheres of ``radius`` (m) with centres in the region can take up, m^3."""
        if self.ball:
            return 4 / 3 * np.pi * (self.reach + radius) ** 3
        return float(np.prod(np.where(self.periodic, self.side, self.side + 2 * radius)))


def box(low: np.ndarray, high: np.ndarray, periodic: Axes = NO_AXIS) -> Region:
    """Return the region of centres anywhere in a box low..high (m); spheres may reach over its faces."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    wide = bool((high > low).all())
    must(wide, "box", "wider than nothing in each direction", (high - low).tolist())
    return Region(low, high, float(np.prod(high - low)), periodic)


def in_domain(domain: Domain, radius: float) -> Region:
    """Return the region of spheres of ``radius`` (m) in a domain with bounds: they may reach over faces that
    are joined, and lie wholly within the others."""
    low, high = domain.bounds()
    if low is None or high is None:
        raise InputError("domain must be bounded to hold a random cloud; received an open one")
    margin = np.where(domain.joined(), 0.0, radius)
    room = bool((high - low > 2 * margin).all())
    rule = f"wider than a sphere, {2 * radius:g} m, along axes that are not periodic"
    must(room, "box", rule, (high - low).tolist())
    return replace(box(low + margin, high - margin, domain.imaged()), volume=float(np.prod(high - low)))


def inside_box(low: np.ndarray, high: np.ndarray, radius: float) -> Region:
    """Return the region of spheres of ``radius`` (m) wholly inside a box low..high (m)."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    room = bool((high - low > 2 * radius).all())
    must(room, "box", f"wider than a sphere, {2 * radius:g} m, in each direction", (high - low).tolist())
    return Region(low + radius, high - radius, float(np.prod(high - low)))


def inside_ball(centre: np.ndarray, size: float, radius: float) -> Region:
    """Return the region of spheres of ``radius`` (m) wholly inside a ball of radius ``size`` (m)."""
    must(size > radius, "ball", f"larger than a sphere, of radius {radius:g} m", size)
    centre = np.asarray(centre, float)
    reach = size - radius
    return Region(centre - reach, centre + reach, 4 / 3 * np.pi * size**3, ball=True)
