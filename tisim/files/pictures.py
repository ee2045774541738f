"""Pictures of data: they are drawn after the data are written, and skipped if drawing fails.

Importing Matplotlib fails if MPLBACKEND names a backend that is not installed, for example in a command
started from a notebook in another environment. Pictures are written to files here, so the variable is ignored
during the import.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tisim.errors import InputError, RunError, printable
from tisim.files.atomic import replace_file
from tisim.streams import say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 150
"""Default resolution of pictures."""


@contextmanager
def drawing(what: str) -> Iterator[None]:
    """Draw within this context, independent of MPLBACKEND. Raise RunError, naming ``what`` is drawn, for any
    error."""
    try:
        _import_matplotlib()
        yield
    except (InputError, RunError):
        raise
    except Exception as failure:
        why = printable(f"{type(failure).__name__}: {failure}")
        raise RunError(f"{what} could not be drawn: {why}") from failure


def image(figure: Figure, kind: str = "png", dpi: float = DOTS_PER_INCH) -> bytes:
    """Return a figure as the bytes of a file of this kind, such as "png" or "pdf"."""
    file = io.BytesIO()
    figure.savefig(file, format=kind, dpi=dpi)
    return file.getvalue()


def write(path: Path, draw: Callable[[], Figure], dpi: float = DOTS_PER_INCH) -> Path:
    """Draw a figure and write it, in the format of the suffix; return the path.

    Raise RunError if it cannot be drawn, or the disk is full; path is then unchanged.
    """
    with drawing(str(path)):
        content = image(draw(), path.suffix[1:] or "png", dpi)
    replace_file(path, content)
    return path


def write_beside_data(path: Path, draw: Callable[[], Figure], dpi: float = DOTS_PER_INCH) -> list[Path]:
    """Draw and write a picture of written data; return its path in a list.

    If that fails, a line is printed on standard error, the list is empty, and a picture of earlier data is
    removed.
    """
    try:
        return [write(path, draw, dpi)]
    except (InputError, RunError) as failure:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        say(f"{failure}. The picture is left out; the data are written.")
        return []


def _import_matplotlib() -> None:
    """Import matplotlib without MPLBACKEND, then select the backend that the variable names."""
    if "matplotlib" in sys.modules:
        return
    display = os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib
    finally:
        if display is not None:
            os.environ["MPLBACKEND"] = display
    if display:
        with suppress(ValueError):
            matplotlib.rcParams["backend"] = display
