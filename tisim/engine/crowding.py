"""Overlaps in initial states: states that cannot be run are refused, deep overlaps give a warning.

An initial state may have any number of particles at one place, so the checks use little memory: a few columns
of the particles. The first check counts particles in cells that are so small that all particles of one cell
overlap.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tisim.backend import runtime
from tisim.backend.memory import LISTS_PART
from tisim.collisions.contact_list import CONTACTS_PER_PARTICLE
from tisim.effects.base import Constraint, PairEvent, Pairwise, Shaped
from tisim.effects.walls.walls import Walls
from tisim.errors import InputError, StartWarning
from tisim.pairs.contact_memory import PARTNERS
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

PAIR_BYTES = 32
"""Least memory of a listed pair, bytes."""
DEEP = 0.5
"""An overlap is deep from this fraction of the smaller radius on."""
SUSPECT = 3
"""From this many particles in one cell on, the overlaps of one of them are counted."""
SAMPLE = 64
"""Number of particles in the sample from which overlapping pairs are estimated if there are many."""
MOST_PAIRS = 2_000_000
"""Above this number, overlapping pairs are counted but not examined one by one."""
MOST_NEAR = 1000
"""A skin is refused if it gives a particle more listed neighbours than this and more than MOST_PAIRS pairs in
all: scanning such lists takes longer than a list lasts."""


class Deep(NamedTuple):
    """The deepest overlap of an initial state: its depth over the smaller radius, a text that names the two,
    and the number of deep overlaps."""

    part: float
    what: str
    number: int


def check_places(scene: Scene, start: Arrays) -> list[Deep]:
    """Check the overlaps of an initial state; return the deepest overlap of two spheres and the deepest with
    each wall.

    Raise InputError if spheres with a contact law coincide, if one overlaps more others than the contact
    history can store, or if the skin of the scene takes in too many neighbours.
    """
    check_skin(scene, start)
    laws = _holding(scene)
    if not laws or not len(start["mass"]):
        return []
    if any(isinstance(effect, Shaped) for effect in scene.effects):
        # Spheres around bodies may overlap.
        _Crowd(scene, start).check_coincident(laws[0].label)
        return []
    return [*_overlaps(scene, start, laws), *_in_walls(scene, start)]


def check_skin(scene: Scene, start: Arrays) -> None:
    """Raise InputError if the skin of the scene would make the pair lists useless."""
    lists = any(isinstance(effect, Pairwise) and effect.short_ranged for effect in scene.effects)
    if scene.skin is None or not lists or not len(start["mass"]):
        return
    crowd = _Crowd(scene, start)
    sample = range(0, crowd.number, -(-crowd.number // SAMPLE))
    each = float(np.mean([crowd.overlapped(i, scene.skin)[0] for i in sample]))
    if each > MOST_NEAR and 0.5 * each * crowd.number > MOST_PAIRS:
        rule = f"so small that a particle has at most {MOST_NEAR} others within it"
        received = f"{scene.skin:g} m, within which each has about {each:.0f} of {crowd.number} particles"
        raise InputError(f"scene.skin must be {rule}; received {received}")


def warn_of_overlaps(found: Sequence[Sequence[Deep]]) -> None:
    """Warn once, for all scenes, of spheres that overlap by half of the smaller radius and of spheres in or
    behind walls.

    found : the deep overlaps of each scene.
    """
    deep = [one for of_scene in found for one in of_scene]
    if deep:
        worst = max(deep, key=lambda one: one.part)
        others, scenes = sum(one.number for one in deep) - 1, sum(map(bool, found))
        text = f"{worst.what}, at the start"
        text += f"; {others} more overlap by {DEEP:g} of a radius or more" if others else ""
        text += f", in {scenes} of {len(found)} scenes" if len(found) > 1 else ""
        warnings.warn(text, StartWarning, stacklevel=3)


def _holding(scene: Scene) -> list[Any]:
    """Return the effects of a scene that hold touching spheres apart."""
    solid = [effect for effect in scene.effects if isinstance(effect, Pairwise) and effect.solid]
    return solid + [effect for effect in scene.effects if isinstance(effect, PairEvent) and effect.hard]


def _place(position: np.ndarray) -> str:
    return "({:.4g}, {:.4g}, {:.4g}) m".format(*position)


class _Crowd:
    """A crowd is the spheres of an initial state, with their rigid bodies and the box around them."""

    def __init__(self, scene: Scene, start: Arrays) -> None:
        real = np.float64 if runtime.current().precision == "f64" else np.float32
        self.position, self.radius = start["position"].astype(real), start["radius"]
        self.number = len(self.radius)
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
            received = f"particles {i} and {j} both at {_place(self.position[i])}"
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
            where = f"particle {lister} at {_place(self.position[lister])}, which overlaps {number} others"
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

    def deep_pairs(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the pairs that overlap deeply, shape (pairs, 2), and the overlaps (m)."""
        found: list[np.ndarray] = []
        levels = self.levels()
        trees = [self.tree(members) for members in levels]
        for a, (larger, tree) in enumerate(zip(levels, trees, strict=True)):
            reach = (2 - DEEP) * self.radius[larger].max()
            found.append(larger[tree.query_pairs(reach, output_type="ndarray")])
            for smaller, other in zip(levels[:a], trees[:a], strict=True):
                reaches = self.radius[larger] + (1 - DEEP) * self.radius[smaller].max()
                near = other.query_ball_point(tree.data, reaches)
                sizes = [len(one) for one in near]
                inner = np.concatenate([np.asarray(one, int) for one in near])
                found.append(np.column_stack([np.repeat(larger, sizes), smaller[inner]]))
        pairs = np.concatenate(found)
        i, j = pairs.T
        apart = self.nearest(self.position[i] - self.position[j])
        overlap = self.radius[i] + self.radius[j] - np.sqrt((apart**2).sum(axis=1))
        deep = (overlap >= DEEP * np.minimum(self.radius[i], self.radius[j])) & ~self.joined(i, j)
        return pairs[deep], overlap[deep]


