"""Reading of frames of a run: from a trajectory, or the start and the end of a result.h5.

``frames`` opens a file once, and yields the frames of a world. A ``RecordedTrajectory`` opens a file whenever
frames are read, complete or still being written, and is a sequence of frames for each of its worlds.
"""

from __future__ import annotations

import contextlib
import io
import math
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast, overload

import h5py
import numpy as np

from tisim.errors import InputError, Words, must
from tisim.files import checksum, regular_file
from tisim.files.hdf5 import SIGNATURE, SIZE, SharedFile, is_valid
from tisim.interrupt import defer_signals
from tisim.io import h5md
from tisim.notebook import VIEWER_HEIGHT, ShownInNotebook, ViewerCell, named
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from pandas import DataFrame

TIME_ROUNDING = 1e-9
"""Relative rounding error allowed for the sum of all steps compared with the duration."""
RESULT = "tisim run 1"
"""The format attribute of a result.h5."""
FILE_READ_ATTEMPTS, RETRY_PAUSE = 5, 0.01
"""Largest number of attempts to read a file that looks damaged, because it may be in the middle of a write,
and the pause between attempts, s."""
Clock = tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, np.ndarray]]
"""Steps, times (s) and checksums of the frames of a trajectory, and their measures by name."""
T = TypeVar("T")


@dataclass(frozen=True)
class Frame:
    """The particles at one time.

    time : s.
    step : number of steps that the run has taken.
    arrays : by field name, shape (n,) or (n, 3), SI.
    measures : quantities of the world that effects measure, by name, such as ``floor_force_z``, SI; empty in
        a result.h5.
    """

    time: float
    step: int
    arrays: Arrays
    measures: Mapping[str, float] = field(default_factory=dict)


class Frames:
    """The frames of one world in an open file, read on access: ``len``, index, iteration.

    Reading raises InputError if the file is damaged.
    """

    def __init__(self, file: _RetryingFile, world: str | None, path: Path) -> None:
        """world : name of the group of the world; None in a result.h5. path : of the file."""
        self._file, self._world, self._path = file, world, path

    @cached_property
    def scene(self) -> Scene:
        """Return the scene of the run."""
        return Scene.from_dict(tomllib.loads(self._file.read(self._read_scene)))

    def _read_scene(self, file: h5py.File) -> str:
        return str(file.attrs["scene"]) if self._world is None else h5md.read_scene(file, self._world)

    @cached_property
    def times(self) -> np.ndarray:
        """Return the time of each frame, s, shape (frames,)."""
        if self._world is None:
            return self._file.read(lambda file: np.array([0.0, file.attrs["time"]]))
        return self._clock[1]

    @cached_property
    def measures(self) -> dict[str, np.ndarray]:
        """Return the measures of the world in each frame, by name, such as ``floor_force_z``, shape
        (frames,), SI; empty for a result.h5."""
        return {} if self._world is None else self._clock[3]

    @cached_property
    def _clock(self) -> Clock:
        return self._file.read(self._read_clock)

    def _read_clock(self, file: h5py.File) -> Clock:
        position = file[f"particles/{self._world}/position"]
        steps = position["step"][:]
        # A killed run may have left a last row without a step.
        count = len(steps) - int(len(steps) > 0 and steps[-1] == h5md.ABSENT)
        times, checksums = position["time"][:count], file[f"{h5md.CHECKSUMS}/{self._world}"][:count]
        observables = file.get(f"{h5md.OBSERVABLES}/{self._world}", {})
        series = {name: observable["value"][:count] for name, observable in observables.items()}
        for k in range(count):
            measures = {name: values[k] for name, values in series.items()}
            intact = h5md.clock_checksum(int(steps[k]), float(times[k]), measures) == checksums[k, 0]
            must(
                intact,
                "file",
                "undamaged",
                Words(f"frame {k}, the checksum of whose time and measures does not fit"),
            )
        return steps[:count], times, checksums, series

    @property
    def missing(self) -> str:
        """Return a sentence about the missing frames of an unfinished run; it is empty for a finished one.

        A run that ends by itself before its duration, as a packing does, has a result of that time.
        """
        reached, end = float(self.times[-1]) if len(self) else 0.0, self.scene.duration
        if reached >= end * (1 - TIME_ROUNDING) or reached == self._ended_at():
            return ""
        of_end = "" if self.scene.stepper.ends else f" of {end:.6g} s"
        return f"the run has come to t = {reached:.6g} s{of_end}; what follows is missing"

    def _ended_at(self) -> float:
        """Return the time (s) of a result.h5 whose run has ended, or of the one beside a trajectory; NaN if
        the run has failed or there is none."""
        if self._world is None:
            return self._file.read(_end_time)
        beside = self._path.with_name("result.h5")
        if not regular_file.exists(beside):
            return math.nan
        with _open_file(beside) as result:
            return result.read(_end_time)

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, k: int) -> Frame:
        k, read = range(len(self))[k], self._read_end if self._world is None else self._read_row
        return self._file.read(lambda file: read(file, k))

    def _read_end(self, file: h5py.File, k: int) -> Frame:
        """Return the start (k = 0) or the end (k = 1) from a result.h5."""
        arrays = {name: np.asarray(values) for name, values in file[("start", "end")[k]].items()}
        return Frame(float(self.times[k]), int(k and file["work"].attrs["steps"]), arrays)

    def _read_row(self, file: h5py.File, k: int) -> Frame:
        """Return frame k of a trajectory."""
        steps, times, checksums, series = self._clock
        group = file[f"particles/{self._world}"]
        present = group["id/value"][k] != h5md.ABSENT
        arrays = {
            name: np.asarray(element["value"][k])[present] for name, element in group.items() if name != "box"
        }
        intact = h5md.frame_checksum(int(checksums[k, 0]), arrays) == checksums[k, 1]
        must(intact, "file", "undamaged", Words(f"frame {k}, whose checksum does not fit"))
        measures = {name: float(values[k]) for name, values in series.items()}
        return Frame(float(times[k]), int(steps[k]), arrays, measures)

    def __iter__(self) -> Iterator[Frame]:
        return (self[k] for k in range(len(self)))


