"""The write-ahead journal is a file of framed, checksummed payloads (see tisim/files/framing.py).

The lock file beside it says how far it had been written: what is missing of that was cut off.
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
    """A mark says how far a journal had been written.

    base : numbers of the content of the file that it belongs to; None where there is no such file.
    end : length, bytes. frames : their number within this length.
    """

    base: tuple[int, ...] | None
    end: int
    frames: int

    def write(self, lock: int) -> None:
        """Write the mark into the open lock file. No stored record depends on it: a failure is no error."""
        with contextlib.suppress(OSError):
            os.pwrite(lock, frame(json.dumps(astuple(self)).encode()), 0)

    @classmethod
    def read(cls, lock: Path) -> Mark | None:
        """Return the mark in a lock file, None where there is no whole one."""
        try:
            base, end, frames = json.loads(scan(content(lock) or b"").payloads[0])
            return cls(None if base is None else tuple(base), int(end), int(frames))
        except (IndexError, ValueError, TypeError):
            return None

    def loss(self, base: tuple[int, ...] | None, journal: Scan) -> str | None:
        """Return a description of what a journal, read from its beginning, has lost; None for a whole one."""
        if self.base != base or journal.end >= self.end:
            return None
        lost_count = max(1, self.frames - len(journal.payloads) - len(journal.damaged))
        return (
            f"journal, byte {journal.end}: {lost_count} evaluation(s) cut off, {self.end - journal.end} bytes"
        )


class Journal:
    """The journal is the file at path. Callers hold the lock (tisim.files.atomic.locked)."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def size(self) -> int:
        """Return the number of bytes in the file, 0 if there is none."""
        info = file_status(self.path)
        return 0 if info is None else info.st_size

    def read(self, offset: int = 0) -> Scan:
        """Return the frames from byte offset on, which must be 0 or the end of an earlier scan."""
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
