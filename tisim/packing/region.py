"""The region for the centres of spheres in a random packing."""

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
    """A box ``low``..``high`` (m, shape (3,) each) for the centres of spheres, or a round shape inscribed in
    it (``tisim.geometry.round_box``).

    periodic : axes along which spheres interact across opposite faces.
    walled : axes along which spheres are completely inside a container, so that centres of smaller spheres
        lie farther out.
    volume : volume of the container, to which volume fractions refer, m^3.
    """

    low: np.ndarray
    high: np.ndarray
    volume: float
    periodic: Axes = NO_AXIS
    shape: round_box.BoxShape = "box"
    walled: Axes = NO_AXIS

    @property
    def side(self) -> np.ndarray:
        """Return the side lengths of the box, m, shape (3,)."""
        return self.high - self.low

    def reachable_volume(self, radius: float) -> float:
        """Return the volume that spheres of ``radius`` (m) with centres in the region can occupy, m^3."""
        sides = np.where(self.periodic, self.side, self.side + 2 * radius)
        return float(round_box.volume(self.shape, sides))

    def for_radius(self, radius: float, smaller: float) -> Region:
        """Return the region for spheres of radius ``smaller`` (m); this region is for ``radius`` (m)."""
        wider = np.where(self.walled, radius - smaller, 0.0)
        return replace(self, low=self.low - wider, high=self.high + wider)


def box(low: np.ndarray, high: np.ndarray, periodic: Axes = NO_AXIS) -> Region:
    """Return the region of centres anywhere in a box low..high (m); spheres may extend beyond its faces."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    wide = bool((high > low).all())
    must(wide, "box", "of positive width in each direction", (high - low).tolist())
    return Region(low, high, float(np.prod(high - low)), periodic)


def in_domain(domain: Domain, radius: float) -> Region:
    """Return the region for spheres of ``radius`` (m) in a bounded domain: they may extend across joined
    faces, and are completely inside the others."""
    low, high = domain.bounds()
    if low is None or high is None:
        raise InputError("domain must be bounded to hold a random cloud; received an open one")
    margin = np.where(domain.joined(), 0.0, radius)
    fits = bool((high - low > 2 * margin).all())
    rule = f"wider than a sphere, {2 * radius:g} m, along axes that are not periodic"
    must(fits, "box", rule, (high - low).tolist())
    joined = domain.joined()
    return replace(
        box(low + margin, high - margin, domain.imaged()),
        volume=float(np.prod(high - low)),
        walled=(not joined[0], not joined[1], not joined[2]),
    )


def inside_box(low: np.ndarray, high: np.ndarray, radius: float) -> Region:
    """Return the region for spheres of ``radius`` (m) completely inside a box low..high (m)."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    fits = bool((high - low > 2 * radius).all())
    must(fits, "box", f"wider than a sphere, {2 * radius:g} m, in each direction", (high - low).tolist())
    return Region(low + radius, high - radius, float(np.prod(high - low)), walled=ALL_AXES)


def inside_round(shape: round_box.BoxShape, centre: Vector, half: Vector, radius: float) -> Region:
    """Return the region for spheres of ``radius`` (m) completely inside a cylinder or ball around ``centre``
    (m). half : half the sides of its box, m."""
    sizes = half[0] if shape == "ball" else (half[0], 2 * half[2])
    larger = "larger" if shape == "ball" else "wider and longer"
    must(min(half) > radius, shape, f"{larger} than a sphere, of radius {radius:g} m", sizes)
    middle, inner = np.array(centre), np.array(half) - radius
    volume = round_box.volume(shape, 2 * np.array(half))
    return Region(middle - inner, middle + inner, float(volume), shape=shape, walled=ALL_AXES)
