"""A file object for reading an HDF5 file that another process may be writing (see growing_hdf5.py).

After a reader has read the end of the file from the superblock, the writer may add data beyond it, and HDF5
refuses such data. HDF5 is therefore given an end of the file that is never reached. Data that are missing
because of this then fail the checksum of their block.
"""

from __future__ import annotations

import os
from pathlib import Path

from tisim.files import regular_file
from tisim.files.file_object import Seekable
from tisim.files.superblock import SIZE, file_end, superblock

_END_OUT_OF_REACH = 1 << 62
"""The end of the file that HDF5 is given, in bytes, beyond that of any file."""
READ_ATTEMPTS = 100
"""Largest number of reads of a block; HDF5 uses the same limit for files that are being written."""


class SharedFile(Seekable):
    """The HDF5 file at path with a valid superblock, as read by ``h5py.File``.

    whole : whether the file is at least as long as its superblock states.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(regular_file.open_descriptor(path, os.O_RDONLY))
        block = os.pread(self._handle, SIZE, 0)
        # The writer extends the file before it updates the superblock, so the superblock must be read first.
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
        """Return bytes that are equal in two consecutive reads, because a block may be partly written."""
        content = b""
        for _ in range(READ_ATTEMPTS):
            previous, content = content, os.pread(self._handle, size, self._position)
            if previous == content:
                break
        return content

    def _size(self) -> int:
        return _END_OUT_OF_REACH
