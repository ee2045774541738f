"""Pictures beside data: they are drawn after the data are written, and one that cannot be drawn is left out.

Matplotlib refuses to be imported where MPLBACKEND names a display that is not installed, as in a command that
a notebook runs in another environment. Pictures go to files here, for which it needs no display.
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
"""The resolution of pictures, unless another is asked for."""


@contextmanager
def drawing(what: str) -> Iterator[None]:
    """Draw within this context, whatever display the environment asks for. Raise RunError, which names
    ``what`` is drawn, for whatever goes wrong there."""
    try:
        _import_matplotlib()
        yield
    except (InputError, RunError):
        raise
    except Exception as failure:
        why = printable(f"{type(failure).__name__}: {failure}")
        raise RunError(f"{what} could not be drawn: {why}") from failure


def image(figure: Figure, kind: str = "png", dpi: float = DOTS_PER_INCH) -> bytes:
    """Return a figure as the bytes of a file of that kind, such as "png" or "pdf"."""
    file = io.BytesIO()
    figure.savefig(file, format=kind, dpi=dpi)
    return file.getvalue()


def write(path: Path, draw: Callable[[], Figure], dpi: float = DOTS_PER_INCH) -> Path:
    """Draw a figure and write it, in the format of the suffix; return the path.

    Raise RunError where it cannot be drawn, or the disk is full; path is then what it was.
    """
    with drawing(str(path)):
        content = image(draw(), path.suffix[1:] or "png", dpi)
    replace_file(path, content)
    return path


def write_beside_data(path: Path, draw: Callable[[], Figure], dpi: float = DOTS_PER_INCH) -> list[Path]:
    """Draw and write a picture of data that are written; return its path in a list.

    Where it cannot be drawn or written, one line on standard error says so, and the list is empty; a picture
    of earlier data is removed.
    """
    try:
        return [write(path, draw, dpi)]
    except (InputError, RunError) as failure:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        say(f"{failure}. The picture is left out; the data are written.")
        return []


def _import_matplotlib() -> None:
    """Import matplotlib without MPLBACKEND, and then ask for that display as the variable would have."""
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
