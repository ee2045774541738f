"""Frames: payloads with a length and a checksum, one after another in a byte sequence.

A frame is magic (4 bytes), length (u32), CRC-32 of the payload (u32), payload. The magic is not ASCII and
payloads are, so it never occurs inside one.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

MAGIC = b"\x89TJ1"
_HEAD = struct.Struct("<4sII")


@dataclass(frozen=True)
class Scan:
    """The frames found in a byte sequence.

    payloads : payloads of the complete frames, in order.
    end : byte offset after the last complete frame.
    damaged : byte offsets of invalid data that are followed by complete frames, which indicates damage and
        not an interrupted write.
    torn : number of bytes after ``end``, left by a writer that was killed.
    """

    payloads: list[bytes]
    end: int
    damaged: list[int]
    torn: int


def frame(payload: bytes) -> bytes:
    """Return the payload with its header."""
    return _HEAD.pack(MAGIC, len(payload), zlib.crc32(payload)) + payload


def _payload_at(data: bytes, offset: int) -> bytes | None:
    if offset + _HEAD.size > len(data):
        return None
    magic, length, crc = _HEAD.unpack_from(data, offset)
    payload = data[offset + _HEAD.size : offset + _HEAD.size + length]
    return payload if magic == MAGIC and len(payload) == length and zlib.crc32(payload) == crc else None


def scan(data: bytes, base: int = 0) -> Scan:
    """Read frames from data that begin at the file offset ``base``."""
    payloads: list[bytes] = []
    damaged: list[int] = []
    offset = end = 0
    while offset < len(data):
        payload = _payload_at(data, offset)
        if payload is not None:
            if offset > end:
                damaged.append(base + end)
            payloads.append(payload)
            offset = end = offset + _HEAD.size + len(payload)
        else:
            following = data.find(MAGIC, offset + 1)
            offset = following if following >= 0 else len(data)
    return Scan(payloads, base + end, damaged, len(data) - end)
