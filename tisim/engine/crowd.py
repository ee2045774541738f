"""The particles of an initial state as a crowd, in which overlapping pairs are sought."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tisim.backend import runtime
from tisim.backend.memory import LISTS_PART
from tisim.collisions.contact_list import CONTACTS_PER_PARTICLE
from tisim.effects.base import Constraint, PairEvent
from tisim.errors import InputError
from tisim.pairs.contact_memory import PARTNERS
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

PAIR_BYTES = 32
"""Least memory of a listed pair, bytes."""
DEEP = 0.5
"""An overlap is deep from this fraction of the smaller radius, or half thickness, on."""
SUSPECT = 3
"""From this many particles in one cell on, the overlaps of one of them are counted."""
SAMPLE = 64
"""Number of particles in the sample from which overlapping pairs are estimated if there are many."""
MOST_PAIRS = 2_000_000
"""Above this number, overlapping pairs are counted but not examined one by one."""


class Deep(NamedTuple):
    """The deepest overlap of an initial state: its depth over the smaller radius, or half thickness, a text
    that names the two, the number of deep overlaps, and the length that depths are compared with."""

    part: float
    what: str
    number: int
    length: str = "radius"


class Crowd:
    """A crowd is the particles of an initial state, with their rigid bodies and the box around them.

    Its methods take particles as spheres: of bodies with shapes these are the bounding spheres.
    """

    def __init__(self, scene: Scene, start: Arrays) -> None:
        real = np.float64 if runtime.current().precision == "f64" else np.float32
        self.position, self.radius = start["position"].astype(real), start["radius"]
        self.number = len(self.radius)
        # Half the smallest extent of each particle.
        self.thickness = self.radius
        self.fixed = start.get("fixed", np.zeros(self.number)) > 0
        constraints = [effect for effect in scene.effects if isinstance(effect, Constraint)]
        self.bodies = [constraint.bodies(start) for constraint in constraints]
        low, high = scene.domain.bounds()
        self.low, self.side = np.zeros(3), np.zeros(3)
        if low is not None and high is not None:
            self.low, self.side = low, np.where(scene.domain.imaged(), high - low, 0.0)

    def nearest(self, apart: np.ndarray) -> np.ndarray:
        """Return the minimum-image vectors (m) between particles, across joined faces if there are any."""
        sides = np.where(self.side > 0, self.side, np.inf)
        return apart - np.rint(apart / sides) * self.side

    def joined(self, i: Any, j: Any) -> np.ndarray:
        """Return which pairs belong to one rigid body; contact laws do not act within a body."""
        joined: np.ndarray = np.zeros(np.broadcast(i, j).shape, bool)
        for body in self.bodies:
            joined |= (body[i] == body[j]) & (body[i] >= 0)
        return joined

    def check_coincident(self, law: str) -> None:
        """Raise InputError if two particles are at one place."""
        if not (np.diff(np.sort(self.position[:, 0])) == 0).any():
            return
        order = np.lexsort(self.position.T)
        same = (np.diff(self.position[order], axis=0) == 0).all(axis=1)
        first, second = order[:-1][same], order[1:][same]
        apart = ~self.joined(first, second)
        first, second = first[apart], second[apart]
        if len(first):
            i, j = sorted((int(first[0]), int(second[0])))
            number = len(np.union1d(first, second))
            rule = f"a different place for each particle, as effects.{law} holds them apart"
            received = f"particles {i} and {j} both at {place_of(self.position[i])}"
            received += f", and {number} particles in all share places" if number > 2 else ""
            raise InputError(f"particles.position must be {rule}; received {received}")

    def levels(self) -> list[np.ndarray]:
        """Return the indices of the spheres of each level; within a level radii differ by less than a factor
        2."""
        smallest = self.radius.min()
        if self.radius.max() < 2 * smallest:
            return [np.arange(self.number)]
        level = np.floor(np.log2(self.radius / smallest)).astype(int)
        return [np.flatnonzero(level == one) for one in np.unique(level)]

    def check_overlaps(self, laws: Sequence[Any]) -> None:
        """Raise InputError if a particle overlaps more others than its contact history can store, or if more
        pairs overlap than the lists can hold."""
        self.pairs = 0
        remembers = next((law for law in laws if getattr(law, "memory", 0)), None)
        hard = any(isinstance(law, PairEvent) for law in laws)
        for members in self.levels():
            # All spheres in one cell overlap: its diagonal is twice the smallest radius.
            width = 2.0 * self.radius[members].min() / np.sqrt(3.0)
            with np.errstate(invalid="ignore"):
                cells = np.floor((self.position[members] - self.low) / width).astype(np.int64)
            keys = (cells * np.array([73856093, 19349663, 83492791])).sum(axis=1)
            _, whose, counts = np.unique(keys, return_inverse=True, return_counts=True)
            if counts.max() < SUSPECT:
                continue
            crowded = members[whose == counts.argmax()]
            lister = int(crowded[0])
            number, listed = self.overlapped(lister)
            where = f"particle {lister} at {place_of(self.position[lister])}, which overlaps {number} others"
            if remembers is not None and listed > PARTNERS:
                rule = f"so far apart that each overlaps at most the {PARTNERS} others"
                rule += f" that effects.{remembers.label} has room for"
                raise InputError(f"particles must be {rule}; received {where}")
            sample = members[:: -(-len(members) // SAMPLE)]
            each = float(np.mean([self.overlapped(int(i))[0] for i in sample]))
            self.pairs += int(0.5 * each * len(members))
            if self.pairs * PAIR_BYTES > LISTS_PART * runtime.memory():
                rule = "so far apart that the lists of overlapping pairs fit in memory"
                received = f"about {self.pairs} pairs, and {where}"
                raise InputError(f"particles must be {rule}; received {received}")
            # A factor 2 allows for the error of the estimate; below it a kernel counts the pairs exactly.
            if hard and self.pairs > 2 * CONTACTS_PER_PARTICLE * self.number:
                rule = f"so far apart that at most {CONTACTS_PER_PARTICLE} pairs overlap for each of them"
                received = f"about {self.pairs} pairs, and {where}"
                raise InputError(f"particles must be {rule}; received {received}")

    def overlapped(self, i: int, skin: float = 0.0) -> tuple[int, int]:
        """Return the number of others that particle i overlaps or has within a skin (m), and how many of
        these are larger or, at equal size, have a higher index."""
        apart = self.nearest(self.position - self.position[i])
        others = np.arange(self.number)
        near = (apart**2).sum(axis=1) < (self.radius + self.radius[i] + skin) ** 2
        near &= (others != i) & ~self.joined(others, i)
        above = (self.radius > self.radius[i]) | ((self.radius == self.radius[i]) & (others > i))
        return int(near.sum()), int((near & above).sum())

    def tree(self, members: np.ndarray) -> cKDTree:
        """Return a search tree of some spheres that accounts for joined faces."""
        place = self.position[members] - self.low
        # A remainder may round up to the full side.
        inside = np.mod(place, np.where(self.side > 0, self.side, 1.0))
        inside = np.where(inside >= self.side, 0.0, inside)
        place = np.where(self.side > 0, inside, place)
        return cKDTree(place, boxsize=self.side if self.side.any() else None)

    def near_pairs(self, reach: np.ndarray, most: float = np.inf) -> np.ndarray | int:
        """Return the pairs whose spheres of radii ``reach`` (m) overlap by DEEP of the smaller thickness or
        more, shape (pairs, 2); their number, nearly, if it may be above ``most``."""
        found: list[np.ndarray] = []
        levels = self.levels()
        trees = [self.tree(members) for members in levels]
        shrunk, number = reach - DEEP * self.thickness, 0
        for a, (larger, tree) in enumerate(zip(levels, trees, strict=True)):
            # The smaller thickness belongs to either of the two.
            within = shrunk[larger].max() + reach[larger].max()
            if most < np.inf:
                number += int(tree.count_neighbors(tree, within) - len(larger)) // 2
            if number <= most:
                found.append(larger[tree.query_pairs(within, output_type="ndarray")])
            for smaller, other in zip(levels[:a], trees[:a], strict=True):
                reaches = np.maximum(
                    reach[larger] + shrunk[smaller].max(), shrunk[larger] + reach[smaller].max()
                )
                if most < np.inf:
                    number += int(other.count_neighbors(tree, reaches.max()))
                if number <= most:
                    near = other.query_ball_point(tree.data, reaches)
                    sizes = [len(one) for one in near]
                    inner = np.concatenate([np.asarray(one, int) for one in near])
                    found.append(np.column_stack([np.repeat(larger, sizes), smaller[inner]]))
        return number if number > most else np.concatenate(found)

    def deep_pairs(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the pairs of spheres that overlap deeply, shape (pairs, 2), and the overlaps (m)."""
        pairs = self.near_pairs(self.radius)
        assert isinstance(pairs, np.ndarray)
        i, j = pairs.T
        apart = self.nearest(self.position[i] - self.position[j])
        overlap = self.radius[i] + self.radius[j] - np.sqrt((apart**2).sum(axis=1))
        deep = (overlap >= DEEP * np.minimum(self.radius[i], self.radius[j])) & ~self.joined(i, j)
        return pairs[deep], overlap[deep]


def place_of(position: np.ndarray) -> str:
    """Return a position (m) as text."""
    return "({:.4g}, {:.4g}, {:.4g}) m".format(*position)
