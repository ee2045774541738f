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
"""Largest number of places that are tried for a start."""
ROUNDING = 1e-12
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
    """Return bodies at random places in random directions, in a periodic cube or inside a container.

    number : of bodies. fraction : packing fraction of the start, which defines the size of the box. container
    : with bodies completely inside its walls; None for a periodic cube. seed : of the random numbers.

    Positions and orientations are uniformly distributed over all those at which a body does not cross a wall:
    each body is drawn until it does not. Bodies may overlap each other; packing steppers remove these
    overlaps first. InputError is raised if a container is so narrow that no such places are found.

    Source: B16 section 2.2.4.
    """
    must(is_whole(number, 1), "number", "a whole number, at least 1", number)
    must(0 < fraction < 1, "fraction", "between 0 and 1", fraction)
    volume, unit = number * shape.volume() / fraction, diameter(shape)
    side = np.full(3, np.cbrt(volume)) if container is None else container.box_of(volume, unit)
    generator = np.random.default_rng([seed, 0xB0D135])
    position, orientation = np.empty((0, 3)), np.empty((0, 4))
    tried = 0
    while len(position) < number:
        some = number if container is None else TRIED_TOGETHER
        numbers = generator.uniform(size=(some, 3))
        places = side * numbers
        turns = Rotation.random(some, rng=generator).as_quat(scalar_first=True)
        if container is not None:
            places = container.points(numbers, side, unit, unit / 2)
            gaps = wall_gaps(shape, places, turns, container, side).min(axis=1)
            inside = gaps >= -ROUNDING * unit
            places, turns = places[inside], turns[inside]
        position, orientation = np.vstack([position, places]), np.vstack([orientation, turns])
        tried += some
        if tried >= MOST_TRIED and len(position) < number:
            rule = f"wide enough for {number} bodies in {MOST_TRIED:.0e} trials at random"
            raise InputError(f"container must be {rule}; received one with {len(position)} of them")
    high = (float(side[0]), float(side[1]), float(side[2]))
    box = Box(low=(0.0, 0.0, 0.0), high=high, periodic=_periodic(container))
    # The lower face of a periodic box belongs to it, the upper one does not.
    inside_box = np.minimum(position[:number], np.nextafter(side, 0.0))
    return RandomBodies(inside_box, orientation[:number], shape.bounding_radius(), shape.volume(), box)


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
