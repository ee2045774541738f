"""An HDF5 file that grows: any reader can open it after every write, and a full disk ends no process.

HDF5 in its single-writer mode writes what is new before what refers to it, so a file is sound after every
write but for its superblock: that marks the file as open, which keeps readers out for good when the writer
is killed, and says where the file ended when it was opened. And when a write fails, HDF5 ends the process.
So it writes to the object below, which leaves the mark out, keeps the superblock's end of the file up to
date, and reports what could not be written to its owner and not to HDF5, for which it is kept in memory.
"""

from __future__ import annotations

import os
from pathlib import Path

from tisim.files.atomic import write_at
from tisim.files.file_object import Seekable
from tisim.files.superblock import SIZE, superblock


class GrowingFile(Seekable):
    """A growing file is the HDF5 file at path, with a superblock of version 3, as h5py.File writes to it.

    failure : why something could not be written, after which nothing is; None while all is well.

    A process that is forked while it is open has the same file, and writes nothing to it: what HDF5 writes as
    that process ends would be of the moment of the fork.
    """

    def __init__(self, path: Path) -> None:
        self.failure: OSError | None = None
        self._process = os.getpid()
        super().__init__(os.open(path, os.O_RDWR | os.O_CLOEXEC))
        self._end = os.fstat(self._handle).st_size
        self._superblock = os.pread(self._handle, SIZE, 0)
        self._unwritten: list[tuple[int, bytes]] = []

    def write(self, data: bytes) -> int:  # type: ignore[override]
        offset, piece = self._position, bytes(data)
        self._position += len(piece)
        if self._process != os.getpid():
            return len(piece)
        if self.failure is None:
            try:
                self._write_piece(offset, piece)
            except OSError as failure:
                self._record_failure(failure)
        if self.failure is not None:
            self._unwritten.append((offset, piece))
        return len(piece)

    def _write_piece(self, offset: int, piece: bytes) -> None:
        if offset == 0:
            self._superblock = piece
            self._publish_end(self._end)
            return
        write_at(self._handle, piece, offset)
        if offset + len(piece) > self._end:
            self._publish_end(offset + len(piece))

    def _publish_end(self, end: int) -> None:
        write_at(self._handle, superblock(self._superblock, end), 0)
        self._end = end

    def _record_failure(self, failure: OSError) -> None:
        """Note the failure, and give back what was written of a piece behind the end."""
        self.failure = failure
        os.ftruncate(self._handle, self._end)

    def truncate(self, size: int | None = None) -> int:
        """Make the file at least this long, bytes; HDF5 asks for it once all is written."""
        end = self._end if size is None else size
        if self.failure is None and end > self._end and self._process == os.getpid():
            try:
                os.ftruncate(self._handle, end)
                self._publish_end(end)
            except OSError as failure:
                self._record_failure(failure)
        return end

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        view = memoryview(buffer).cast("B")
        first, last = self._position, self._position + len(view)
        content = bytearray(os.pread(self._handle, len(view), first).ljust(len(view), b"\0"))
        for offset, piece in self._unwritten:
            begin, end = max(offset, first), min(offset + len(piece), last)
            if begin < end:
                content[begin - first : end - first] = piece[begin - offset : end - offset]
        view[:] = content
        self._position = last
        return len(view)

    def _size(self) -> int:
        return max([self._end, *(offset + len(piece) for offset, piece in self._unwritten)])

    def writable(self) -> bool:
        return True
