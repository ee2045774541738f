"""A trajectory file, complete or still being written, as a sequence of frames for each of its worlds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Self, overload

import numpy as np

from tisim.errors import Words, must
from tisim.io.reader import Frame, Frames, frames, world_count
from tisim.scene.scene import Scene


class RecordedWorld(Sequence[Frame]):
    """The frames of a world, a sequence in order of time: ``len``, index, slice, iteration.

    Frames are read on access. Frames that a running simulation adds are included when ``len`` is called
    again.
    """

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
