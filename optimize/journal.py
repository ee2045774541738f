"""Write-ahead journal: framed, checksummed payloads appended to one file (see tisim/framed.py)."""

from __future__ import annotations

from pathlib import Path

from tisim.durable import append_at
from tisim.framed import Scan, frame, scan

__all__ = ["Journal", "Scan", "frame", "scan"]


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
