"""A run as a browser plays it: the frames of a trajectory, rounded and compressed.

A particle has a row in every frame from the first to the last in which it exists. A row is used again by a
later particle, so that the number of rows is about the largest number of particles at one time. The column
``id`` has the id of the particle in a row, or ABSENT.

Positions are stored in bins, and shown at the middle of their bin: at most half a bin away, along each axis.
Along a periodic axis the side of the box is divided into 2^16 bins, so that a particle that crosses a face
makes a small step modulo 2^16; along other axes the range of the run is divided. If a bin were coarse
compared with the particles, as when some of them fly far away, there are 2^24 bins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tisim.domains.domain import Domain
from tisim.effects.base import Shaped
from tisim.effects.base.shaped import ORIENTATION
from tisim.engine.assembly import units
from tisim.errors import Words, must
from tisim.io.h5md import ABSENT
from tisim.io.reader import Frame
from tisim.plotting.colours import WIDE_RANGE
from tisim.report.columns import WHOLE_TYPES, Column, Scale, column, rounded, uniform_scale, whole_numbers
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

BINS_PER_RADIUS = 32.0
"""A bin is at most the radius of small particles over this number, or there are 2^24 bins."""
SMALL_PERCENTILE = 5.0
"""Percentile of the radii that counts as small."""
EXACT_VALUES = 4_000_000
"""Up to this number of values, quantities that change are rounded to 16 bits, otherwise to 8."""
COLOURED_PERCENTILES = (0.5, 99.5)
"""Percentiles between which values are coloured at first, if the range is more than twice as wide."""
FROM_ZERO = 0.05
"""A linear scale of colours begins at 0 if its lower end would be below this part of the upper end."""
SAMPLED_VALUES = 200_000
"""Number of values of a quantity from which percentiles are computed."""


class FrameSequence(Protocol):
    """The frames of a world, such as ``Frames`` or ``RecordedWorld``."""

    @property
    def scene(self) -> Scene: ...

    @property
    def times(self) -> np.ndarray: ...

    @property
    def measures(self) -> Mapping[str, np.ndarray]: ...

    def __len__(self) -> int: ...

    def __getitem__(self, k: int, /) -> Frame: ...

    def __iter__(self) -> Iterator[Frame]: ...


@dataclass(frozen=True)
class CompressedTrajectory:
    """Compressed frames of a run.

    times : of the frames, s. indices : of the frames in the trajectory.
    particles : number of rows. counts : number of particles in each frame.
    columns : ``id``, ``position`` and the other quantities.
    low, high : corners of a box (m) around the particles in all frames, with their radii.
    """

    times: np.ndarray
    indices: np.ndarray
    particles: int
    counts: np.ndarray
    columns: tuple[Column, ...]
    low: np.ndarray
    high: np.ndarray

    def column(self, name: str) -> Column:
        """Return a column by name."""
        return next(one for one in self.columns if one.name == name)

    def ids(self) -> np.ndarray:
        """Return the id of the particle in each row, or ABSENT; shape (frames, rows)."""
        whole = whole_numbers(self.column("id"), self.particles)[..., 0].astype(np.int64) + ABSENT
        return np.broadcast_to(whole, (len(self.times), self.particles))

    def size(self) -> int:
        """Return the number of compressed bytes."""
        return sum(len(one.data) for one in self.columns)

    def facts(self) -> dict[str, object]:
        """Return all but the data of the columns as plain data."""
        return {
            "times": self.times.tolist(), "indices": self.indices.tolist(), "particles": self.particles,
            "counts": self.counts.tolist(), "columns": [one.facts() for one in self.columns],
            "low": self.low.tolist(), "high": self.high.tolist(),
        }  # fmt: skip


def compress(
    frames: FrameSequence,
    chosen: Sequence[int],
    part: int = 1,
    names: Sequence[str] | None = None,
    logarithmic: bool = True,
) -> CompressedTrajectory:
    """Return chosen frames of a run, compressed.

    chosen : increasing indices of frames. part : 1 for all particles; otherwise those whose id is a multiple
        of it. names : quantities for colours; None for all that frames have (see ``quantities``).
    logarithmic : whether quantities whose values spread over decades have logarithmic scales.

    Raise InputError if there are no frames, or if a quantity does not exist.
    """
    must(len(chosen) > 0, "file", "one with a frame", Words("one with none yet"))
    survey = _survey(frames, chosen, part)
    known = sorted(survey.ranges)
    for name in names or ():
        must(name in known, "field", f"one of {', '.join(known)}", name)
    wanted = [name for name in known if names is None or name in (*names, "radius", "shape")]
    for name in () if logarithmic else wanted:
        survey.ranges[name].linear = True
    columns = _columns(frames, chosen, part, survey, wanted)
    times = np.asarray(frames.times)[list(chosen)]
    return CompressedTrajectory(
        times, np.array(chosen), survey.rows, survey.counts, columns, survey.low, survey.high
    )


def quantities(arrays: Arrays) -> dict[str, np.ndarray]:
    """Return the quantities of particles that can be shown as colours, by name, shape (n,): scalars, and the
    lengths of vectors, such as ``speed``."""
    found = {}
    for name, values in arrays.items():
        if name in ("position", "id", ORIENTATION.name):
            continue
        if values.ndim == 1:
            found[name] = values
        elif values.ndim == 2 and values.shape[1] == 3:
            label = "speed" if name == "velocity" else f"{name}_size"
            found[label] = np.linalg.norm(values.astype(float), axis=1)
    return found


@dataclass
class _Survey:
    """The row of each particle and the ranges of quantities, from a first pass over the frames."""

    rows: int
    row_of: list[np.ndarray]
    counts: np.ndarray
    low: np.ndarray
    high: np.ndarray
    centres: tuple[np.ndarray, np.ndarray]
    small: float
    ranges: dict[str, _Range]


@dataclass
class _Range:
    """The range of a quantity over all frames, with a sample of its values."""

    low: float
    high: float
    whole: bool
    finite: bool
    sample: list[np.ndarray]
    linear: bool = False


def _part(frame: Frame, part: int) -> Arrays:
    """Return the arrays of a part of the particles."""
    if part == 1:
        return frame.arrays
    kept = frame.arrays["id"] % part == 0
    return {name: values[kept] for name, values in frame.arrays.items()}


def _survey(frames: FrameSequence, chosen: Sequence[int], part: int) -> _Survey:
    """Read the chosen frames for the ranges of quantities, and for the rows of particles."""
    rows, held, free = 0, dict[int, int](), list[int]()
    row_of, counts, radii = list[np.ndarray](), list[int](), list[np.ndarray]()
    ranges = dict[str, _Range]()
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    corners = np.full(3, np.inf), np.full(3, -np.inf)
    names: set[str] | None = None
    before = row = np.empty(0, np.int64)
    for k in chosen:
        arrays = _part(frames[k], part)
        ids, position, radius = arrays["id"], arrays["position"].astype(float), arrays["radius"].astype(float)
        if not len(row_of) or not np.array_equal(ids, before):
            present, before = set(ids.tolist()), ids
            free += sorted(row for one, row in held.items() if one not in present)
            held = {one: row for one, row in held.items() if one in present}
            for one in ids.tolist():
                if one not in held:
                    held[one] = free.pop(0) if free else rows
                    rows = max(rows, held[one] + 1)
            row = np.array([held[one] for one in ids.tolist()], np.int64)
        row_of.append(row)
        counts.append(len(ids))
        here = quantities(arrays)
        names = set(here) if names is None else names & set(here)
        if len(ids):
            radii.append(radius[:: max(1, len(radius) // 1000)])
            low = np.minimum(low, (position - radius[:, None]).min(axis=0))
            high = np.maximum(high, (position + radius[:, None]).max(axis=0))
            corners = (
                np.minimum(corners[0], position.min(axis=0)),
                np.maximum(corners[1], position.max(axis=0)),
            )
        for name, values in here.items():
            _extend(ranges, name, values, max(1, len(values) * len(chosen) // SAMPLED_VALUES))
    if not radii:
        low, high, corners = np.zeros(3), np.ones(3), (np.zeros(3), np.ones(3))
    small = float(np.percentile(np.concatenate(radii), SMALL_PERCENTILE)) if radii else 1.0
    common = {name: ranges[name] for name in ranges if name in (names or ())}
    return _Survey(rows, row_of, np.array(counts), low, high, corners, small, common)


def _extend(ranges: dict[str, _Range], name: str, values: np.ndarray, stride: int) -> None:
    """Add the values of a quantity in a frame to its range."""
    finite = np.isfinite(values)
    known = values[finite].astype(float)
    one = ranges.setdefault(name, _Range(np.inf, -np.inf, values.dtype.kind in "iu", True, []))
    one.finite &= bool(finite.all())
    if len(known):
        one.low, one.high = min(one.low, float(known.min())), max(one.high, float(known.max()))
        one.sample.append(known[::stride])


def _columns(
    frames: FrameSequence, chosen: Sequence[int], part: int, survey: _Survey, names: Sequence[str]
) -> tuple[Column, ...]:
    """Read the chosen frames again, and return them as columns."""
    scene, shape, unit_of = frames.scene, (len(chosen), survey.rows), units(frames.scene)
    bins = _bins(scene.domain, survey)
    values = max(shape[0] * shape[1], 1)
    scales = {
        name: _scale(survey.ranges[name], 16 if values * len(names) <= EXACT_VALUES else 8) for name in names
    }
    turned = any(isinstance(one, Shaped) for one in scene.effects)
    ids = np.full((*shape, 1), ABSENT, np.int32)
    places = np.zeros((*shape, 3), WHOLE_TYPES[bins.bits])
    whole = {name: np.zeros((*shape, 1), WHOLE_TYPES[scale.bits]) for name, scale in scales.items()}
    turns = np.zeros((*shape, 4))
    absent = np.ones(survey.rows, bool)
    for m, (k, row) in enumerate(zip(chosen, survey.row_of, strict=True)):
        arrays = _part(frames[k], part)
        if m:
            # Rows without a particle keep their last values, which are not shown and take no space.
            for stored in (places, turns, *whole.values()):
                stored[m] = stored[m - 1]
        ids[m, row, 0] = arrays["id"]
        places[m, row] = _binned(arrays["position"].astype(float), bins, scene.domain)
        here = quantities(arrays)
        for name, scale in scales.items():
            whole[name][m, row] = rounded(here[name][:, None].astype(float), scale)
        if turned:
            turns[m, row] = _continued(arrays[ORIENTATION.name].astype(float), turns[m, row])
        # A row takes the values of its first particle from the beginning.
        for stored in (places, turns, *whole.values()):
            stored[:m, row[absent[row]]] = stored[m, row[absent[row]]]
        absent[row] = False
    columns = [
        column("id", "", Scale(32, (float(ABSENT),), (1.0,)), (ids - ABSENT).astype(np.uint32)),
        column("position", "m", bins, places),
    ]
    if turned:
        scale = uniform_scale([(-1.0, 1.0)] * 4, 16)
        columns.append(column(ORIENTATION.name, "", scale, rounded(turns, scale)))
    for name in names:
        shown = _shown(survey.ranges[name])
        columns.append(column(name, _unit(name, unit_of), scales[name], whole[name], shown))
    return tuple(columns)


def _unit(name: str, unit_of: Mapping[str, str]) -> str:
    """Return the unit of a quantity for colours."""
    return unit_of.get("velocity" if name == "speed" else name.removesuffix("_size"), "")


def _bins(domain: Domain, survey: _Survey) -> Scale:
    """Return the scale of positions; its numbers stand for the middle of bins."""
    low, high = survey.centres
    box_low, box_high = domain.bounds()
    if box_low is not None and box_high is not None:
        joined = np.array(domain.joined())
        low, high = np.where(joined, box_low, low), np.where(joined, box_high, high)
    side = np.maximum(high - low, 1e-9 * max(float((high - low).max()), survey.small))
    coarse = float(side.max()) / 2**16 > survey.small / BINS_PER_RADIUS
    # The lowest 8 of 32 bits are 0, because single precision, in which graphics compute, has 24.
    bits, unused = (32, 8) if coarse else (16, 0)
    step = side / 2**bits
    middle = low + 0.5 * step * 2**unused
    return Scale(bits, tuple(middle.tolist()), tuple(step.tolist()), unused=unused)


def _binned(position: np.ndarray, bins: Scale, domain: Domain) -> np.ndarray:
    """Return the numbers of the bins of positions (m), shape (n, 3)."""
    number, step = 2 ** (bins.bits - bins.unused), np.array(bins.step) * 2**bins.unused
    low = np.array(bins.origin) - 0.5 * step
    bin_ = np.floor((position - low) / step)
    inside = np.where(np.array(domain.joined()), np.mod(bin_, number), np.clip(bin_, 0, number - 1))
    return inside.astype(WHOLE_TYPES[bins.bits]) << WHOLE_TYPES[bins.bits](bins.unused)


def _continued(turns: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return quaternions with the sign that is nearer to the quaternions before, because q and -q are the
    same orientation; shape (n, 4)."""
    return np.where((turns * before).sum(axis=1, keepdims=True) < 0, -turns, turns)


