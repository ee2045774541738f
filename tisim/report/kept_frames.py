"""Frames of a trajectory that are read several times, and kept in memory while there is room."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

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
