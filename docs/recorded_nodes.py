"""Pictures of recordings in the documents become figures that play them (recorded_figures.py)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import recorded_figures
import recordings
from docutils import nodes


def figures(app: Any, doctree: nodes.document) -> None:
    """Replace the pictures of recordings by figures, except for links and pictures within text."""
    page = app.env.current_document.docname
    known, sections = recordings.every_case(), recorded_figures.told()
    for image in list(doctree.findall(nodes.image)):
        path, block = Path(image["uri"]), image.parent
        if path.parts[-3:-1] != ("_static", "recordings"):
            continue
        if not (isinstance(block, nodes.paragraph) and len(block) == 1):
            image["classes"].append("still")
            continue
        one = known[path.stem]
        for source in (one.script, recordings.SETTINGS, recordings.DOCS / f"{recorded_figures.GALLERY}.md"):
            app.env.note_dependency(str(source))
        uri = "../" * page.count("/") + "/".join(path.parts[-3:])
        html = recorded_figures.figure_html(one, uri, image.get("alt", ""), sections, page)
        block.replace_self(nodes.raw("", html, format="html"))


def add_script(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Load the script that plays on the pages that have a recording."""
    if 'class="recording"' in context.get("body", ""):
        app.add_js_file("recordings.js", loading_method="defer")


def write_viewer(app: Any, error: Exception | None) -> None:
    """Write the script of the viewer beside the recordings of the built pages."""
    if error is None and app.builder.format == "html":
        (Path(app.outdir) / "_static" / "viewer.js").write_text(recorded_figures.viewer(), encoding="utf-8")


def setup(app: Any) -> dict[str, bool]:
    """Add the figures to the build, as a Sphinx extension."""
    app.connect("doctree-read", figures)
    app.connect("html-page-context", add_script)
    app.connect("build-finished", write_viewer)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
