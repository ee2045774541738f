"""Figures that play the recordings of cases, in the pages that Sphinx builds; recorded_nodes.py inserts them.

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
from string import Template

import recordings

from tisim.report.page import static
from tisim.report.scenery import colour_maps

GALLERY = "gallery"
"""Name of the page with the questions and findings."""
SECTION = re.compile(r"^## (?P<question>.+?)\n(?P<text>.*?)(?=^## |\Z)", re.M | re.S)
SCRIPTS = ("parts.js", "trajectory.js", "viewer.js", "player.js", "chart.js")
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
.transport { flex-basis: 200px; min-width: 0; }
.transport input { min-width: 30px; }
.clock { min-width: 6em; }
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


def figure_html(one: recordings.Recorded, uri: str, alt: str, sections: dict[str, Told], page: str) -> str:
    """Return the figure of a recording as HTML. uri : of the still picture, from the page."""
    facts = recordings.facts_of(one.script.read_text(encoding="utf-8"))
    caption = (
        f"<p>Recording of {_code(one.command)}: {escape(recordings.contents(facts))}; "
        f"{facts['seconds']:.0f} s of CPU time with compilation. {escape(one.note)}</p>"
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
