"""A checksum of an HDF5 file's structure, behind its end, where HDF5 does not look.

Rows and tables have checksums of their own. This one covers all the rest, because the HDF5 library, given
a damaged structure, may read wrong data or never return: it must not be given one.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable

from tisim.framed import MAGIC, frame, scan


def sealed(image: bytes, data: Iterable[tuple[int, int]]) -> bytes:
    """The file image with its seal; data : (offset, size) in bytes of the raw data, which is left out."""
    spans = sorted(data)
    seal = {"size": len(image), "data": spans, "crc": _structure(image, spans)}
    return image + frame(json.dumps(seal).encode())


def intact(content: bytes) -> bool:
    """Whether the structure is what was written. True without a seal (another program wrote the file)."""
    start = content.rfind(MAGIC)
    found = scan(content[start:]).payloads if start >= 0 else []
    if not found:
        return True
    seal = json.loads(found[0])
    image = content[:start]
    return len(image) == seal["size"] and _structure(image, seal["data"]) == seal["crc"]


def _structure(image: bytes, spans: Iterable[Iterable[int]]) -> int:
    crc = at = 0
    for offset, size in spans:
        crc, at = zlib.crc32(image[at:offset], crc), offset + size
    return zlib.crc32(image[at:], crc)