def _scale(found: _Range, bits: int) -> Scale:
    """Return the scale of a quantity: whole numbers are exact, and the end of the range of others is."""
    low, high = (found.low, found.high) if found.low <= found.high else (0.0, 0.0)
    if found.whole:
        needed = next(n for n in WHOLE_TYPES if high - low < 2**n)
        return Scale(needed, (low,), (1.0,))
    if _spreads(found):
        ends = uniform_scale([(float(np.log(low)), float(np.log(high)))], bits, not found.finite)
        return Scale(bits, ends.origin, ends.step, True, ends.missing)
    return uniform_scale([(low, high)], bits, not found.finite)


def _spreads(found: _Range) -> bool:
    """Return whether a logarithmic scale suits a quantity."""
    if found.linear or not (found.low > 0 and found.high > WIDE_RANGE * found.low):
        return False
    return float(np.median(np.concatenate(found.sample))) < 0.1 * found.high


def _shown(found: _Range) -> tuple[float, float]:
    """Return the range of the colours at first."""
    if not found.sample:
        return 0.0, 1.0
    usual = np.percentile(np.concatenate(found.sample), COLOURED_PERCENTILES)
    outliers = found.high - found.low > 2 * (usual[1] - usual[0]) > 0
    low, high = (
        (float(usual[0]), float(usual[1])) if outliers and not found.whole else (found.low, found.high)
    )
    # Such as speeds: a scale from 0 is easier to read.
    return (
        (0.0, high) if 0 <= low < FROM_ZERO * high and not (found.whole or _spreads(found)) else (low, high)
    )
