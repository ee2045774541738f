"""An HDF5 file that is readable after every write, also while it grows, and handles a full disk.

HDF5 in its single-writer mode writes new data before the references to it. After every write a file is
therefore valid, except for its superblock, which marks the file as open and has the end of the file from when
it was opened. If the writer is killed, the mark keeps readers out for ever. Besides, HDF5 terminates the
process if a write fails. Therefore HDF5 writes to the object below, which leaves out the mark and keeps the
end of the file in the superblock up to date. A failed write is reported to the owner of the object and not to
HDF5; its data is kept in memory.
"""

from __future__ import annotations

import os
from pathlib import Path

from tisim.files.atomic import write_at
from tisim.files.file_object import Seekable
from tisim.files.superblock import SIZE, superblock


class GrowingFile(Seekable):
    """The HDF5 file at path, with a superblock of version 3, as written by h5py.File.

    failure : the error of the first failed write, after which nothing more is written; None before.

    A forked process shares the open file but writes nothing to it, because HDF5 would flush its state at the
    time of the fork when that process ends.
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
        """Record the failure, and truncate data of an incomplete write after the end."""
        self.failure = failure
        os.ftruncate(self._handle, self._end)

    def truncate(self, size: int | None = None) -> int:
        """Extend the file to at least this length, bytes; HDF5 calls it after all data is written."""
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
