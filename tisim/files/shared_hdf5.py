"""An HDF5 file that another process may be writing (see growing_hdf5.py), to be read as a file object.

A reader that has found the end of the file meets, a moment later, data behind that end. HDF5 refuses them, so
it hears that the file ends where no file does; what is not there is then missing from a block that has a
checksum.
"""

from __future__ import annotations

import os
from pathlib import Path

from tisim.files import regular_file
from tisim.files.file_object import Seekable
from tisim.files.superblock import SIZE, ends, superblock

_FAR = 1 << 62
"""bytes"""
LOOKS = 100
"""Times that a block is read at most, as HDF5 does it for files that it knows to be written."""


class Reading(Seekable):
    """The file at path, whose superblock is sound; ``whole``: whether it is as long as that says."""

    def __init__(self, path: Path) -> None:
        super().__init__(regular_file.opened(path, os.O_RDONLY))
        block = os.pread(self._handle, SIZE, 0)
        # The writer makes the file longer before it says so: this order, and no other, is safe.
        self.whole = os.fstat(self._handle).st_size >= ends(block)
        self._superblock = superblock(block, _FAR)

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        view = memoryview(buffer).cast("B")
        found = bytearray(self._settled(len(view)).ljust(len(view), b"\0"))
        if self._at < SIZE:
            there = self._superblock[self._at : self._at + len(view)]
            found[: len(there)] = there
        view[:] = found
        self._at += len(view)
        return len(view)

    def _settled(self, size: int) -> bytes:
        """Bytes that are the same when they are read twice: a block may be half written at a first look."""
        found = b""
        for _ in range(LOOKS):
            again, found = found, os.pread(self._handle, size, self._at)
            if again == found:
                break
        return found

    def _size(self) -> int:
        return _FAR
