"""Deep overlaps of bodies with shapes in initial states, with each other and with walls."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.effects.base import Shaped
from tisim.effects.walls.walls import Walls
from tisim.engine.crowd import DEEP, MOST_PAIRS, Crowd, Deep, place_of
from tisim.geometry.surface import Surface
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.shapes.gaps import gaps
from tisim.shapes.spherocylinder import SpherocylinderShape

MOST_GAPS = 20_000
"""Above this number of deep overlaps of bodies with shapes, further pairs are not examined: the narrow phase
of two superquadrics takes up to 40 us where they overlap deeply."""
TANGENT_ROUNDS = 30
"""Iterations for the normal at which a body touches a curved wall."""
SPHERES_TRIED = (1.0, 0.5, 0.25, 0.0)
"""Radii with which near pairs of bodies are sought until there are few enough: these shares of the way from
the sphere inside a body to its bounding sphere."""


def body_overlaps(scene: Scene, start: Arrays, law: str, shaped: Shaped) -> list[Deep]:
    """Return the deepest overlap of two bodies with shapes, if any is deep.

    Raise InputError if two centres coincide, as the law of this label holds bodies apart. Candidates are
    pairs whose bounding spheres overlap deeply. If there are more than MOST_PAIRS of them, they are pairs
    whose smaller spheres do; if these are the spheres inside the bodies, only their number is told.
    """
    crowd = Crowd(scene, start)
    crowd.check_coincident(law)
    if crowd.number < 2:
        return []
    crowd.thickness = shaped.thicknesses(start)
    found: np.ndarray | int = 0
    for share in SPHERES_TRIED:
        reach = crowd.thickness + share * (crowd.radius - crowd.thickness)
        found = crowd.near_pairs(reach, MOST_PAIRS)
        if isinstance(found, np.ndarray):
            break
    if isinstance(found, int):
        return [Deep(1.0, f"about {found} pairs of particles overlap", 1)]
    pairs, overlap = _deep_bodies(crowd, start, shaped, found)
    if not len(pairs):
        return []
    part = overlap / crowd.thickness[pairs].min(axis=1)
    k = int(part.argmax())
    i, j = sorted(map(int, pairs[k]))
    what = f"particles {i} and {j} overlap by {overlap[k]:.3g} m, {part[k]:.3g} of the smaller half thickness"
    place = place_of(crowd.position[i])
    return [Deep(float(part[k]), f"{what}, at {place}", len(pairs), "half thickness")]


def _deep_bodies(
    crowd: Crowd, start: Arrays, shaped: Shaped, pairs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return those of some pairs of bodies that overlap deeply, shape (pairs, 2), and the overlaps (m); those
    among the nearest ones if there are more than MOST_GAPS."""
    i, j = pairs.T
    # Two fixed bodies do not move each other.
    pairs = pairs[~crowd.joined(i, j) & ~(crowd.fixed[i] & crowd.fixed[j])]
    i, j = pairs.T
    separation = crowd.nearest(start["position"][j] - start["position"][i])
    least = DEEP * np.minimum(crowd.thickness[i], crowd.thickness[j])
    order = np.argsort((separation**2).sum(axis=1) / least**2, kind="stable")
    bodies = start["shape"].astype(int), shaped.sizes(start), start["orientation"]
    deep, overlaps, number = [pairs[:0]], [least[:0]], 0
    for first in range(0, len(order), MOST_GAPS):
        block = order[first : first + MOST_GAPS]
        far = -float(least[block].min())
        gap, _ = gaps(shaped.shapes(), *bodies, pairs[block], separation[block], far)
        chosen = -gap >= least[block]
        deep.append(pairs[block][chosen])
        overlaps.append(-gap[chosen])
        number += int(chosen.sum())
        if number > MOST_GAPS:
            break
    return np.concatenate(deep), np.concatenate(overlaps)


