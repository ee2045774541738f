"""Write-ahead journal: framed, checksummed payloads appended to one file.

A frame is magic (4 bytes), length (u32), CRC-32 of the payload (u32), payload. The magic is not ASCII and
payloads are, so it never occurs inside one.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

from tisim.durable import append_at

MAGIC = b"\x89TJ1"
_HEAD = struct.Struct("<4sII")


@dataclass(frozen=True)
class Scan:
    """What a stretch of journal holds.

    payloads : of the whole frames, in order; end : byte offset after the last whole frame.
    damaged : offsets where whole frames follow something that is none: not a torn tail but damage.
    torn : bytes after end, left by a writer that was killed.
    """

    payloads: list[bytes]
    end: int
    damaged: list[int]
    torn: int


def frame(payload: bytes) -> bytes:
    """The payload with its header."""
    return _HEAD.pack(MAGIC, len(payload), zlib.crc32(payload)) + payload


def _whole(data: bytes, at: int) -> bytes | None:
    if at + _HEAD.size > len(data):
        return None
    magic, length, crc = _HEAD.unpack_from(data, at)
    payload = data[at + _HEAD.size : at + _HEAD.size + length]
    return payload if magic == MAGIC and len(payload) == length and zlib.crc32(payload) == crc else None


def scan(data: bytes, base: int = 0) -> Scan:
    """Read frames from data, whose first byte lies at offset base of the file."""
    payloads: list[bytes] = []
    damaged: list[int] = []
    at = end = 0
    while at < len(data):
        payload = _whole(data, at)
        if payload is not None:
            if at > end:
                damaged.append(base + end)
            payloads.append(payload)
            at = end = at + _HEAD.size + len(payload)
        else:
            following = data.find(MAGIC, at + 1)
            at = following if following >= 0 else len(data)
    return Scan(payloads, base + end, damaged, len(data) - end)


class Journal:
    """The journal file at path. Callers hold the lock (durable.locked)."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def size(self) -> int:
        """Bytes in the file, 0 if there is none."""
        return self.path.stat().st_size if self.path.exists() else 0

    def read(self, offset: int = 0) -> Scan:
        """Frames from byte offset, which must be 0 or the end of an earlier scan."""
        if self.size() <= offset:
            return Scan([], offset, [], 0)
        with self.path.open("rb") as file:
            file.seek(offset)
            return scan(file.read(), offset)

    def append(self, end: int, payload: bytes) -> int:
        """Write one frame at the end of the last whole one, cutting off a torn tail; return the new end.

        On return the frame is on the disk. RunError if the disk is full, the frames before are then whole.
        """
        return append_at(self.path, end, frame(payload))

    def clear(self) -> None:
        """Empty the file."""
        if self.size():
            append_at(self.path, 0, b"")
