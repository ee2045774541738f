"""The contacts of grains in all frames, as a browser draws them: lines between centres.

A contact of two rows of a ``CompressedTrajectory`` is stored once for each interval of frames in which it
lasts. Its overlap in each frame is rounded to 8 bits, on a scale that ends at the largest overlap of the run.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tisim.analysis.beds import contacts
from tisim.analysis.separations import nearest_image, periodic_sides
from tisim.effects.base import Shaped
from tisim.effects.contact.granular.contact import GranularContact
from tisim.report.columns import ZLIB_LEVEL
from tisim.report.compressed_trajectory import CompressedTrajectory, FrameSequence
from tisim.scene.scene import Scene

MOST_STORED_CONTACTS = 4_000_000
"""Largest number of contacts, summed over the frames, for which a network is stored."""
USUAL_OVERLAP = 99.0
OVERLAP_STEPS = 255
"""Number of steps of the scale of overlaps."""


@dataclass(frozen=True)
class ContactNetwork:
    """The contacts of all frames.

    pairs : rows of both particles and the first and the last frame, shape (intervals, 4), sorted.
    overlaps : for one interval after another, the overlap in each of its frames, rounded.
    largest : overlap (m) that the last step of their scale stands for. usual : a large overlap (m) that is
        not an outlier, the percentile USUAL_OVERLAP.
    """

    pairs: np.ndarray
    overlaps: np.ndarray
    largest: float
    usual: float

    def data(self) -> bytes:
        """Return the compressed numbers: the columns of ``pairs`` as differences (the first from the interval
        before, the others from the column before) in 32 bits and byte planes; then ``overlaps``."""
        change = self.pairs.astype(np.int64)
        change[:, 1] -= change[:, 0]
        change[:, 3] -= change[:, 2]
        change[1:, 0] -= self.pairs[:-1, 0]
        planes = np.ascontiguousarray(change.T, "<u4")[..., None].view(np.uint8).transpose(0, 2, 1)
        return zlib.compress(planes.tobytes() + self.overlaps.tobytes(), ZLIB_LEVEL)

    def facts(self) -> dict[str, object]:
        """Return all but the data as plain data."""
        return {
            "intervals": len(self.pairs), "overlaps": len(self.overlaps), "largest": self.largest,
            "usual": self.usual,
            "steps": OVERLAP_STEPS,
        }  # fmt: skip


def has_contacts(scene: Scene) -> bool:
    """Return whether the particles of a scene are spheres that touch by a granular contact law."""
    laws = [effect for effect in scene.effects if isinstance(effect, GranularContact)]
    return bool(laws) and not any(isinstance(effect, Shaped) for effect in scene.effects)


def contact_network(frames: FrameSequence, trajectory: CompressedTrajectory) -> ContactNetwork | None:
    """Return the contacts of the frames of a compressed trajectory: overlapping spheres; None if there are
    none, or more than MOST_STORED_CONTACTS."""
    ids = trajectory.ids()
    keys, counts, depths, total = [], [], [], 0
    for m, k in enumerate(trajectory.indices.tolist()):
        frame = frames[k]
        order = np.argsort(ids[m], kind="stable")
        row = order[np.searchsorted(ids[m], frame.arrays["id"], sorter=order).clip(max=len(order) - 1)]
        kept = ids[m, row] == frame.arrays["id"]
        row, position = row[kept], frame.arrays["position"][kept].astype(float)
        radius = frame.arrays["radius"][kept].astype(float)
        sides = periodic_sides(frames.scene.domain, frame.time)
        i, j = contacts(position, radius, sides=sides).T
        apart = np.linalg.norm(nearest_image(position[j] - position[i], sides), axis=1)
        low, high = np.minimum(row[i], row[j]), np.maximum(row[i], row[j])
        total += len(i)
        if total > MOST_STORED_CONTACTS:
            return None
        keys.append(low * trajectory.particles + high)
        counts.append(np.full(len(i), m))
        depths.append(radius[i] + radius[j] - apart)
    return _network(keys, counts, depths, trajectory.particles) if total else None


def _network(
    keys: Sequence[np.ndarray], frame: Sequence[np.ndarray], depth: Sequence[np.ndarray], particles: int
) -> ContactNetwork:
    """Return the network of contacts, given a number for each pair of rows, the frame and the overlap (m)."""
    key, when, overlap = np.concatenate(keys), np.concatenate(frame), np.concatenate(depth)
    order = np.lexsort((when, key))
    key, when, overlap = key[order], when[order], overlap[order]
    begins = np.ones(len(key), bool)
    begins[1:] = (key[1:] != key[:-1]) | (when[1:] != when[:-1] + 1)
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(key)) - 1
    low, high = np.divmod(key[first], particles)
    largest = float(overlap.max())
    steps = np.rint(overlap / (largest or 1.0) * OVERLAP_STEPS).astype(np.uint8)
    pairs = np.stack([low, high, when[first], when[last]], axis=1)
    return ContactNetwork(pairs, steps, largest, float(np.percentile(overlap, USUAL_OVERLAP)))