def bodies_in_walls(scene: Scene, start: Arrays, shaped: Shaped) -> list[Deep]:
    """Return the deepest overlap of a body with each wall of a scene, if it is deep."""
    found, thickness = [], shaped.thicknesses(start)
    free = start.get("fixed", np.zeros(len(thickness))) == 0
    for wall in scene.effects:
        if isinstance(wall, Walls):
            overlap, behind = _overlaps_with(wall, start, shaped)
            deep = free & (overlap >= DEEP * thickness)
            if deep.any():
                part = np.where(deep, overlap / thickness, 0.0)
                k = int(part.argmax())
                what = f"particle {k} lies {'behind' if behind[k] else 'in'} effects.{wall.label}"
                what += f" by {overlap[k]:.3g} m, {part[k]:.3g} of its half thickness"
                text = f"{what}, at {place_of(start['position'][k])}"
                found.append(Deep(float(part[k]), text, int(deep.sum()), "half thickness"))
    return found


def _overlaps_with(wall: Walls, start: Arrays, shaped: Shaped) -> tuple[np.ndarray, np.ndarray]:
    """Return the overlap (m) of each body with a wall at time 0, and whether its centre is behind a plane."""
    places = start["position"] - np.array(wall.motion.shift())
    overlap, behind = np.full(len(places), -np.inf), np.zeros(len(places), bool)
    for plane in wall.planes:
        normal = -np.array(plane.normal) / np.linalg.norm(plane.normal)
        distance = plane.distances(places)
        overlap = np.maximum(overlap, shaped.farthest_points(start, normal) @ normal - distance)
        behind |= distance < 0
    for surface in wall.envelopes():
        near = np.flatnonzero(surface.distances(places) < start["radius"])
        if len(near):
            some = {name: values[near] for name, values in start.items() if len(values) == len(places)}
            found = _overlaps_on(surface, places[near], some, shaped)
            overlap[near] = np.maximum(overlap[near], found)
    return overlap, behind


def _overlaps_on(surface: Surface, places: np.ndarray, start: Arrays, shaped: Shaped) -> np.ndarray:
    """Return the overlap (m) of bodies at some places (m) with a curved surface as contact laws find it: see
    tisim/effects/walls/curved_walls.py. Outside a cone it is not known."""
    origin, axis, (a, b, c, length) = surface.tangent_planes()
    away = places - origin

    def tangent(points: np.ndarray) -> np.ndarray:
        across = points - (points @ axis)[:, None] * axis
        size = np.linalg.norm(across, axis=1, keepdims=True)
        normals: np.ndarray = a * across / np.where(size > 0, size, 1.0) + b * axis
        return normals

    def reach(normal: np.ndarray) -> np.ndarray:
        points: np.ndarray = away + shaped.farthest_points(start, normal)
        return points

    first = tangent(away)
    inside = (first * away).sum(axis=1) < c
    overlap = np.full(len(places), -np.inf)
    step = start["radius"][:, None] / 2
    aside = np.cross(axis, first) if length > 0 else np.cross(first, np.roll(first, 1, axis=1))
    for shift in (0.0 * aside, step * aside, -step * aside):
        normal = tangent(away + shift)
        for _ in range(TANGENT_ROUNDS):
            normal = tangent(reach(normal))
        overlap = np.maximum(overlap, (reach(normal) * normal).sum(axis=1) - c)
    overlap[~inside] = -np.inf
    beside = np.flatnonzero(~inside)
    if len(beside) and b == 0:
        # A cylinder is a rod, a sphere a rod without length; its axis is z in its own frame.
        z, last = np.array([0.0, 0.0, 1.0]), len(places)
        turn = Rotation.align_vectors([axis if length > 0 else z], [z])[0].as_quat(scalar_first=True)
        shapes = *shaped.shapes(), SpherocylinderShape(length=length, diameter=2 * c)
        kinds = np.append(start["shape"].astype(int), len(shapes) - 1)
        sizes, turns = np.append(shaped.sizes(start), 1.0), np.vstack([start["orientation"], turn])
        pairs = np.column_stack([beside, np.full(len(beside), last)])
        gap, _ = gaps(shapes, kinds, sizes, turns, pairs, (length / 2 * axis - away)[beside], np.inf)
        overlap[beside] = -gap
    return overlap
