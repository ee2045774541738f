"""Sequences of frames in memory: of a trajectory, kept while there is room, and of a list."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tisim.io.reader import Frame, Frames
from tisim.scene.scene import Scene

KEPT_BYTES = 500_000_000
"""Largest number of bytes of the frames that are kept."""


class KeptFrames:
    """The frames of a world as a sequence: the first ones that are read stay in memory, up to KEPT_BYTES; the
    others are read again whenever they are asked for."""

    def __init__(self, frames: Frames) -> None:
        self._frames, self._kept, self._bytes = frames, dict[int, Frame](), 0

    @property
    def scene(self) -> Scene:
        return self._frames.scene

    @property
    def times(self) -> np.ndarray:
        return self._frames.times

    @property
    def measures(self) -> Mapping[str, np.ndarray]:
        return self._frames.measures

    @property
    def missing(self) -> str:
        return self._frames.missing

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, k: int) -> Frame:
        k = range(len(self))[k]
        if k in self._kept:
            return self._kept[k]
        frame = self._frames[k]
        size = sum(values.nbytes for values in frame.arrays.values())
        if self._bytes + size <= KEPT_BYTES:
            self._kept[k] = frame
            self._bytes += size
        return frame

    def __iter__(self) -> Iterator[Frame]:
        return (self[k] for k in range(len(self)))


class ListedFrames:
    """A list of at least one frame as a sequence."""

    def __init__(self, scene: Scene, frames: Sequence[Frame]) -> None:
        self.scene, self._frames = scene, frames
        self.times = np.array([frame.time for frame in frames])
        names = frames[0].measures
        self.measures = {name: np.array([frame.measures[name] for frame in frames]) for name in names}

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, k: int) -> Frame:
        return self._frames[k]

    def __iter__(self) -> Iterator[Frame]:
        return iter(self._frames)
