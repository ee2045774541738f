"""Checksums of complete HDF5 files, stored after the end of the HDF5 data, where HDF5 does not read.

The HDF5 library may return wrong data or hang on a damaged file, so the checksum is verified before the file
is opened. It covers the whole file, except data with checksums of their own.
"""

from __future__ import annotations

import contextlib
import io
import json
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path

import h5py

from tisim.errors import InputError, must
from tisim.files import regular_file
from tisim.files.atomic import replace_file
from tisim.files.framing import MAGIC, frame, scan
from tisim.files.superblock import SIGNATURE

OLDER_VERSION = "it was written by an older version, and h5py can read it"
"""Message for a file of tisim that has no checksum."""


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
    with h5py.File(io.BytesIO(read_image(path, what, rule)), "r") as file:
        must(file.attrs.get("format") == kind, what, f"{rule}, of the format {kind!r}", str(path))
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
        without_checksum = MAGIC not in content and content.startswith(SIGNATURE) and b"tisim" in content
        why = f", without one: it was cut short or damaged, or {OLDER_VERSION}" if without_checksum else ""
        raise InputError(f"{what} must be {rule}, whole and with its checksum; received {str(path)!r}{why}")
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
