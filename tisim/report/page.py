"""The HTML of a report: a page of one file that needs no network.

A policy in its head forbids the browser all connections, and all scripts and styles except the page's own,
which it names by their hashes. Text of users is escaped; data are JSON in which "<" is written as an escape,
so that no text ends the element that holds them.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from tisim.version import __version__

COMMON_SCRIPTS = ("parts.js", "chart.js", "page.js")
PARTICLE_SCRIPTS = ("trajectory.js", "viewer.js", "player.js")
PLOT_SCRIPTS = ("plot.js", "scatter.js", "rows.js")
RUN_SCRIPTS = (*COMMON_SCRIPTS, *PARTICLE_SCRIPTS, "run.js")
COST_SCRIPTS = (*COMMON_SCRIPTS, *PLOT_SCRIPTS, "cost.js")
SEARCH_SCRIPTS = (*COMMON_SCRIPTS, *PARTICLE_SCRIPTS, *PLOT_SCRIPTS, "parallel.js", "search.js")
"""The scripts of the pages of a run, of a study of costs and of a search, in order; the last one begins."""
WATCHED_RUN_SCRIPTS = (*RUN_SCRIPTS[:-1], "joined.js", "run.js", "live.js", "watch.js")
WATCHED_SEARCH_SCRIPTS = (*SEARCH_SCRIPTS, "live.js", "remade.js", "watch_search.js")
WATCHED_COST_SCRIPTS = (*COST_SCRIPTS, "live.js", "remade.js", "watch_cost.js")
"""The scripts of pages that are watched."""
PARTICLE_VIEW = '<section id="viewer" class="waiting" aria-label="Particles"></section>'
"""The place of the view of the particles."""


@dataclass(frozen=True)
class Section:
    """A section of a page: its name in the address, its title, and its HTML."""

    name: str
    title: str
    html: str


@dataclass(frozen=True)
class Page:
    """A page.

    title : text. state : "ok", "failed" or "unfinished". verdict, summary : text beside and below the title.
    notices : sentences above the view. sections : in order. footer : paragraphs.
    facts : plain data for the scripts. recording : bytes for them.
    kind : "report", or "cell" for the output of a cell of a notebook, which shows the view alone.
    scripts : names of files in ``static``. view : HTML above the sections.
    connects : whether its scripts may connect to the server of the page.
    """

    title: str
    state: str
    verdict: str
    summary: str
    facts: Mapping[str, Any]
    recording: bytes
    notices: Sequence[str] = ()
    sections: Sequence[Section] = ()
    footer: Sequence[str] = field(default_factory=tuple)
    kind: str = "report"
    scripts: Sequence[str] = RUN_SCRIPTS
    view: str = PARTICLE_VIEW
    connects: bool = False

    def html(self) -> str:
        """Return the page as HTML."""
        style, script = static("page.css"), f'"use strict";\n{"".join(map(static, self.scripts))}'
        policy = (
            f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; img-src data: blob:; "
            "base-uri 'none'; form-action 'none'" + "; connect-src 'self'" * self.connects
        )
        links = "".join(f'<a href="#{one.name}">{escape(one.title)}</a>' for one in self.sections)
        return Template(static("page.html")).substitute(
            policy=policy,
            kind=escape(self.kind),
            version=escape(__version__),
            title=escape(self.title),
            style=style,
            state=escape(self.state),
            verdict=escape(self.verdict),
            summary=escape(self.summary),
            links=links,
            notices="\n".join(
                f'<p class="warning {escape(self.state)}">{escape(text)}</p>' for text in self.notices
            ),
            view=self.view,
            sections="\n".join(
                f'<section id="{one.name}"><h2>{escape(one.title)}</h2>\n{one.html}\n</section>'
                for one in self.sections
            ),
            footer="\n".join(f"<p>{escape(text)}</p>" for text in self.footer),
            facts=embedded(self.facts),
            recording=text_data(self.recording),
            script=script,
        )


def static(name: str) -> str:
    """Return a text file of the package."""
    return (files("tisim.report") / "static" / name).read_text(encoding="utf-8")


def embedded(data: Any) -> str:
    """Return data as JSON that can stand in an HTML element: no text in it ends the element."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def text_data(data: bytes) -> str:
    """Return bytes as text in base64."""
    return base64.b64encode(data).decode()


def _hash(text: str) -> str:
    """Return the hash by which a policy names a script or a style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], name: str, numbers: Sequence[int] = ()) -> str:
    """Return a table of text cells as HTML.

    name : of the file as which a reader saves it. numbers : indices of columns of numbers.
    """

    def cell(k: int, text: str) -> str:
        if k == 0:
            return f'<th scope="row">{escape(text)}</th>'
        return f'<td class="number">{escape(text)}</td>' if k in numbers else f"<td>{escape(text)}</td>"

    titles = "".join(
        f'<th scope="col"{" class=number" if k in numbers else ""}>{escape(text)}</th>'
        for k, text in enumerate(head)
    )
    body = "\n".join("<tr>" + "".join(cell(k, text) for k, text in enumerate(row)) + "</tr>" for row in rows)
    return (
        f'<div class="wide"><table data-csv="{escape(name)}"><thead><tr>{titles}</tr></thead>\n'
        f"<tbody>{body}</tbody></table></div>"
    )


def picture(title: str, png: bytes) -> str:
    """Return a PNG with a title as HTML."""
    data = base64.b64encode(png).decode()
    return (
        f"<figure><figcaption>{escape(title)}</figcaption>"
        f'<img alt="{escape(title)}" src="data:image/png;base64,{data}"></figure>'
    )


def copied_text(name: str, text: str) -> str:
    """Return text as HTML, with buttons to copy and to save it.

    name : of the file as which a reader saves it.
    """
    return f'<pre data-file="{escape(name)}" tabindex="0">{escape(text)}</pre>'
