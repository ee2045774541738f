"""HDF5 files that grow: readable after every write, also by another process, and intact on a full disk.

HDF5 in its single-writer mode writes new data before the references to it. After every write a file is
therefore valid, except for its superblock, which marks the file as open and has the end of the file from when
it was opened. If the writer is killed, the mark keeps readers out for ever. Besides, HDF5 terminates the
process if a write fails. Therefore HDF5 writes to a ``GrowingFile``, which leaves out the mark and keeps the
end of the file in the superblock up to date. A failed write is reported to the owner of the object and not to
HDF5; its data is kept in memory.

After a reader has read the end of the file from the superblock, the writer may add data beyond it, and HDF5
refuses such data. HDF5 therefore reads from a ``SharedFile``, whose end is never reached. Data that are
missing because of this then fail the checksum of their block.
"""

from __future__ import annotations

import io
import os
import struct
from pathlib import Path

from tisim.files import regular_file
from tisim.files.atomic import write_at

_LAYOUT = struct.Struct("<8sBBBBQQQQI")
"""Layout of a superblock of version 3 (HDF5 File Format Specification 4.0, II.A): signature, version, sizes
of an offset and of a length in bytes, flags of a writer, base address, address of the extension, end of the
file, address of the root group, checksum."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of every HDF5 file."""
SIZE = _LAYOUT.size
"""Size of a superblock, bytes."""
_END_OUT_OF_REACH = 1 << 62
"""The end of the file that HDF5 is given, in bytes, beyond that of any file."""
READ_ATTEMPTS = 100
"""Largest number of reads of a block; HDF5 uses the same limit for files that are being written."""
_ALL = 0xFFFFFFFF


def superblock(block: bytes, end: int) -> bytes:
    """Return the superblock of the file with this end, in bytes, and no writer."""
    signature, version, offsets, lengths, _, base, extension, _, root, _ = _LAYOUT.unpack(block)
    body = _LAYOUT.pack(signature, version, offsets, lengths, 0, base, extension, end, root, 0)[:-4]
    return body + struct.pack("<I", lookup3(body))


def is_valid(block: bytes) -> bool:
    """Return whether this is a valid superblock of version 3 of a file without a writer."""
    complete = len(block) == SIZE and block.startswith(SIGNATURE + b"\x03")
    return complete and block == superblock(block, file_end(block))


def file_end(block: bytes) -> int:
    """Return the end of the file according to its superblock, bytes."""
    return int(_LAYOUT.unpack(block)[7])


def lookup3(data: bytes) -> int:
    """Return the checksum of HDF5 metadata: ``hashlittle`` of B. Jenkins, lookup3.c (2006), seeded with 0."""
    padded = data.ljust(-(-len(data) // 12) * 12, b"\0")
    words = struct.unpack(f"<{len(padded) // 4}I", padded)
    s = [(0xDEADBEEF + len(data)) & _ALL] * 3
    for k in range(0, len(words), 3):
        s = [(x + word) & _ALL for x, word in zip(s, words[k : k + 3], strict=True)]
        if k + 3 < len(words):
            for step, bits in enumerate((4, 6, 8, 16, 19, 4)):
                i, j, other = step % 3, (step - 1) % 3, (step + 1) % 3
                s[i] = ((s[i] - s[j]) & _ALL) ^ _rotate_left(s[j], bits)
                s[j] = (s[j] + s[other]) & _ALL
    for step, bits in enumerate((14, 11, 25, 16, 4, 14, 24)):
        i, j = (step + 2) % 3, (step + 1) % 3
        s[i] = ((s[i] ^ s[j]) - _rotate_left(s[j], bits)) & _ALL
    return s[2]


def _rotate_left(x: int, bits: int) -> int:
    return (x << bits | x >> (32 - bits)) & _ALL


class Seekable(io.RawIOBase):
    """A seekable file that owns its handle. Subclasses define its size, and access it at ``_position``
    (bytes)."""

    def __init__(self, handle: int) -> None:
        self._handle, self._position = handle, 0

    def _size(self) -> int:
        """Return the size of the file, bytes."""
        raise NotImplementedError

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._position = (
            offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._size()}[whence]
        )
        return self._position

    def tell(self) -> int:
        return self._position

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def close(self) -> None:
        if not self.closed:
            os.close(self._handle)
        super().close()


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
