"""Base class of file objects for ``h5py.File``; it keeps the position of the next access."""

from __future__ import annotations

import io
import os


class Seekable(io.RawIOBase):
    """A seekable file that owns its handle. Subclasses define its size, and access it at ``_position``
    (bytes)."""

    def __init__(self, handle: int) -> None:
        self._handle, self._position = handle, 0

    def _size(self) -> int:
        """Return the size of the file, bytes."""
        raise NotImplementedError

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._position = (
            offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._size()}[whence]
        )
        return self._position

    def tell(self) -> int:
        return self._position

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def close(self) -> None:
        if not self.closed:
            os.close(self._handle)
        super().close()
