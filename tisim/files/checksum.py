"""HDF5 files that are written whole get a checksum behind their end, where HDF5 does not look.

The HDF5 library, given a damaged structure, may read wrong data or never return: it must not be given one.
The checksum is of the file, or of all of it but data that has checksums of its own.
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

OLDER_VERSION = "an older version has written it, whose files h5py still reads"
"""Messages say this about a file that is of tisim but has no checksum."""


@contextlib.contextmanager
def create_file(path: Path) -> Iterator[h5py.File]:
    """Yield a new HDF5 file in memory; at the end give it its checksum and put it in the place of path.

    Raise RunError when it cannot be written; path is then what it was.
    """
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        yield file
    replace_file(path, with_checksum(image.getvalue()))


@contextlib.contextmanager
def open_file(path: Path, what: str, kind: str, rule: str = "a file of tisim") -> Iterator[h5py.File]:
    """Yield a file that ``create_file`` has written. Raise InputError unless it is there, whole and of this
    kind.

    kind : its attribute ``format``. what, rule : what it is called in messages, and what it must be.
    """
    with h5py.File(io.BytesIO(read_image(path, what, rule)), "r") as file:
        must(file.attrs.get("format") == kind, what, f"{rule}, of the format {kind!r}", str(path))
        yield file


def read_image(path: Path, what: str, rule: str) -> bytes:
    """Return the HDF5 file that was given to ``with_checksum``; raise InputError unless it is there and
    whole.

    what, rule : what it is called in messages, and what it must be.
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
    """Return the file image with its checksum; data : (offset, size) in bytes of data that it leaves out."""
    spans = sorted(data)
    trailer = {"size": len(image), "data": spans, "crc": _checksum(image, spans)}
    return image + frame(json.dumps(trailer).encode())


def verified(content: bytes) -> bytes | None:
    """Return the HDF5 file without its checksum; None where that is missing or damaged, or does not fit."""
    start = max(content.rfind(MAGIC), 0)
    payloads = scan(content[start:]).payloads
    if not content.startswith(SIGNATURE) or not payloads:
        return None
    try:
        trailer = json.loads(payloads[0])
        image = content[:start]
        whole = len(image) == trailer["size"] and _checksum(image, trailer["data"]) == trailer["crc"]
    except (ValueError, KeyError, TypeError):
        # A frame, but of something else.
        return None
    return image if whole else None


def _checksum(image: bytes, spans: Iterable[Iterable[int]]) -> int:
    crc = position = 0
    for offset, size in spans:
        crc, position = zlib.crc32(image[position:offset], crc), offset + size
    return zlib.crc32(image[position:], crc)
