"""The superblock at the beginning of an HDF5 file, version 3 (HDF5 File Format Specification 4.0, II.A)."""

from __future__ import annotations

import struct

_LAYOUT = struct.Struct("<8sBBBBQQQQI")
"""Layout of a superblock: signature, version, sizes of an offset and of a length in bytes, flags of a writer,
base address, address of the extension, end of the file, address of the root group, checksum."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of every HDF5 file."""
SIZE = _LAYOUT.size
"""Size of a superblock, bytes."""


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


_ALL = 0xFFFFFFFF


def _rotate_left(x: int, bits: int) -> int:
    return (x << bits | x >> (32 - bits)) & _ALL
