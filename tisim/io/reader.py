"""Read back what a run has left: the frames of a trajectory, or the start and the end of a result.h5."""

from __future__ import annotations

import contextlib
import io
import os
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import h5py
import numpy as np

from tisim.errors import InputError, must
from tisim.files import checksum, regular_file
from tisim.files.shared_hdf5 import SharedFile
from tisim.files.superblock import SIGNATURE, SIZE, is_valid
from tisim.interrupt import defer_signals
from tisim.io import h5md
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

TIME_ROUNDING = 1e-9
"""Part of a duration by which the sum of its steps may fall short of it."""
RESULT = "tisim run 1"
"""The format of a result.h5."""
TRIES, PAUSE = 5, 0.01
"""Times that what looks damaged is read at most, for it may be half written; s between them."""
Clock = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Steps, times (s) and checksums of the frames of a trajectory."""
T = TypeVar("T")


@dataclass(frozen=True)
class Frame:
    """The particles at a time.

    time : s. step : how many steps the run has taken. arrays : as a Result's, shape (n,) or (n, 3), SI.
    """

    time: float
    step: int
    arrays: Arrays


class Frames:
    """Frames of one world in an open file, read one at a time: ``len``, index, iteration.

    Reading raises InputError where the file is damaged.
    """

    def __init__(self, file: _File, world: str | None) -> None:
        """world : the name of its group; None in a result.h5."""
        self._file, self._world = file, world

    @cached_property
    def scene(self) -> Scene:
        """What was run."""
        return Scene.from_dict(tomllib.loads(self._file.read(self._scene)))

    def _scene(self, file: h5py.File) -> str:
        return str(file.attrs["scene"]) if self._world is None else h5md.scene_text(file, self._world)

    @cached_property
    def times(self) -> np.ndarray:
        """The time of each frame, s, shape (frames,)."""
        if self._world is None:
            return self._file.read(lambda file: np.array([0.0, file.attrs["time"]]))
        return self._clock[1]

    @cached_property
    def _clock(self) -> Clock:
        return self._file.read(self._read_clock)

    def _read_clock(self, file: h5py.File) -> Clock:
        position = file[f"particles/{self._world}/position"]
        steps = position["step"][:]
        # A killed run may have left a last row that has no step yet.
        whole = len(steps) - int(len(steps) > 0 and steps[-1] == h5md.ABSENT)
        times, checksums = position["time"][:whole], file[f"{h5md.CHECKSUMS}/{self._world}"][:whole]
        for k in range(whole):
            same = h5md.clock_checksum(int(steps[k]), float(times[k])) == checksums[k, 0]
            must(same, "file", "undamaged", f"frame {k}, the checksum of whose time does not fit")
        return steps[:whole], times, checksums

    @property
    def missing(self) -> str:
        """What there is no frame of, in words, when the run has not reached its end; empty when it has."""
        last, end = float(self.times[-1]) if len(self) else 0.0, self.scene.duration
        if last >= end * (1 - TIME_ROUNDING):
            return ""
        return f"the run has come to t = {last:.6g} s of {end:.6g} s; what follows is missing"

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, k: int) -> Frame:
        k, read = range(len(self))[k], self._end if self._world is None else self._row
        return self._file.read(lambda file: read(file, k))

    def _end(self, file: h5py.File, k: int) -> Frame:
        """The start or the end of a result.h5."""
        arrays = {name: np.asarray(values) for name, values in file[("start", "end")[k]].items()}
        return Frame(float(self.times[k]), int(k and file["work"].attrs["steps"]), arrays)

    def _row(self, file: h5py.File, k: int) -> Frame:
        """A frame of a trajectory."""
        steps, times, checksums = self._clock
        group = file[f"particles/{self._world}"]
        there = group["id/value"][k] != h5md.ABSENT
        arrays = {
            name: np.asarray(element["value"][k])[there] for name, element in group.items() if name != "box"
        }
        same = h5md.frame_checksum(int(checksums[k, 0]), arrays) == checksums[k, 1]
        must(same, "file", "undamaged", f"frame {k}, whose checksum does not fit")
        return Frame(float(times[k]), int(steps[k]), arrays)

    def __iter__(self) -> Iterator[Frame]:
        return (self[k] for k in range(len(self)))


@contextmanager
def frames(path: str | Path, world: int = 0) -> Iterator[Frames]:
    """Frames of a world in a trajectory, or in a result.h5 (its start and end); while the ``with`` lasts.

    Also of a run that goes on or was killed. InputError when there is no such file or world.
    """
    with _opened(Path(path)) as file:
        names = file.read(_worlds)
        must(0 <= world < len(names), "world", f"0 to {len(names) - 1}", world)
        yield Frames(file, names[world])


def worlds(path: str | Path) -> int:
    """How many worlds a file has."""
    with _opened(Path(path)) as file:
        return len(file.read(_worlds))


@contextmanager
def undamaged() -> Iterator[None]:
    """While this lasts, what HDF5 says of a damaged file is an InputError."""
    try:
        yield
    except InputError:
        raise
    except (OSError, LookupError, RuntimeError, ValueError, TypeError) as error:
        raise InputError(f"file must be undamaged; received one that cannot be read ({error})") from error


class _File:
    """An HDF5 file to be read through ``source``."""

    def __init__(self, source: io.IOBase) -> None:
        self._source = source
        self._file: h5py.File | None = None

    # HDF5 calls Reading, in which no signal may be raised: it would be lost.
    @defer_signals()
    def read(self, look: Callable[[h5py.File], T]) -> T:
        """What look finds in the file; InputError where that is damaged.

        A writer that comes between two reads of one structure leaves HDF5 with what looks like damage; then
        HDF5 begins anew.
        """
        for left in reversed(range(TRIES)):
            try:
                with undamaged():
                    self._file = self._file or h5py.File(self._source, "r")
                    return look(self._file)
            except InputError:
                self.close()
                if not left:
                    raise
                time.sleep(PAUSE)
        raise AssertionError  # not reached

    @defer_signals()
    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


@contextmanager
def _opened(path: Path) -> Iterator[_File]:
    """The file, once the checksum of its superblock or of all of it has been found true."""
    rule, real = "a trajectory.h5 or result.h5 of a run", Path(os.path.realpath(path))
    head = regular_file.content(real, SIZE)
    must(head is not None and head.startswith(SIGNATURE), "file", rule, str(path))
    if not is_valid(head or b""):
        with contextlib.closing(_File(io.BytesIO(checksum.read_image(real, "file", rule)))) as file:
            run = file.read(lambda found: found.attrs.get("format") == RESULT)
            must(run, "file", f"{rule}, of the format {RESULT!r}", str(path))
            yield file
        return
    with SharedFile(real) as source, contextlib.closing(_File(source)) as file:
        must(source.whole, "file", "whole", f"{path}, which is cut short")
        file.read(lambda found: _of_tisim(found, path, rule))
        yield file


def _of_tisim(file: h5py.File, path: Path, rule: str) -> None:
    """InputError unless a trajectory is of tisim's writing, and has checksums."""
    creator = file.get("h5md/creator")
    must(creator is not None and creator.attrs.get("name") == b"tisim", "file", rule, str(path))
    if h5md.CHECKSUMS not in file:
        rule = f"{rule}, with checksums"
        raise InputError(f"file must be {rule}; received {str(path)!r}, without: {checksum.OLDER_VERSION}")


def _worlds(file: h5py.File) -> list[str | None]:
    """The groups of particles of the worlds in a trajectory; None for that in a result.h5."""
    return [None] if "start" in file else list(h5md.names(len(file["particles"])))
