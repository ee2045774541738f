"""An open file of the system as a file object for ``h5py.File``: where it is read and written next."""

from __future__ import annotations

import io
import os


class Seekable(io.RawIOBase):
    """Subclasses say where the file ends, and read and write from the byte ``_at`` on. It owns the handle."""

    def __init__(self, handle: int) -> None:
        self._handle, self._at = handle, 0

    def _size(self) -> int:
        """Where the file ends, bytes."""
        raise NotImplementedError

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size()}[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def close(self) -> None:
        if not self.closed:
            os.close(self._handle)
        super().close()