@contextmanager
def frames(path: str | Path, world: int = 0) -> Iterator[Frames]:
    """Yield the frames of a world in a trajectory, or in a result.h5 (its start and end).

    The run may be in progress, or have been killed. Raise InputError if there is no such file or world.
    """
    with _open_file(Path(path)) as file:
        names = file.read(_world_groups)
        must(0 <= world < len(names), "world", f"0 to {len(names) - 1}", world)
        yield Frames(file, names[world], Path(path))


def world_count(path: str | Path) -> int:
    """Return the number of worlds in a file."""
    with _open_file(Path(path)) as file:
        return len(file.read(_world_groups))


class RecordedWorld(Sequence[Frame], ShownInNotebook):
    """The frames of a world, a sequence in order of time: ``len``, index, slice, iteration.

    Frames are read on access. Frames that a running simulation adds are included when ``len`` is called
    again.
    """

    shown_by = "tisim.report.cells:trajectory_cell"

    def __init__(self, path: Path, world: int) -> None:
        self._path, self._world = path, world
        self._open_frames: Frames | None = None

    def _frames(self) -> AbstractContextManager[Frames]:
        return (
            nullcontext(self._open_frames)
            if self._open_frames is not None
            else frames(self._path, self._world)
        )

    @cached_property
    def scene(self) -> Scene:
        """Return the scene of the run."""
        with self._frames() as sequence:
            return sequence.scene

    @property
    def times(self) -> np.ndarray:
        """Return the time of each frame, s, shape (frames,)."""
        with self._frames() as sequence:
            return sequence.times

    @property
    def measures(self) -> dict[str, np.ndarray]:
        """Return the measures of the world in each frame, by name, such as ``floor_force_z``, shape
        (frames,), SI."""
        with self._frames() as sequence:
            return sequence.measures

    def __len__(self) -> int:
        with self._frames() as sequence:
            return len(sequence)

    @overload
    def __getitem__(self, k: int) -> Frame: ...
    @overload
    def __getitem__(self, k: slice) -> list[Frame]: ...
    def __getitem__(self, k: int | slice) -> Frame | list[Frame]:
        with self._frames() as sequence:
            return [sequence[n] for n in range(len(sequence))[k]] if isinstance(k, slice) else sequence[k]

    def __iter__(self) -> Iterator[Frame]:
        with self._frames() as sequence:
            yield from sequence

    def view(self, height: int = VIEWER_HEIGHT, **options: Any) -> ViewerCell:
        """Return a viewer of the frames, which a notebook shows in the output of a cell.

        height : pixels. options : of ``tisim.report.view``.
        """
        viewer: ViewerCell = named("tisim.report.view:view")(self, height, **options)
        return viewer

    def to_frame(self) -> DataFrame:
        """Return the time series as a pandas data frame, a row for each frame: time, number of particles,
        kinetic energy, displacement and velocity of the centre of gravity, and the measures of effects.

        ``frame.attrs["units"]`` has the unit of each column that has one. InputError if pandas is not
        installed.
        """
        return cast("DataFrame", named("tisim.plotting.time_series:time_series_frame")(self))

    def __repr__(self) -> str:
        return f"<{len(self)} frames of world {self._world} in {self._path}>"


