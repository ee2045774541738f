"""Random starts of packings of hard bodies, in a periodic box or in a container."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.domains.domain import Box
from tisim.errors import InputError, is_whole, must
from tisim.geometry.container import Container
from tisim.shapes.particle_shape import ParticleShape

TRIED_TOGETHER = 100_000
"""Places that are tried at once."""
MOST_TRIED = 200_000_000
"""Largest number of places that are tried for a start, of which a narrow container has few inside."""
MOST_TAKEN = 20_000
"""Largest number of places inside, one after the other, that are tried for a body."""
GILBERT_STEPS = 30
"""Steps of Gilbert's method, after which bodies that are not proved to be apart count as overlapping."""
PARALLEL = 1e-12
"""Squared sine of the angle below which rods count as parallel."""
WALL_ROUNDING = 1e-12
"""Bodies may cross a wall by this part of D, which is lost to rounding."""


@dataclass(frozen=True)
class RandomBodies:
    """The random start of a packing of equal bodies.

    position : m, shape (n, 3). orientation : unit quaternions w, x, y, z, shape (n, 4). radius : of the
    bounding sphere of a body (m). mass : of a body (kg), at a density of 1 kg/m^3. box : the domain.
    """

    position: np.ndarray
    orientation: np.ndarray
    radius: float
    mass: float
    box: Box

    def particles(self) -> dict[str, Any]:
        """Return the arguments of ``Particles``."""
        return {
            "position": self.position,
            "velocity": np.zeros_like(self.position),
            "radius": self.radius,
            "mass": self.mass,
            "quantities": {"orientation": self.orientation},
        }


def random_bodies(
    shape: ParticleShape, number: int, fraction: float, container: Container | None = None, seed: int = 0
) -> RandomBodies:
    """Return bodies at random places in random directions without overlaps, in a periodic cube or inside a
    container.

    number : of bodies. fraction : packing fraction of the start, which defines the size of the box; B16 takes
    0.05, and 0.005 for long rods. container : with bodies completely inside its walls; None for a periodic
    cube. seed : of the random numbers.

    The bodies are placed one after another. Each is drawn uniformly from all positions and orientations until
    it crosses no wall and overlaps no other body. InputError is raised if no further place is found.

    Source: B16 sections 2.2.1 and 2.2.4.
    """
    must(is_whole(number, 1), "number", "a whole number, at least 1", number)
    must(0 < fraction < 1, "fraction", "between 0 and 1", fraction)
    volume, unit = number * shape.volume() / fraction, diameter(shape)
    side = np.full(3, np.cbrt(volume)) if container is None else container.box_of(volume, unit)
    periodic = _periodic(container)
    images = np.where(periodic, side, 0.0)
    generator = np.random.default_rng([seed, 0xB0D135])
    position, orientation = np.empty((number, 3)), np.empty((number, 4))
    placed = tried = taken = 0
    while placed < number:
        if tried >= MOST_TRIED or taken >= MOST_TAKEN:
            rule = f"one at which {number} bodies find places at random"
            raise InputError(f"fraction must be {rule}; received {fraction:g}, with {placed} of them placed")
        some = TRIED_TOGETHER if placed or container is not None else number
        numbers = generator.uniform(size=(some, 3))
        places, turns = side * numbers, Rotation.random(some, rng=generator).as_quat(scalar_first=True)
        if container is not None:
            places = container.points(numbers, side, unit, unit / 2)
            inside = wall_gaps(shape, places, turns, container, side).min(axis=1) >= -WALL_ROUNDING * unit
            places, turns = places[inside], turns[inside]
        # The lower face of a periodic box belongs to it, the upper one does not.
        places = np.minimum(places, np.nextafter(side, 0.0))
        tried += some
        for place, turn in zip(places, turns, strict=True):
            if placed == number or taken >= MOST_TAKEN:
                break
            others, taken = (position[:placed], orientation[:placed]), taken + 1
            if _is_free(shape, place, turn, *others, side, images):
                position[placed], orientation[placed] = place, turn
                placed, taken = placed + 1, 0
    high = (float(side[0]), float(side[1]), float(side[2]))
    box = Box(low=(0.0, 0.0, 0.0), high=high, periodic=periodic)
    return RandomBodies(position, orientation, shape.bounding_radius(), shape.volume(), box)


def _is_free(
    shape: ParticleShape,
    place: np.ndarray,
    turn: np.ndarray,
    others: np.ndarray,
    turns: np.ndarray,
    side: np.ndarray,
    images: np.ndarray,
) -> bool:
    """Return whether a body overlaps none of the others. images : distances of images (m), 0 along axes that
    are not periodic."""
    apart = others - place
    apart -= images * np.rint(apart / side)
    near = np.einsum("ij,ij->i", apart, apart) < (2 * shape.bounding_radius()) ** 2
    rod = shape.rod()
    if not near.any():
        return True
    if rod is None:
        here, there = (Rotation.from_quat(one, scalar_first=True) for one in (turn, turns[near]))
        return bool(proved_apart(shape, apart[near], here, there).all())
    half, radius = rod
    z = np.array([0.0, 0.0, 1.0])
    axis = Rotation.from_quat(turn, scalar_first=True).apply(z)
    axes = Rotation.from_quat(turns[near], scalar_first=True).apply(z)
    return bool((segment_distances(apart[near], axis, axes, half, half) >= 2 * radius).all())


