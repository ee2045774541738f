"""The contacts of grains in all frames as a network of forces, which a browser draws between centres.

A contact of two rows of a ``CompressedTrajectory`` is stored once for each interval of frames in which it
lasts. A frame of a trajectory has no contact history and hence no friction, so that the force is the normal
force of the contact laws at the overlap of the frame, without damping. It is rounded to 8 bits on a scale of
its square root r, which shows weak and strong contacts alike:

    F = r |r|,    r = origin + step q
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tisim.analysis.beds import contacts
from tisim.analysis.separations import nearest_image, periodic_sides
from tisim.effects.base import Effect, Shaped
from tisim.effects.base.constraint import Constraint
from tisim.effects.contact.granular.contact import GranularContact
from tisim.effects.contact.normal import NormalContact
from tisim.effects.contact.overlapping_pairs import OverlappingPairs
from tisim.report.columns import ZLIB_LEVEL
from tisim.report.compressed_trajectory import CompressedTrajectory, FrameSequence
from tisim.scene.scene import Scene

MOST_STORED_CONTACTS = 4_000_000
"""Largest number of contacts, summed over the frames, for which a network is stored."""
USUAL_FORCE = 99.0
FORCE_STEPS = 255
"""Number of steps of the scale of forces."""


@dataclass(frozen=True)
class ContactNetwork:
    """The contacts of all frames.

    pairs : rows of both particles and the first and the last frame, shape (intervals, 4), sorted.
    forces : for one interval after another, the whole number q of the force in each of its frames.
    origin, step : of the square root of the force, N^(1/2).
    usual : a large force (N) that is not an outlier, the percentile USUAL_FORCE of the magnitudes; 0 if the
        contact laws do not define their force in NumPy, or if all are 0.
    """

    pairs: np.ndarray
    forces: np.ndarray
    origin: float
    step: float
    usual: float

    def values(self) -> np.ndarray:
        """Return the rounded forces, N, repulsion positive."""
        root = self.origin + self.step * self.forces
        return root * np.abs(root)

    def rounding(self) -> float:
        """Return the largest difference between a force and its rounded value, N."""
        return self.step * max(-self.origin, self.origin + FORCE_STEPS * self.step)

    def data(self) -> bytes:
        """Return the compressed numbers: the columns of ``pairs`` as differences (the first from the interval
        before, the others from the column before) in 32 bits and byte planes; then ``forces``."""
        change = self.pairs.astype(np.int64)
        change[:, 1] -= change[:, 0]
        change[:, 3] -= change[:, 2]
        change[1:, 0] -= self.pairs[:-1, 0]
        planes = np.ascontiguousarray(change.T, "<u4")[..., None].view(np.uint8).transpose(0, 2, 1)
        return zlib.compress(planes.tobytes() + self.forces.tobytes(), ZLIB_LEVEL)

    def facts(self) -> dict[str, object]:
        """Return all but the data as plain data."""
        return {
            "intervals": len(self.pairs), "forces": len(self.forces), "origin": self.origin,
            "step": self.step, "usual": self.usual,
        }  # fmt: skip


def contact_laws(effects: Sequence[Effect]) -> list[GranularContact | NormalContact]:
    """Return the contact laws among effects."""
    return [effect for effect in effects if isinstance(effect, GranularContact | NormalContact)]


def has_contacts(scene: Scene) -> bool:
    """Return whether the particles of a scene are spheres that touch by a contact law."""
    shaped = any(isinstance(effect, Shaped) for effect in scene.effects)
    return bool(contact_laws(scene.effects)) and not shaped


def normal_forces(pairs: OverlappingPairs) -> np.ndarray:
    """Return the sum of the normal forces (N) of the contact laws for each pair, without damping; repulsion
    is positive, and infinity stands for a law that does not define it."""
    total = np.zeros(len(pairs.i))
    for law in contact_laws(pairs.effects):
        total += law.normal_force(pairs)
    return total


def contact_network(frames: FrameSequence, trajectory: CompressedTrajectory) -> ContactNetwork | None:
    """Return the contacts of the frames of a compressed trajectory: overlapping spheres of different bodies;
    None if there are none, or more than MOST_STORED_CONTACTS."""
    ids, scene, acting = trajectory.ids(), frames.scene, frames.scene.acting()
    keys, counts, forces, total = [], [], [], 0
    for m, k in enumerate(trajectory.indices.tolist()):
        frame = frames[k]
        order = np.argsort(ids[m], kind="stable")
        row = order[np.searchsorted(ids[m], frame.arrays["id"], sorter=order).clip(max=len(order) - 1)]
        kept = ids[m, row] == frame.arrays["id"]
        row, state = row[kept], {name: values[kept] for name, values in frame.arrays.items()}
        position, radius = state["position"].astype(float), state["radius"].astype(float)
        sides = periodic_sides(scene.domain, frame.time)
        i, j = _between_bodies(scene, state, contacts(position, radius, sides=sides)).T
        apart = np.linalg.norm(nearest_image(position[j] - position[i], sides), axis=1)
        low, high = np.minimum(row[i], row[j]), np.maximum(row[i], row[j])
        total += len(i)
        if total > MOST_STORED_CONTACTS:
            return None
        keys.append(low * trajectory.particles + high)
        counts.append(np.full(len(i), m))
        overlap = np.maximum(radius[i] + radius[j] - apart, 0.0)
        forces.append(normal_forces(OverlappingPairs(state, i, j, overlap, acting)))
    return _network(keys, counts, forces, trajectory.particles) if total else None


def _between_bodies(scene: Scene, state: Mapping[str, np.ndarray], pairs: np.ndarray) -> np.ndarray:
    """Return the pairs without those of two spheres of one rigid body, which do not touch each other."""
    for effect in scene.effects:
        if isinstance(effect, Constraint):
            body = effect.bodies(state)[pairs]
            pairs = pairs[(body[:, 0] != body[:, 1]) | (body[:, 0] < 0)]
    return pairs


def _network(
    keys: Sequence[np.ndarray], frame: Sequence[np.ndarray], forces: Sequence[np.ndarray], particles: int
) -> ContactNetwork:
    """Return the network of contacts, given a number for each pair of rows, the frame and the force (N)."""
    key, when, force = np.concatenate(keys), np.concatenate(frame), np.concatenate(forces)
    if not np.isfinite(force).all():
        force = np.zeros(len(force))
    order = np.lexsort((when, key))
    key, when, force = key[order], when[order], force[order]
    begins = np.ones(len(key), bool)
    begins[1:] = (key[1:] != key[:-1]) | (when[1:] != when[:-1] + 1)
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(key)) - 1
    low, high = np.divmod(key[first], particles)
    root = np.sign(force) * np.sqrt(np.abs(force))
    origin = float(min(root.min(), 0.0))
    step = (float(root.max(initial=0.0)) - origin) / FORCE_STEPS
    whole = np.rint((root - origin) / (step or 1.0)).astype(np.uint8)
    pairs = np.stack([low, high, when[first], when[last]], axis=1)
    return ContactNetwork(pairs, whole, origin, step, float(np.percentile(np.abs(force), USUAL_FORCE)))