def _overlaps(scene: Scene, start: Arrays, laws: Sequence[Any]) -> list[Deep]:
    """Return the deepest overlap of two spheres, if any is deep; raise InputError if there are too many
    overlaps."""
    crowd = _Crowd(scene, start)
    if crowd.number < 2:
        return []
    # With few particles all pairs are searched at once; the refused ones are among the deep pairs.
    few = crowd.number**2 <= MOST_PAIRS
    pairs, overlap = crowd.deep_pairs() if few else (None, None)
    if pairs is None or len(pairs):
        crowd.check_coincident(laws[0].label)
        crowd.check_overlaps(laws)
        if crowd.pairs > MOST_PAIRS:
            return [Deep(1.0, f"about {crowd.pairs} pairs of particles overlap", 1)]
    if pairs is None or overlap is None:
        pairs, overlap = crowd.deep_pairs()
    if not len(pairs):
        return []
    part = overlap / crowd.radius[pairs].min(axis=1)
    k = int(part.argmax())
    i, j = sorted(map(int, pairs[k]))
    what = f"particles {i} and {j} overlap by {overlap[k]:.3g} m, {part[k]:.3g} of the smaller radius"
    return [Deep(float(part[k]), f"{what}, at {_place(crowd.position[i])}", len(pairs))]


def _in_walls(scene: Scene, start: Arrays) -> list[Deep]:
    """Return the deepest overlap of a sphere with each wall of a scene, if it is deep."""
    found = []
    for wall in scene.effects:
        if isinstance(wall, Walls):
            overlap = wall.overlaps(start["position"], start["radius"])
            deep = overlap >= DEEP * start["radius"]
            if deep.any():
                part = overlap / start["radius"]
                k = int(part.argmax())
                what = f"particle {k} lies {'behind' if part[k] > 1 else 'in'} effects.{wall.label}"
                what += f" by {overlap[k]:.3g} m, {part[k]:.3g} of its radius"
                place = _place(start["position"][k])
                found.append(Deep(float(part[k]), f"{what}, at {place}", int(deep.sum())))
    return found
