"""Overlaps in initial states: states that cannot be run are refused, deep overlaps give a warning.

An initial state may have any number of particles at one place, so the checks use little memory: a few columns
of the particles. The first check counts particles in cells that are so small that all particles of one cell
overlap.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from tisim.effects.base import PairEvent, Pairwise, Shaped
from tisim.effects.walls.walls import Walls
from tisim.engine.crowd import DEEP, MOST_PAIRS, SAMPLE, Crowd, Deep, place_of
from tisim.engine.shape_overlaps import bodies_in_walls, body_overlaps
from tisim.errors import InputError, StartWarning
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

MOST_NEAR = 1000
"""A skin is refused if it gives a particle more listed neighbours than this and more than MOST_PAIRS pairs in
all: scanning such lists takes longer than a list lasts."""


def check_places(scene: Scene, start: Arrays) -> list[Deep]:
    """Check the overlaps of an initial state; return the deepest overlap of two particles and the deepest
    with each wall.

    Raise InputError if spheres with a contact law coincide, if one overlaps more others than the contact
    history can store, or if the skin of the scene takes in too many neighbours.
    """
    check_skin(scene, start)
    laws = _holding(scene)
    if not laws or not len(start["mass"]):
        return []
    shaped = next((effect for effect in scene.effects if isinstance(effect, Shaped)), None)
    if shaped is not None:
        return [*body_overlaps(scene, start, laws[0].label, shaped), *bodies_in_walls(scene, start, shaped)]
    return [*_overlaps(scene, start, laws), *_in_walls(scene, start)]


def check_skin(scene: Scene, start: Arrays) -> None:
    """Raise InputError if the skin of the scene would make the pair lists useless."""
    lists = any(isinstance(effect, Pairwise) and effect.short_ranged for effect in scene.effects)
    if scene.skin is None or not lists or not len(start["mass"]):
        return
    crowd = Crowd(scene, start)
    sample = range(0, crowd.number, -(-crowd.number // SAMPLE))
    each = float(np.mean([crowd.overlapped(i, scene.skin)[0] for i in sample]))
    if each > MOST_NEAR and 0.5 * each * crowd.number > MOST_PAIRS:
        rule = f"so small that a particle has at most {MOST_NEAR} others within it"
        received = f"{scene.skin:g} m, within which each has about {each:.0f} of {crowd.number} particles"
        raise InputError(f"scene.skin must be {rule}; received {received}")


def warn_of_overlaps(found: Sequence[Sequence[Deep]]) -> None:
    """Warn once, for all scenes, of particles that overlap by half of the smaller radius, or half thickness,
    and of particles in or behind walls.

    found : the deep overlaps of each scene.
    """
    deep = [one for of_scene in found for one in of_scene]
    if deep:
        worst = max(deep, key=lambda one: one.part)
        others, scenes = sum(one.number for one in deep) - 1, sum(map(bool, found))
        text = f"{worst.what}, at the start"
        text += f"; {others} more overlap by {DEEP:g} of a {worst.length} or more" if others else ""
        text += f", in {scenes} of {len(found)} scenes" if len(found) > 1 else ""
        warnings.warn(text, StartWarning, stacklevel=3)


def _holding(scene: Scene) -> list[Any]:
    """Return the effects of a scene that hold touching spheres apart."""
    solid = [effect for effect in scene.effects if isinstance(effect, Pairwise) and effect.solid]
    return solid + [effect for effect in scene.effects if isinstance(effect, PairEvent) and effect.hard]


def _overlaps(scene: Scene, start: Arrays, laws: Sequence[Any]) -> list[Deep]:
    """Return the deepest overlap of two spheres, if any is deep; raise InputError if there are too many
    overlaps."""
    crowd = Crowd(scene, start)
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
    return [Deep(float(part[k]), f"{what}, at {place_of(crowd.position[i])}", len(pairs))]


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
                place = place_of(start["position"][k])
                found.append(Deep(float(part[k]), f"{what}, at {place}", int(deep.sum())))
    return found