def proved_apart(shape: ParticleShape, apart: np.ndarray, turn: Rotation, turns: Rotation) -> np.ndarray:
    """Return whether bodies are proved to be apart from a body of the same shape, shape (n,).

    apart : their centres minus its centre (m, shape (n, 3)). turn, turns : its orientation, and theirs.

    The points of the difference of two bodies approach the point nearest to the origin. The bodies are apart
    if a plane through one of its support points separates the difference from the origin.

    Source: E. G. Gilbert, SIAM J. Control 4 (1966) 61.
    """
    nearest, proved = apart.copy(), np.zeros(len(apart), bool)
    for _ in range(GILBERT_STEPS):
        length = np.linalg.norm(nearest, axis=1)
        normal = nearest / np.where(length > 0, length, 1.0)[:, None]
        normal[length == 0] = [0.0, 0.0, 1.0]
        here = turn.apply(shape.support(turn.inv().apply(normal)))
        there = turns.apply(shape.support(turns.inv().apply(-normal)))
        farthest = apart + there - here
        proved |= np.einsum("ij,ij->i", farthest, normal) > 0
        step = farthest - nearest
        square = np.einsum("ij,ij->i", step, step)
        share = -np.einsum("ij,ij->i", nearest, step) / np.where(square > 0, square, 1.0)
        nearest += np.clip(share, 0.0, 1.0)[:, None] * step
        if proved.all():
            break
    return proved


def segment_distances(
    apart: np.ndarray, axis: np.ndarray, axes: np.ndarray, half: float, halves: np.ndarray | float
) -> np.ndarray:
    """Return the distances (m) of segments from a segment, shape (n,).

    apart : their centres minus its centre (m, shape (n, 3)). axis, axes : unit vectors along it, shape (3,),
    and along them, shape (n, 3). half, halves : half its length and half their lengths (m).

    Source: C. Vega and S. Lago, Computers & Chemistry 18 (1994) 55.
    """
    b, along, other = axes @ axis, apart @ axis, np.einsum("ij,ij->i", apart, axes)
    square = 1 - b * b
    apart_ways = square > PARALLEL
    beside = 0.5 * (np.maximum(-half, along - halves) + np.minimum(half, along + halves))
    line = (along - b * other) / np.where(apart_ways, square, 1.0)
    on_it = np.clip(np.where(apart_ways, line, beside), -half, half)
    on_them = np.clip(b * on_it - other, -halves, halves)
    on_it = np.clip(along + b * on_them, -half, half)
    between = apart + on_them[:, None] * axes - on_it[:, None] * axis
    distances: np.ndarray = np.linalg.norm(between, axis=1)
    return distances


def diameter(shape: ParticleShape) -> float:
    """Return D (m), the shortest side of the box around a shape."""
    return 2 * float(shape.half_extents().min())


def wall_gaps(
    shape: ParticleShape,
    position: np.ndarray,
    orientation: np.ndarray,
    container: Container,
    side: np.ndarray,
    size: float = 1.0,
) -> np.ndarray:
    """Return the gap (m) between each body and each wall of a container, negative where a body crosses it,
    shape (n, walls).

    position : m from the lower corner of the box, shape (n, 3). orientation : unit quaternions w, x, y, z,
    shape (n, 4). side : sides of the box (m, shape (3,)). size : of the bodies over the size of the shape.
    """
    unit, turns = diameter(shape) * size, Rotation.from_quat(orientation, scalar_first=True)
    rod = shape.rod()
    if rod is not None:
        half, radius = rod
        away = size * half * turns.apply([0.0, 0.0, 1.0])
        ends = [container.distances(position + sign * away, side, unit)[0] for sign in (1.0, -1.0)]
        return np.minimum(*ends) - size * radius
    rule = f"a rod or a sphere in a {container.kind()}, which has a curved wall"
    must(not container.curved, "shape", rule, shape.kind())
    distance, outward = container.distances(position, side, unit)
    gaps = np.empty_like(distance)
    for k in range(distance.shape[1]):
        local = turns.inv().apply(outward[:, k])
        gaps[:, k] = distance[:, k] - size * np.einsum("ij,ij->i", shape.support(local), local)
    return gaps


def _periodic(container: Container | None) -> tuple[bool, bool, bool]:
    x, y, z = (False, False, False) if container is None else container.walled()
    return not x, not y, not z
