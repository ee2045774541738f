"""Pictures of recordings become figures that play them, in the pages that Sphinx builds.

A source has the still picture, ``![...](_static/recordings/CASE.webp)``, which is shown wherever the source
is read. In the built page a button over the picture plays the recording. Below it are the command and the
contents of the recording, and on all pages but the gallery also the question and the finding that the gallery
has. A picture that is a link stays one.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import recordings
from docutils import nodes

from tisim.report.page import static
from tisim.report.scenery import colour_maps

GALLERY = "gallery"
"""Name of the page with the questions and findings."""
SECTION = re.compile(r"^## (?P<question>.+?)\n(?P<text>.*?)(?=^## |\Z)", re.M | re.S)
SCRIPTS = ("trajectory.js", "viewer.js", "player.js", "chart.js")
"""The scripts of a report that its viewer needs."""
FIGURE = """<figure class="recording" data-recording="$name">
<div class="screen"><img src="$picture" width="$across" height="$upwards" alt="$alt" loading="lazy">
<button type="button" class="play" hidden aria-label="Play the recording of $name">
<span aria-hidden="true"></span></button></div>
<figcaption>$caption</figcaption>
</figure>
"""
VIEWER = """/* The viewer of recordings: scripts and style of tisim/report/static. */
window.tisimViewer = (() => {
"use strict";
$scripts
const STYLE = $style, MAPS = $maps;
async function show(host, facts, data) {
  const bytes = fromBase64(data), place = element("section", { id: "viewer", "aria-label": "Particles" });
  host.attachShadow({ mode: "open" }).append(element("style", {}, STYLE), place);
  let begin = 0;
  const parts = facts.lengths.map((length) => bytes.subarray(begin, begin += length));
  const trajectory = await Trajectory.decode(facts.trajectory, parts);
  const player = new Player(place, trajectory, facts.scene, null, { ...facts, maps: MAPS });
  player.colourBy(facts.colour);
  place.querySelector("details").open = false;
  return player;
}
return { show };
})();
"""
OWN_STYLE = """
:host {
  display: block; background: var(--panel); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Noto Sans", sans-serif;
}
#viewer { margin: 0; }
.stage canvas { height: min(60vh, 460px); }
"""
"""Added to the style of reports: a shadow root has no body."""


@dataclass(frozen=True)
class Told:
    """A section of the gallery: question, command with its time, and finding; text with the markup of
    inline code only."""

    question: str
    command: str
    finding: str


def viewer() -> str:
    """Return the script of the viewer. Its names are its own, and its style is for a shadow root."""
    style = static("page.css").replace(':root[data-theme="dark"]', ':host([data-theme="dark"])')
    return Template(VIEWER).substitute(
        scripts="\n".join(static(name) for name in SCRIPTS),
        style=json.dumps(style.replace(":root", ":host") + OWN_STYLE),
        maps=json.dumps(colour_maps(), separators=(",", ":")),
    )


def told() -> dict[str, Told]:
    """Return the sections of the gallery by the names of the cases whose recordings they show."""
    found = {}
    text = (recordings.DOCS / f"{GALLERY}.md").read_text(encoding="utf-8")
    for section in SECTION.finditer(text):
        body = section["text"]
        name = re.search(r"_static/recordings/(\w+)\.webp", body)
        command, finding = (
            re.search(r"^    (.+)$", body, re.M),
            re.search(r"\*\*Finding:\*\*(.+)", body, re.S),
        )
        if not (name and command and finding):
            raise ValueError(f"the section {section['question']!r} lacks a recording, a command or a finding")
        sentences = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", " ".join(finding[1].split()))
        found[name[1]] = Told(section["question"], command[1], re.sub(r" ?The case,.*$", "", sentences))
    return found


def figures(app: Any, doctree: nodes.document) -> None:
    """Replace the pictures of recordings by figures, except for links and pictures within text."""
    page = app.env.current_document.docname
    known, sections = recordings.every_case(), told()
    for image in list(doctree.findall(nodes.image)):
        path, block = Path(image["uri"]), image.parent
        if path.parts[-3:-1] != ("_static", "recordings"):
            continue
        if not (isinstance(block, nodes.paragraph) and len(block) == 1):
            image["classes"].append("still")
            continue
        one = known[path.stem]
        for source in (one.script, recordings.SETTINGS, recordings.DOCS / f"{GALLERY}.md"):
            app.env.note_dependency(str(source))
        uri = "../" * page.count("/") + "/".join(path.parts[-3:])
        html = figure_html(one, uri, image.get("alt", ""), sections, page)
        block.replace_self(nodes.raw("", html, format="html"))


def figure_html(one: recordings.Recorded, uri: str, alt: str, sections: dict[str, Told], page: str) -> str:
    """Return the figure of a recording as HTML. uri : of the still picture, from the page."""
    facts = recordings.facts_of(one.script.read_text(encoding="utf-8"))
    caption = (
        f"<p>Recording of {_code(one.command)}: {escape(recordings.contents(facts))}; "
        f"{facts['seconds']:.0f} s of CPU time. {escape(one.note)}</p>"
    )
    if page != GALLERY:
        section = sections[one.name]
        caption = (
            f"<p><strong>{escape(section.question)}</strong> {_code(section.command)}</p>"
            f"<p><strong>Finding:</strong> {escape(section.finding)}</p>{caption}"
        )
    across, upwards = recordings.STILL
    return Template(FIGURE).substitute(
        name=one.name, picture=escape(uri), across=across, upwards=upwards, alt=escape(alt), caption=caption
    )


def _code(command: str) -> str:
    """Return a command as HTML whose lines do not break after the hyphens of options."""
    text = re.sub("(--[^ ]+)", r"<span>\1</span>", escape(command))
    return f"<code>{text}</code>"


def add_script(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Load the script that plays on the pages that have a recording."""
    if 'class="recording"' in context.get("body", ""):
        app.add_js_file("recordings.js", loading_method="defer")


def write_viewer(app: Any, error: Exception | None) -> None:
    """Write the script of the viewer beside the recordings of the built pages."""
    if error is None and app.builder.format == "html":
        (Path(app.outdir) / "_static" / "viewer.js").write_text(viewer(), encoding="utf-8")


def setup(app: Any) -> dict[str, bool]:
    """Add the figures to the build, as a Sphinx extension."""
    app.connect("doctree-read", figures)
    app.connect("html-page-context", add_script)
    app.connect("build-finished", write_viewer)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