class RecordedTrajectory(RecordedWorld):
    """A trajectory file. With one world it is the sequence of its frames; with several, each item of
    ``worlds`` is a sequence.

    Without ``with``, the file is opened for each access, or once for a loop. Within a ``with`` statement it
    stays open, and has the frames that existed when it was opened.
    """

    def __init__(self, path: str | Path) -> None:
        """Raise InputError if there is no such file."""
        super().__init__(Path(path).absolute(), 0)
        count = world_count(self._path)
        self.worlds: list[RecordedWorld] = [RecordedWorld(self._path, w) for w in range(count)]
        self._resources = ExitStack()

    def _frames(self) -> AbstractContextManager[Frames]:
        rule = "of one world (or ask worlds[w])"
        must(len(self.worlds) == 1, "trajectory", rule, Words(f"one of {len(self.worlds)}"))
        return self.worlds[0]._frames()

    def __enter__(self) -> Self:
        for world in self.worlds:
            world._open_frames = self._resources.enter_context(world._frames())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        for world in self.worlds:
            world._open_frames = None
        self._resources.close()

    def __repr__(self) -> str:
        return f"<trajectory of {len(self.worlds)} worlds in {self._path}>"


@contextmanager
def refuse_damage() -> Iterator[None]:
    """Convert the errors of HDF5 for a damaged file to InputError."""
    try:
        yield
    except InputError:
        raise
    except (OSError, LookupError, RuntimeError, ValueError, TypeError) as error:
        raise InputError(f"file must be undamaged; received one that cannot be read ({error})") from error


class _RetryingFile:
    """An HDF5 file read through ``source``, with retries if it looks damaged."""

    def __init__(self, source: io.IOBase) -> None:
        self._source = source
        self._file: h5py.File | None = None

    # HDF5 calls ``source``. A signal handler must not raise there, because HDF5 would discard the exception.
    @defer_signals()
    def read(self, extract: Callable[[h5py.File], T]) -> T:
        """Return the value that ``extract`` reads from the file; raise InputError if the data is damaged.

        If a write happens between two reads of one structure, it looks damaged to HDF5; the file is then
        opened again.
        """
        for attempts_left in reversed(range(FILE_READ_ATTEMPTS)):
            try:
                with refuse_damage():
                    self._file = self._file or h5py.File(self._source, "r")
                    return extract(self._file)
            except InputError:
                self.close()
                if not attempts_left:
                    raise
                time.sleep(RETRY_PAUSE)
        raise AssertionError  # not reached

    @defer_signals()
    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


@contextmanager
def _open_file(path: Path) -> Iterator[_RetryingFile]:
    """Yield the file after the checksum of its superblock, or of the whole file, is verified."""
    rule, real = "a trajectory.h5 or result.h5 of a run", regular_file.target(path)
    head = regular_file.content(real, SIZE)
    must(head is not None, "file", rule, Words(f"{str(path)!r}, which does not exist"))
    must((head or b"").startswith(SIGNATURE), "file", rule, str(path))
    if not is_valid(head or b""):
        with contextlib.closing(_RetryingFile(io.BytesIO(checksum.read_image(real, "file", rule)))) as file:
            is_result = file.read(lambda hdf5: hdf5.attrs.get("format") == RESULT)
            must(is_result, "file", f"{rule}, of the format {RESULT!r}", str(path))
            yield file
        return
    with SharedFile(real) as source, contextlib.closing(_RetryingFile(source)) as file:
        must(source.whole, "file", "whole", Words(f"{path}, which is cut short"))
        file.read(lambda hdf5: _check_creator(hdf5, path, rule))
        yield file


def _check_creator(file: h5py.File, path: Path, rule: str) -> None:
    """Raise InputError unless the file is a trajectory written by tisim, with checksums."""
    creator = file.get("h5md/creator")
    must(creator is not None and creator.attrs.get("name") == b"tisim", "file", rule, str(path))
    must(h5md.CHECKSUMS in file, "file", f"{rule}, with checksums", str(path))


def _end_time(file: h5py.File) -> float:
    """Return the time (s) at the end of a result.h5; NaN if the run has failed."""
    return float(file.attrs["time"]) if file.attrs["ok"] else math.nan


def _world_groups(file: h5py.File) -> list[str | None]:
    """Return the particle groups of the worlds in a trajectory; [None] for a result.h5."""
    return [None] if "start" in file else list(h5md.group_names(len(file["particles"])))
