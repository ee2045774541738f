"""An HDF5 file that another process may be writing (see growing_hdf5.py) is read as a file object.

A reader that has found the end of the file meets, a moment later, data behind that end. HDF5 refuses them, so
it hears that the file ends where no file does; what is not there is then missing from a block that has a
checksum.
"""

from __future__ import annotations

import os
from pathlib import Path

from tisim.files import regular_file
from tisim.files.file_object import Seekable
from tisim.files.superblock import SIZE, file_end, superblock

_END_OUT_OF_REACH = 1 << 62
"""HDF5 is given this end of the file, in bytes: it lies beyond that of any file."""
READ_ATTEMPTS = 100
"""A block is read at most so many times, as HDF5 does it for files that it knows to be written."""


class SharedFile(Seekable):
    """A shared file is the HDF5 file at path, whose superblock is valid, as ``h5py.File`` reads it.

    whole : whether the file is as long as its superblock says.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(regular_file.open_descriptor(path, os.O_RDONLY))
        block = os.pread(self._handle, SIZE, 0)
        # The writer makes the file longer before it says so: this order, and no other, is safe.
        self.whole = os.fstat(self._handle).st_size >= file_end(block)
        self._superblock = superblock(block, _END_OUT_OF_REACH)

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        view = memoryview(buffer).cast("B")
        content = bytearray(self._read_stable(len(view)).ljust(len(view), b"\0"))
        if self._position < SIZE:
            header = self._superblock[self._position : self._position + len(view)]
            content[: len(header)] = header
        view[:] = content
        self._position += len(view)
        return len(view)

    def _read_stable(self, size: int) -> bytes:
        """Return bytes that are the same when they are read twice: a block may be half written at first."""
        content = b""
        for _ in range(READ_ATTEMPTS):
            previous, content = content, os.pread(self._handle, size, self._position)
            if previous == content:
                break
        return content

    def _size(self) -> int:
        return _END_OUT_OF_REACH
