"""Read back what a run has left: the frames of a trajectory, or the start and the end of a result.h5."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from tisim.errors import InputError, must
from tisim.h5md import ABSENT
from tisim.particles import Arrays
from tisim.scene import Scene


@dataclass(frozen=True)
class Frame:
    """The particles at a time.

    time : s. step : how many steps the run has taken. arrays : as a Result's, shape (n,) or (n, 3), SI.
    """

    time: float
    step: int
    arrays: Arrays


class Frames:
    """Frames of one world in an open file, read one at a time: ``len``, index, iteration."""

    def __init__(self, file: h5py.File, group: h5py.Group | None) -> None:
        self._file, self._group = file, group

    @cached_property
    def scene(self) -> Scene:
        """What was run."""
        text = (self._file if self._group is None else self._group).attrs["scene"]
        return Scene.from_dict(tomllib.loads(text))

    @cached_property
    def times(self) -> np.ndarray:
        """Of each frame, s, shape (frames,)."""
        if self._group is None:
            return np.array([0.0, self._file.attrs["time"]])
        # A killed run may have left a last row that is not whole; its step is then missing or below 0.
        whole = int((self._group["position/step"][:] >= 0).sum())
        return np.asarray(self._group["position/time"][:whole])

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, k: int) -> Frame:
        k = range(len(self))[k]
        if self._group is None:
            arrays = {name: np.asarray(values) for name, values in self._file[("start", "end")[k]].items()}
            return Frame(float(self.times[k]), int(k and self._file["work"].attrs["steps"]), arrays)
        there = self._group["id/value"][k] != ABSENT
        arrays = {
            name: np.asarray(element["value"][k])[there]
            for name, element in self._group.items()
            if name != "box"
        }
        return Frame(float(self.times[k]), int(self._group["position/step"][k]), arrays)

    def __iter__(self) -> Iterator[Frame]:
        return (self[k] for k in range(len(self)))


@contextmanager
def frames(path: str | Path, world: int = 0) -> Iterator[Frames]:
    """Frames of a world in a trajectory, or in a result.h5 (its start and end); while the ``with`` lasts.

    Also of a run that goes on or was killed. InputError when there is no such file or world.
    """
    path = Path(path)
    must(path.is_file(), "file", "a trajectory.h5 or result.h5 of a run", str(path))
    file = _opened(path)
    try:
        yield Frames(file, _group(file, path, world))
    finally:
        file.close()


def worlds(path: str | Path) -> int:
    """How many worlds a file has."""
    file = _opened(Path(path))
    try:
        return len(file["particles"]) if "particles" in file else 1
    finally:
        file.close()


def _opened(path: Path) -> h5py.File:
    try:
        return h5py.File(path, "r", locking="best-effort")
    except OSError:
        pass
    try:
        # Of a run that goes on, or was killed.
        return h5py.File(path, "r", libver="latest", swmr=True, locking=False)
    except OSError as error:
        raise InputError(
            f"file must be a trajectory.h5 or result.h5 of a run; received {str(path)!r} ({error})"
        ) from None


def _group(file: h5py.File, path: Path, world: int) -> h5py.Group | None:
    if "start" in file and "end" in file and "scene" in file.attrs:
        must(world == 0, "world", "0 in a result.h5", world)
        return None
    ours = "h5md/creator" in file and file["h5md/creator"].attrs.get("name") == b"tisim"
    must(ours, "file", "a trajectory.h5 or result.h5 of a run", str(path))
    count = len(file["particles"])
    must(0 <= world < count, "world", f"0 to {count - 1}", world)
    return file["particles/all" if count == 1 else f"particles/world_{world}"]
