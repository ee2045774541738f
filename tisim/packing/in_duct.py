"""Random initial positions of spheres in a duct with a variable radius."""

from __future__ import annotations

import itertools
from typing import Self

import numpy as np
from pydantic import model_validator
from scipy.spatial import cKDTree

from tisim.components.component import Vector, parameter
from tisim.components.ranges import check_resolved
from tisim.domains.domain import Domain
from tisim.errors import InputError, must
from tisim.packing.placement import Placement

MOST_FILLED = 0.5
"""Largest volume fraction of spheres in a duct; near random close packing, overlaps cannot be removed."""
MOST_PUSHES = 2000
"""Largest number of rounds of pushing spheres apart."""
CLEARANCE = 0.01
"""Spheres are pushed apart to this gap, relative to their radii, so that the last overlaps vanish soon."""


class RandomInDuct(Placement):
    """Spheres at random positions completely inside an upright round duct with a radius that varies along it.

    They fill at most half of its volume. The duct has ``radii`` at ``heights`` above its lower end, and is
    conical in between; its axis is along z. If the domain is periodic along z, the duct must have the length
    of the domain and equal radii at both ends, and continues across the faces; otherwise spheres lie between
    its ends. Positions are drawn uniformly, and then overlapping spheres are pushed apart and away from the
    wall until no overlaps remain. The method is not limited to the saturation fraction of random sequential
    addition, 0.38, which is even lower near walls.
    """

    centre: Vector = parameter("m", "middle of the lower end", (0.0, 0.0, 0.0))
    heights: tuple[float, ...] = parameter(
        "m", "heights at which the radius is given, increasing from 0", examples=[(0.0, 0.01, 0.03)]
    )
    radii: tuple[float, ...] = parameter("m", "radius at each height", examples=[(0.005, 0.01, 0.01)])

    @model_validator(mode="after")
    def _sound(self) -> Self:
        where, n = self.label, len(self.heights)
        must(n > 1, f"{where}.heights", "two or more", n)
        rising = self.heights[0] == 0 and bool((np.diff(self.heights) > 0).all())
        must(rising, f"{where}.heights", "rising from 0", self.heights)
        must(len(self.radii) == n, f"{where}.radii", f"{n}, one for each height", len(self.radii))
        must(min(self.radii) > 0, f"{where}.radii", "above 0", self.radii)
        return self

    def volume(self) -> float:
        """Return the volume of the duct, m^3, as a sum of truncated cones."""
        a, b = np.array(self.radii[:-1]), np.array(self.radii[1:])
        return float((np.pi / 3 * np.diff(self.heights) * (a * a + a * b + b * b)).sum())

    def radius_at(self, height: np.ndarray) -> np.ndarray:
        """Return the radius of the duct (m) at heights above its lower end (m)."""
        return np.interp(height, self.heights, self.radii)

    def centres(self, radii: np.ndarray, domain: Domain, seed: int) -> np.ndarray:
        length, largest = self.heights[-1], float(radii.max())
        fraction = float((4 / 3 * np.pi * radii**3).sum()) / self.volume()
        rule = f"at most {MOST_FILLED:g} in a duct in which they can be pushed apart"
        must(fraction <= MOST_FILLED, "volume fraction", rule, float(f"{fraction:.4g}"))
        must(
            min(self.radii) > largest, "duct", f"wider than a sphere, {2 * largest:g} m", 2 * min(self.radii)
        )
        check_resolved("places in the duct", np.abs(self.centre) + length, float(radii.min()))
        endless = domain.imaged()[2]
        if endless:
            side, rule = float(domain.edges(0.0)[2, 2]), "the side of the box along z, which is periodic"
            must(abs(side - length) <= 1e-9 * side, "length of the duct", f"{side:g} m, {rule}", length)
            rule = "equal at both ends in a box that is periodic along z"
            must(self.radii[0] == self.radii[-1], "duct.radii", rule, self.radii)
        generator = np.random.default_rng([seed, 0x64756374])
        places, wider = self._anywhere(len(radii), generator), radii * (1 + CLEARANCE)
        for _ in range(MOST_PUSHES):
            if not self._push_apart(places, radii, wider, endless):
                return places + np.asarray(self.centre)
        rule = f"one at which spheres can be pushed apart in {MOST_PUSHES} rounds"
        raise InputError(f"volume fraction must be {rule}; received {fraction:.4g}")

    def _anywhere(self, number: int, generator: np.random.Generator) -> np.ndarray:
        """Return uniformly distributed positions (m) in the duct."""
        widest, kept = max(self.radii), np.empty((0, 3))
        while len(kept) < number:
            tried = generator.uniform(
                (-widest, -widest, 0.0), (widest, widest, self.heights[-1]), (number, 3)
            )
            inside = np.hypot(tried[:, 0], tried[:, 1]) < self.radius_at(tried[:, 2])
            kept = np.vstack([kept, tried[inside]])
        return kept[:number]

    def _push_apart(self, places: np.ndarray, radii: np.ndarray, wider: np.ndarray, endless: bool) -> bool:
        """Push spheres apart and off the wall to the distances for radii ``wider`` (m); return whether any
        with the actual ``radii`` overlapped another or the wall."""
        length = self.heights[-1]
        tree = cKDTree(places, boxsize=[0.0, 0.0, length] if endless else None)
        i, j = tree.query_pairs(2 * float(wider.max()), output_type="ndarray").T
        apart = places[j] - places[i]
        if endless:
            apart[:, 2] -= length * np.rint(apart[:, 2] / length)
        distance = np.linalg.norm(apart, axis=1)
        overlapped = bool((distance < radii[i] + radii[j]).any())
        lacking = np.maximum(wider[i] + wider[j] - distance, 0.0)
        push = (0.5 * lacking / np.maximum(distance, 1e-9 * wider[i]))[:, None] * apart
        overlapped |= bool((self._off_wall(places, endless)[1] < radii).any())
        if overlapped:
            np.subtract.at(places, i, push)
            np.add.at(places, j, push)
            inward, depth = self._off_wall(places, endless)
            places += np.maximum(wider - depth, 0.0)[:, None] * inward
            # Rounding can give a position at exactly the upper end, which a periodic tree does not accept.
            places[:, 2] = np.where(endless, places[:, 2] % length % length, places[:, 2])
        return overlapped

    def _off_wall(self, places: np.ndarray, endless: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return the direction away from the nearest point of the wall, and the distance of positions from it
        (m), negative outside; the ends belong to the wall unless the duct is endless."""
        rho = np.hypot(places[:, 0], places[:, 1])
        here = np.stack([rho, places[:, 2]], axis=1)
        corners = np.stack([self.radii, self.heights], axis=1)
        if endless:
            up = np.array([0.0, self.heights[-1]])
            corners = np.vstack([corners - up, corners, corners + up])
        else:
            corners = np.vstack([[0.0, 0.0], corners, [0.0, self.heights[-1]]])
        best = np.full(len(places), np.inf)
        out = np.zeros_like(here)
        for a, b in itertools.pairwise(corners):
            part = np.clip((here - a) @ (b - a) / max((b - a) @ (b - a), np.finfo(float).tiny), 0.0, 1.0)
            away = here - (a + part[:, None] * (b - a))
            distance = np.linalg.norm(away, axis=1)
            nearer = distance < best
            best[nearer], out[nearer] = distance[nearer], away[nearer]
        inside = rho < self.radius_at(places[:, 2])
        if not endless:
            inside &= (places[:, 2] > 0) & (places[:, 2] < self.heights[-1])
        sign = np.where(inside, 1.0, -1.0)
        flat = (sign / np.maximum(best, np.finfo(float).tiny))[:, None] * out
        radial = np.where(rho > 0, flat[:, 0] / np.maximum(rho, np.finfo(float).tiny), 0.0)
        inward = np.column_stack([radial * places[:, 0], radial * places[:, 1], flat[:, 1]])
        return inward, sign * best
