"""Write-ahead journal: framed, checksummed payloads appended to one file (see tisim/files/framing.py).

Beside it, in the lock file, stands how far it had been written: what is missing of that was cut off.
"""

from __future__ import annotations

import contextlib
import json
import os
from dataclasses import astuple, dataclass
from pathlib import Path

from tisim.files.atomic import append_at
from tisim.files.framing import Scan, frame, scan
from tisim.files.regular_file import content, file_status, open_descriptor


@dataclass(frozen=True)
class Mark:
    """How far a journal had been written.

    base : what it goes with, in numbers; None where it stands alone. end : bytes. frames : in them.
    """

    base: tuple[int, ...] | None
    end: int
    frames: int

    def write(self, lock: int) -> None:
        """Put it into the open lock file. Nothing that is stored hangs on it: no error where it cannot be."""
        with contextlib.suppress(OSError):
            os.pwrite(lock, frame(json.dumps(astuple(self)).encode()), 0)

    @classmethod
    def read(cls, lock: Path) -> Mark | None:
        """The mark in a lock file, None where there is no whole one."""
        try:
            base, end, frames = json.loads(scan(content(lock) or b"").payloads[0])
            return cls(None if base is None else tuple(base), int(end), int(frames))
        except (IndexError, ValueError, TypeError):
            return None

    def cut(self, base: tuple[int, ...] | None, found: Scan) -> str | None:
        """In words, what is missing in a journal that was read from its beginning; None when nothing is."""
        if self.base != base or found.end >= self.end:
            return None
        lost = max(1, self.frames - len(found.payloads) - len(found.damaged))
        return f"journal, byte {found.end}: {lost} evaluation(s) cut off, {self.end - found.end} bytes"


class Journal:
    """The journal file at path. Callers hold the lock (tisim.files.atomic.locked)."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def size(self) -> int:
        """Bytes in the file, 0 if there is none."""
        there = file_status(self.path)
        return 0 if there is None else there.st_size

    def read(self, offset: int = 0) -> Scan:
        """Frames from byte offset, which must be 0 or the end of an earlier scan."""
        if self.size() <= offset:
            return Scan([], offset, [], 0)
        with os.fdopen(open_descriptor(self.path, os.O_RDONLY), "rb") as file:
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
