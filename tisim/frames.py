"""Read back what a run has left: the frames of a trajectory, or the start and the end of a result.h5."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from tisim import h5md, regular, seal
from tisim.errors import InputError, must
from tisim.particles import Arrays
from tisim.reading import Reading
from tisim.scene import Scene
from tisim.superblock import SIGNATURE, SIZE, sound

ROUNDING = 1e-9
"""Part of a duration by which the sum of its steps may fall short of it."""
RESULT = "tisim run 1"
"""The format of a result.h5."""


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

    def __init__(self, file: h5py.File, world: str | None) -> None:
        """world : the name of its group; None in a result.h5."""
        self._file, self._world = file, world

    @cached_property
    def scene(self) -> Scene:
        """What was run."""
        with undamaged():
            alone = self._world is None
            text = self._file.attrs["scene"] if alone else h5md.scene_text(self._file, self._world or "")
        return Scene.from_dict(tomllib.loads(text))

    @cached_property
    def times(self) -> np.ndarray:
        """Of each frame, s, shape (frames,)."""
        if self._world is None:
            return np.array([0.0, self._file.attrs["time"]])
        return self._clock[1]

    @cached_property
    def _clock(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Steps, times (s) and checksums of the frames of a trajectory."""
        with undamaged():
            position = self._file[f"particles/{self._world}/position"]
            steps = position["step"][:]
            # A killed run may have left a last row that has no step yet.
            whole = len(steps) - int(len(steps) > 0 and steps[-1] == h5md.ABSENT)
            times, checksums = position["time"][:whole], self._file[f"{h5md.CHECKSUMS}/{self._world}"][:whole]
            for k in range(whole):
                same = h5md.clock_checksum(int(steps[k]), float(times[k])) == checksums[k, 0]
                must(same, "file", "undamaged", f"frame {k}, the checksum of whose time does not fit")
            return steps[:whole], times, checksums

    @property
    def missing(self) -> str:
        """What there is no frame of, in words, when the run has not reached its end; empty when it has."""
        last, end = float(self.times[-1]) if len(self) else 0.0, self.scene.duration
        if last >= end * (1 - ROUNDING):
            return ""
        return f"the run has come to t = {last:.6g} s of {end:.6g} s; what follows is missing"

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, k: int) -> Frame:
        k = range(len(self))[k]
        if self._world is None:
            arrays = {name: np.asarray(values) for name, values in self._file[("start", "end")[k]].items()}
            return Frame(float(self.times[k]), int(k and self._file["work"].attrs["steps"]), arrays)
        steps, times, checksums = self._clock
        with undamaged():
            group = self._file[f"particles/{self._world}"]
            there = group["id/value"][k] != h5md.ABSENT
            arrays = {
                name: np.asarray(element["value"][k])[there]
                for name, element in group.items()
                if name != "box"
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
        names = _worlds(file)
        must(0 <= world < len(names), "world", f"0 to {len(names) - 1}", world)
        yield Frames(file, names[world])


def worlds(path: str | Path) -> int:
    """How many worlds a file has."""
    with _opened(Path(path)) as file:
        return len(_worlds(file))


@contextmanager
def undamaged() -> Iterator[None]:
    """While this lasts, what HDF5 says of a damaged file is an InputError."""
    try:
        yield
    except InputError:
        raise
    except (OSError, LookupError, RuntimeError, ValueError, TypeError) as error:
        raise InputError(f"file must be undamaged; received one that cannot be read ({error})") from error


@contextmanager
def _opened(path: Path) -> Iterator[h5py.File]:
    """The file, once the checksum of its superblock or of all of it has been found true."""
    rule, real = "a trajectory.h5 or result.h5 of a run", Path(os.path.realpath(path))
    head = regular.content(real, SIZE)
    must(head is not None and head.startswith(SIGNATURE), "file", rule, str(path))
    if not sound(head or b""):
        with seal.opened(real, "file", RESULT, rule) as file:
            yield file
        return
    with Reading(real) as source:
        must(source.whole, "file", "whole", f"{path}, which is cut short")
        with undamaged():
            file = h5py.File(source, "r")
        with file:
            with undamaged():
                ours = h5md.CHECKSUMS in file and file["h5md/creator"].attrs.get("name") == b"tisim"
            must(ours, "file", rule, str(path))
            yield file


def _worlds(file: h5py.File) -> list[str | None]:
    """The groups of particles of the worlds in a trajectory; None for that in a result.h5."""
    if "start" in file:
        return [None]
    with undamaged():
        return list(h5md.names(len(file["particles"])))
