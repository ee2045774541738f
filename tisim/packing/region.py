"""Where the centres of a random packing may lie."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tisim.components.component import Vector
from tisim.domains.domain import NO_AXIS, Axes, Domain
from tisim.errors import InputError, must
from tisim.geometry import round_box

ALL_AXES: Axes = (True, True, True)


@dataclass(frozen=True)
class Region:
    """A region is a box ``low``..``high`` (m, shape (3,) each) of the centres of spheres, or what is round
    within it (``tisim.geometry.round_box``).

    periodic : along which axes spheres see each other across opposite faces. walled : the axes along which
    spheres lie wholly inside a container, so that centres of smaller ones lie farther out. volume : m^3, of
    the container that volume fractions are of.
    """

    low: np.ndarray
    high: np.ndarray
    volume: float
    periodic: Axes = NO_AXIS
    shape: round_box.BoxShape = "box"
    walled: Axes = NO_AXIS

    @property
    def side(self) -> np.ndarray:
        """Return the lengths of the box along the axes, m, shape (3,)."""
        return self.high - self.low

    def reachable_volume(self, radius: float) -> float:
        """Return the volume that spheres of ``radius`` (m) with centres in the region can take up, m^3."""
        sides = np.where(self.periodic, self.side, self.side + 2 * radius)
        return float(round_box.volume(self.shape, sides))

    def for_radius(self, radius: float, smaller: float) -> Region:
        """Return the region of spheres that are smaller (m) than those of ``radius`` (m) that it is of."""
        wider = np.where(self.walled, radius - smaller, 0.0)
        return replace(self, low=self.low - wider, high=self.high + wider)


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
    joined = domain.joined()
    return replace(
        box(low + margin, high - margin, domain.imaged()),
        volume=float(np.prod(high - low)),
        walled=(not joined[0], not joined[1], not joined[2]),
    )


def inside_box(low: np.ndarray, high: np.ndarray, radius: float) -> Region:
    """Return the region of spheres of ``radius`` (m) wholly inside a box low..high (m)."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    room = bool((high - low > 2 * radius).all())
    must(room, "box", f"wider than a sphere, {2 * radius:g} m, in each direction", (high - low).tolist())
    return Region(low + radius, high - radius, float(np.prod(high - low)), walled=ALL_AXES)


def inside_round(shape: round_box.BoxShape, centre: Vector, half: Vector, radius: float) -> Region:
    """Return the region of spheres of ``radius`` (m) wholly inside a cylinder or ball about ``centre`` (m);
    half : m, half the sides of its box."""
    sizes = half[0] if shape == "ball" else (half[0], 2 * half[2])
    larger = "larger" if shape == "ball" else "wider and longer"
    must(min(half) > radius, shape, f"{larger} than a sphere, of radius {radius:g} m", sizes)
    middle, inner = np.array(centre), np.array(half) - radius
    volume = round_box.volume(shape, 2 * np.array(half))
    return Region(middle - inner, middle + inner, float(volume), shape=shape, walled=ALL_AXES)
