"""Compression of one quantity of all particles in all frames, for reports that are read by a browser.

Values are rounded to whole numbers q of 8, 16 or 32 bits,

    value = origin + step q,    or exp(origin + step q) on a logarithmic scale

and q is stored as its first or second difference in time, whichever is smaller, modulo 2^bits. The sign of a
difference is moved to its lowest bit, so that small differences have high bytes of 0. The bytes are stored in
planes, all lowest bytes first, one particle after another, and compressed by zlib, which browsers inflate
themselves (``DecompressionStream``). static/trajectory.js is the inverse in a browser.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

WHOLE_TYPES = {8: np.uint8, 16: np.uint16, 32: np.uint32}
"""Types of whole numbers by their number of bits."""
HIGHEST_ORDER = 2
"""Largest order of the differences in time."""
ZLIB_LEVEL = 6
"""Level 9 saves 0.7 % of the positions of a bed of grains, and takes 3 times as long."""
SAMPLED_PARTICLES = 4096
"""Number of particles from which the order of the differences is chosen."""


@dataclass(frozen=True)
class Scale:
    """The rule by which whole numbers stand for values.

    bits : of a whole number. origin, step : one number for each component, in the unit of the values, or in
        the natural logarithm of it on a ``logarithmic`` scale.
    missing : whether the largest whole number stands for a value that is not finite.
    unused : number of lowest bits that are 0.
    """

    bits: int
    origin: tuple[float, ...]
    step: tuple[float, ...]
    logarithmic: bool = False
    missing: bool = False
    unused: int = 0

    @property
    def largest(self) -> int:
        """Return the largest whole number."""
        return int(2**self.bits - 1)

    def values(self, whole: np.ndarray) -> np.ndarray:
        """Return the values of whole numbers, shape (..., components)."""
        values = np.array(self.origin) + np.array(self.step) * whole
        values = np.exp(values) if self.logarithmic else values
        return np.where(whole == self.largest, np.nan, values) if self.missing else values

    def rounding(self) -> float:
        """Return the largest difference between a value and the value shown for it, in the unit of the
        values; on a logarithmic scale it is relative to the value."""
        half = 0.5 * max(self.step) * 2**self.unused
        return float(np.expm1(half)) if self.logarithmic else half


@dataclass(frozen=True)
class Column:
    """A compressed quantity.

    name, unit : of the quantity; the unit is "" for a pure number.
    frames : number of frames; 1 for a quantity that does not change.
    order : order of the differences in time.
    shown : least and largest value of the colours at first, in the unit of the quantity.
    """

    name: str
    unit: str
    scale: Scale
    frames: int
    order: int
    data: bytes
    shown: tuple[float, float] | None = None

    def facts(self) -> dict[str, object]:
        """Return all but the data as plain data."""
        scale = self.scale
        return {
            "name": self.name, "unit": self.unit, "bits": scale.bits, "origin": scale.origin,
            "step": scale.step, "logarithmic": scale.logarithmic, "missing": scale.missing,
            "frames": self.frames, "order": self.order, "rounding": scale.rounding(), "shown": self.shown,
        }  # fmt: skip


def column(
    name: str, unit: str, scale: Scale, whole: np.ndarray, shown: tuple[float, float] | None = None
) -> Column:
    """Return the compressed whole numbers of a quantity, shape (frames, particles, components); one frame is
    stored if all are equal."""
    if len(whole) > 1 and bool((whole == whole[0]).all()):
        whole = whole[:1]
    order = _best_order(whole)
    planes = _planes(_differences(whole, order))
    return Column(name, unit, scale, len(whole), order, zlib.compress(planes.tobytes(), ZLIB_LEVEL), shown)


def whole_numbers(one: Column, particles: int) -> np.ndarray:
    """Return the whole numbers of a compressed quantity of some particles, shape (frames, particles,
    components)."""
    kind, parts = WHOLE_TYPES[one.scale.bits], len(one.scale.origin)
    size = np.dtype(kind).itemsize
    planes = np.frombuffer(zlib.decompress(one.data), np.uint8).reshape(parts, size, particles, one.frames)
    little_endian = np.moveaxis(planes, 1, -1).copy().view(np.dtype(kind).newbyteorder("<"))
    folded = little_endian[..., 0].astype(kind)
    whole: np.ndarray = ((folded >> 1) ^ (0 - (folded & 1)).astype(kind)).transpose(2, 1, 0).copy()
    for level in reversed(range(one.order)):
        whole[level:] = np.cumsum(whole[level:], axis=0, dtype=kind)
    return whole


def uniform_scale(values: Sequence[tuple[float, float]], bits: int, missing: bool = False) -> Scale:
    """Return the scale on which the least and the largest value of each component are exact."""
    intervals = 2**bits - 1 - missing
    step = tuple((high - low) / intervals for low, high in values)
    return Scale(bits, tuple(low for low, _ in values), step, missing=missing)


def rounded(values: np.ndarray, scale: Scale) -> np.ndarray:
    """Return the whole numbers nearest to values, shape (..., components)."""
    finite = np.isfinite(values)
    known = np.where(finite, values, np.exp(scale.origin) if scale.logarithmic else scale.origin)
    known = np.log(known) if scale.logarithmic else known
    step = np.where(np.array(scale.step) > 0, scale.step, 1.0)
    whole = np.rint((known - np.array(scale.origin)) / step)
    whole = np.clip(whole, 0, scale.largest - scale.missing)
    return np.where(finite, whole, scale.largest).astype(WHOLE_TYPES[scale.bits])


def _differences(whole: np.ndarray, order: int) -> np.ndarray:
    """Return the differences in time modulo 2^bits, of rising order in the first frames, with the sign as
    their lowest bit."""
    change = whole.copy()
    for level in range(order):
        change[level + 1 :] -= change[level:-1].copy()
    sign = change >> (8 * whole.itemsize - 1)
    folded: np.ndarray = (change << 1) ^ (0 - sign).astype(whole.dtype)
    return folded


def _planes(folded: np.ndarray) -> np.ndarray:
    """Return bytes in the order component, byte of a number, particle, frame; shape of these lengths.

    The motion of one particle after another compresses better than one frame after another: by 5 % for
    positions of a bed of grains.
    """
    in_order = np.ascontiguousarray(folded.transpose(2, 1, 0), folded.dtype.newbyteorder("<"))
    return np.moveaxis(in_order[..., None].view(np.uint8), -1, 1)


def _best_order(whole: np.ndarray) -> int:
    """Return the order of differences whose bytes have the least entropy."""
    some = whole[:, :: max(1, whole.shape[1] // SAMPLED_PARTICLES)]
    orders = range(min(HIGHEST_ORDER, len(whole) - 1) + 1)
    return min(orders, key=lambda order: _entropy(_planes(_differences(some, order))))


def _entropy(planes: np.ndarray) -> float:
    """Return the sum over planes of the entropy of their bytes, in bits."""
    total = 0.0
    parts, size, particles, frames = planes.shape
    for plane in planes.reshape(parts * size, particles * frames):
        share = np.bincount(plane, minlength=256) / max(plane.size, 1)
        total -= float((share[share > 0] * np.log2(share[share > 0])).sum())
    return total
