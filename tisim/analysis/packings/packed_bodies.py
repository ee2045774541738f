"""The bodies of a packing, which all its measures take."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from tisim.analysis.separations import with_images
from tisim.domains.domain import Axes
from tisim.effects.base import Shaped
from tisim.engine.result import Result
from tisim.errors import must
from tisim.packing.region import ALL_AXES
from tisim.scene.scene import Scene
from tisim.shapes.particle_shape import ParticleShape
from tisim.shapes.sphere import SphereShape


@dataclass(frozen=True)
class PackedBodies:
    """The bodies of a packing: copies of shapes, each with its place, orientation and scale in a box.

    position : centres of the bodies, m, shape (n, 3).
    orientation : unit quaternions (w, x, y, z) from the frame of the shape to space, shape (n, 4).
    shape : index of the shape of each body in ``shapes``, shape (n,).
    scale : size of each body over the size of its shape, shape (n,).
    shapes : the shapes, at scale 1.
    low, high : corners of the box, m, shape (3,).
    periodic : the axes along which the packing continues periodically.

    ``of`` makes a packing of bodies of one shape, and ``from_result`` takes the end of a run. Measures in
    units of D take the shortest side of the box around a body (the diameter of a rod), and for a pair the
    smaller one.
    """

    position: np.ndarray
    orientation: np.ndarray
    shape: np.ndarray
    scale: np.ndarray
    shapes: tuple[ParticleShape, ...]
    low: np.ndarray
    high: np.ndarray
    periodic: Axes = ALL_AXES

    def __post_init__(self) -> None:
        for name in ("position", "orientation", "scale", "low", "high"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), float))
        object.__setattr__(self, "shape", np.asarray(self.shape, int))
        number = len(self.position)
        expected = {"position": (number, 3), "orientation": (number, 4), "shape": (number,)}
        expected |= {"scale": (number,), "low": (3,), "high": (3,)}
        for name, sizes in expected.items():
            found = getattr(self, name).shape
            must(found == sizes, name, f"of shape {sizes}", found)
        must(bool((self.low < self.high).all()), "low", "below high along all axes", self.low)
        must(bool((self.scale > 0).all()), "scale", "above 0", float(self.scale.min(initial=1.0)))
        known = (self.shape >= 0) & (self.shape < len(self.shapes))
        must(bool(known.all()), "shape", f"indices below {len(self.shapes)}, the shapes", self.shape)
        lengths = np.linalg.norm(self.orientation, axis=1)
        must(bool(np.allclose(lengths, 1, atol=1e-6)), "orientation", "unit quaternions", lengths)

    @classmethod
    def of(
        cls,
        shape: ParticleShape,
        position: ArrayLike,
        low: ArrayLike,
        high: ArrayLike,
        orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        scale: ArrayLike = 1.0,
        periodic: Axes = ALL_AXES,
    ) -> Self:
        """Return a packing of bodies of one shape at positions (m), shape (n, 3), in the box from ``low`` to
        ``high`` (m). orientation, scale : one for all bodies, or one for each."""
        places = np.asarray(position, float)
        number = len(places)
        turns, sizes = np.broadcast_to(orientation, (number, 4)), np.broadcast_to(scale, number)
        given = places, turns, np.zeros(number, int), sizes, (shape,), low, high
        return cls(*given, periodic)  # type: ignore[arg-type]

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """Return the packing at the end of a run; see ``from_state``."""
        return cls.from_state(result.state, result.scene)

    @classmethod
    def from_state(cls, state: Mapping[str, np.ndarray], scene: Scene) -> Self:
        """Return the packing of a state of a scene, such as a frame: bodies of the shapes of the scene, or
        spheres of the radii of the particles if it has none. InputError if the domain is not a box, or is
        sheared."""
        domain = scene.domain
        low, high = domain.bounds()
        must(low is not None and not domain.shears(), "domain", "a box that is not sheared", domain.label)
        assert low is not None
        assert high is not None
        number = len(state["mass"])
        bodies = [one for one in scene.effects if isinstance(one, Shaped)]
        if bodies:
            shapes = tuple(bodies[0].shapes())
            turns, kinds = state["orientation"], np.asarray(state["shape"], int)
        else:
            shapes = (SphereShape(diameter=2.0),)
            turns, kinds = np.broadcast_to((1.0, 0.0, 0.0, 0.0), (number, 4)), np.zeros(number, int)
        scale = state["radius"] / np.array([one.bounding_radius() for one in shapes])[kinds]
        return cls(state["position"], turns, kinds, scale, shapes, low, high, domain.imaged())

    def __len__(self) -> int:
        return len(self.position)

    @property
    def sides(self) -> np.ndarray:
        """Return the lengths of the box (m) along periodic axes and 0 along others, shape (3,), as
        ``tisim.analysis.near`` and others take them."""
        return np.where(self.periodic, self.high - self.low, 0.0)

    @property
    def box_volume(self) -> float:
        """Return the volume of the box, m^3."""
        return float(np.prod(self.high - self.low))

    @property
    def turns(self) -> Rotation:
        """Return the rotations from the frames of the shapes to space."""
        return Rotation.from_quat(self.orientation, scalar_first=True)

    def axes(self) -> np.ndarray:
        """Return the axes x, y and z of each body as rows of unit vectors, shape (n, 3, 3)."""
        return np.asarray(self.turns.as_matrix().transpose(0, 2, 1))

    def volumes(self) -> np.ndarray:
        """Return the volume of each body, m^3, shape (n,)."""
        return np.array([one.volume() for one in self.shapes])[self.shape] * self.scale**3

    def bounding_radii(self) -> np.ndarray:
        """Return the radius of the smallest sphere around each body, m, shape (n,)."""
        return np.array([one.bounding_radius() for one in self.shapes])[self.shape] * self.scale

    def diameters(self) -> np.ndarray:
        """Return D of each body, the shortest side of the box around it, m, shape (n,)."""
        return np.array([2 * one.half_extents().min() for one in self.shapes])[self.shape] * self.scale

    def images(self, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the centres (m) inside the box, in the order of the bodies, followed by all their periodic
        images at most ``reach`` (m) outside; and the index of the body of each. There may be several images
        of one body along an axis."""
        sides, number = self.sides, len(self)
        layers = [max(int(np.ceil(reach / side)), 1) if side > 0 else 1 for side in sides]
        inside = with_images(self.position - self.low, 0.0, sides)[0][:number]
        blocks = np.stack(np.meshgrid(*map(np.arange, layers), indexing="ij"), axis=-1).reshape(-1, 1, 3)
        # Several copies of the box, such that the box of all is at least as wide as the reach.
        copies = (inside + blocks * sides).reshape(-1, 3)
        places, index = with_images(copies, reach, sides * layers)
        beyond = (places >= -reach) & (places <= sides + reach) | (sides == 0)
        kept = beyond.all(axis=1) | (np.arange(len(places)) < number)
        return places[kept] + self.low, index[kept] % max(number, 1)

    def where(self, chosen: np.ndarray) -> Self:
        """Return the packing of some bodies alone, given a mask or indices."""
        some = self.position[chosen], self.orientation[chosen], self.shape[chosen], self.scale[chosen]
        return type(self)(*some, self.shapes, self.low, self.high, self.periodic)
