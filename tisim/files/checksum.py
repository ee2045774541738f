"""Checksums: one of every frame in a file that grows, one of a whole HDF5 file that is written at once.

A frame is magic (4 bytes), length (u32), CRC-32 of the payload (u32), payload. The magic is not ASCII and
payloads are, so it never occurs inside one.

The checksum of a complete HDF5 file is stored in a frame after the end of the HDF5 data, where HDF5 does not
read. The HDF5 library may return wrong data or hang on a damaged file, so the checksum is verified before the
file is opened. It covers the whole file, except data with checksums of their own.
"""

from __future__ import annotations

import contextlib
import io
import json
import struct
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py

from tisim.errors import InputError, must
from tisim.files import regular_file
from tisim.files.atomic import replace_file
from tisim.files.hdf5 import SIGNATURE

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


@contextlib.contextmanager
def create_file(path: Path) -> Iterator[h5py.File]:
    """Yield a new HDF5 file in memory; at the end add its checksum and write it to path.

    Raise RunError if it cannot be written; path is then unchanged.
    """
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        yield file
    replace_file(path, with_checksum(image.getvalue()))


@contextlib.contextmanager
def open_file(path: Path, what: str, kind: str, rule: str = "a file of tisim") -> Iterator[h5py.File]:
    """Yield a file written by ``create_file``. Raise InputError unless it exists, is complete and of this
    kind.

    kind : value of its attribute ``format``.
    what, rule : its name in messages, and the rule that it must satisfy.
    """
    with open_any(path, what, rule) as file:
        must(file.attrs.get("format") == kind, what, f"{rule}, of the format {kind!r}", str(path))
        yield file


@contextlib.contextmanager
def open_any(path: Path, what: str, rule: str) -> Iterator[h5py.File]:
    """Yield a file written by ``create_file``, of any kind; see ``open_file``."""
    with h5py.File(io.BytesIO(read_image(path, what, rule)), "r") as file:
        yield file


def read_image(path: Path, what: str, rule: str) -> bytes:
    """Return the HDF5 file that was given to ``with_checksum``; raise InputError unless it exists and is
    complete.

    what, rule : its name in messages, and the rule that it must satisfy.
    """
    content = regular_file.content(regular_file.target(path))
    if content is None:
        raise InputError(f"{what} must be an existing file; received {str(path)!r}")
    image = verified(content)
    if image is None:
        raise InputError(f"{what} must be {rule}, whole and with its checksum; received {str(path)!r}")
    return image


def with_checksum(image: bytes, data: Iterable[tuple[int, int]] = ()) -> bytes:
    """Return the file image with its checksum. data : (offset, size) in bytes of data that the checksum
    omits."""
    spans = sorted(data)
    trailer = {"size": len(image), "data": spans, "crc": _checksum(image, spans)}
    return image + frame(json.dumps(trailer).encode())


def verified(content: bytes) -> bytes | None:
    """Return the HDF5 file without its checksum; None if the checksum is missing, damaged or wrong."""
    start = max(content.rfind(MAGIC), 0)
    payloads = scan(content[start:]).payloads
    if not content.startswith(SIGNATURE) or not payloads:
        return None
    try:
        trailer = json.loads(payloads[0])
        image = content[:start]
        whole = len(image) == trailer["size"] and _checksum(image, trailer["data"]) == trailer["crc"]
    except (ValueError, KeyError, TypeError):
        # It is a frame with other content.
        return None
    return image if whole else None


def _checksum(image: bytes, spans: Iterable[Iterable[int]]) -> int:
    crc = position = 0
    for offset, size in spans:
        crc, position = zlib.crc32(image[position:offset], crc), offset + size
    return zlib.crc32(image[position:], crc)
