"""Objects that notebooks show: as HTML with a table and pictures, and as a viewer of particles in a cell.

Notebooks call ``_repr_html_`` of the last value of a cell, so that nothing of IPython is needed here. Text is
escaped. Colours follow the theme of the notebook, light or dark.
"""

from __future__ import annotations

import base64
import importlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, ClassVar

from tisim.errors import InputError, RunError, is_whole, must
from tisim.files.atomic import replace_file

VIEWER_HEIGHT = 640
"""Default for the height of a viewer in a cell, pixels."""
CELL_DOTS_PER_INCH = 72
"""Resolution of pictures in cells, which a notebook stores."""
LEAST_HEIGHT, LARGEST_HEIGHT = 200, 4000
"""Range of the height of a viewer in a cell, pixels."""


class ShownInNotebook:
    """A class whose objects notebooks show as HTML.

    ``shown_by`` names the function that returns the HTML of an object, as ``module:function``. It is imported
    when it is needed, as an entry point is, because it draws pictures with modules that import the class.
    Plain text is shown if the function cannot show the object.
    """

    shown_by: ClassVar[str]

    def _repr_html_(self) -> str | None:
        try:
            return str(named(self.shown_by)(self))
        except (InputError, RunError):
            return None


def named(function: str) -> Any:
    """Return the function with a name such as ``module:function``."""
    module, _, name = function.partition(":")
    return getattr(importlib.import_module(module), name)


@dataclass(frozen=True, repr=False)
class ViewerCell:
    """A page with a viewer of particles, which a notebook shows in the output of a cell.

    page : its HTML, which needs no network. height : pixels.
    """

    page: str
    height: int = VIEWER_HEIGHT

    def __post_init__(self) -> None:
        rule = f"a whole number of pixels, {LEAST_HEIGHT} to {LARGEST_HEIGHT}"
        fits = is_whole(self.height, LEAST_HEIGHT) and self.height <= LARGEST_HEIGHT
        must(fits, "height", rule, self.height)

    def __repr__(self) -> str:
        size = len(self.page.encode()) / 1e6
        return f"<viewer of particles, {size:.3g} MB: a notebook shows it, save(path) writes it to a file>"

    def _repr_html_(self) -> str:
        # The page may run its own script and save files, and nothing else: it has no access to the notebook.
        # A notebook that is not trusted shows the sentence behind the frame, because it removes frames.
        return (
            f'<div style="position:relative;height:{self.height}px;overflow:hidden">'
            "<p>A viewer of particles: trust this notebook, or run the cell again, to see it.</p>"
            f'<iframe title="Viewer of particles" srcdoc="{escape(self.page)}" '
            'sandbox="allow-scripts allow-downloads" loading="lazy" style="position:absolute;inset:0;'
            'width:100%;height:100%;border:0;border-radius:10px"></iframe></div>'
        )

    def save(self, path: str | Path) -> Path:
        """Write the page to a file, replaced if it exists; return its path. RunError if the disk is full."""
        replace_file(Path(path), self.page.encode())
        return Path(path)


def card(
    title: str,
    state: str,
    parts: Iterable[str] = (),
    notes: Sequence[str] = (),
) -> str:
    """Return the HTML of an object: a heading with its state, parts such as tables and pictures as HTML, and
    sentences below them."""
    below = "".join(f'<p style="margin:4px 0;opacity:.8">{escape(note)}</p>' for note in notes)
    return (
        f'<div style="max-width:860px"><p style="margin:4px 0"><strong>{escape(title)}</strong>'
        f"&ensp;{escape(state)}</p>{''.join(parts)}{below}</div>"
    )


def card_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of text as HTML; empty headings make no heading row."""
    left = "text-align:left;vertical-align:top;padding:2px 14px 2px 0"

    def line(tag: str, cells: Sequence[str]) -> str:
        return "<tr>" + "".join(f'<{tag} style="{left}">{escape(cell)}</{tag}>' for cell in cells) + "</tr>"

    top = f"<thead>{line('th', head)}</thead>" if any(head) else ""
    body = "".join(line("td", row) for row in rows)
    return f'<table style="margin:4px 0;border-collapse:collapse">{top}<tbody>{body}</tbody></table>'


def card_picture(png: bytes, text: str) -> str:
    """Return a PNG as HTML; text describes it to readers who do not see it."""
    data = base64.b64encode(png).decode()
    style = "max-width:100%;height:auto;background:#fff;border-radius:6px;margin:4px 0"
    return f'<img alt="{escape(text)}" style="{style}" src="data:image/png;base64,{data}">'
