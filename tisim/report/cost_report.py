"""The page of a study of costs: error against time of all settings, and everything about a chosen one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

from tisim.accuracy.cost_study import Row, decades
from tisim.accuracy.quantity import LARGEST_REFERENCE_ERROR
from tisim.accuracy.report import HEADINGS
from tisim.accuracy.storage import StoredStudy, stored
from tisim.errors import must
from tisim.files.atomic import replace_file
from tisim.report.page import COST_SCRIPTS, Page, Section, copied_text, table
from tisim.report.viewer_data import SIZE_LIMIT
from tisim.version import __version__

CHOSEN_SETTING = (
    '<aside id="chosen" aria-label="Chosen setting"></aside><p id="told" class="unseen" role="status"></p>'
    '<a id="shown" href="#chosen" aria-label="To the chosen setting"></a>'
)
"""The places of the panel of the chosen setting, and of its short form: for screen readers, and on narrow
pages."""
MARK_MEANINGS = (
    "hollow: upper bound of an error",
    "dark ring: cheapest for a power of ten of the error",
    "broken line: another precision or arithmetic",
)
"""Explanations of the marks in the diagrams."""
LEAST_ERROR = 1e-16
"""The least error on a logarithmic axis."""


def cost_report(folder: str | Path, to: str | Path, limit: float = SIZE_LIMIT) -> Path:
    """Write the page of a study of costs: one HTML file that a browser shows without a network; return its
    path.

    folder : of the study, or its cost.h5. to : file to write, replaced if it exists. limit : largest size of
    the file, MB.

    Raise InputError if there is no study, or if the page is larger; RunError if the disk is full.
    """
    path, content = Path(to), cost_page(stored(Path(folder))).html().encode()
    size = 1e-6 * len(content)
    must(size <= limit, "limit", f"at least the size of the page, {size:.3g} MB", limit)
    replace_file(path, content)
    return path


def cost_page(study: StoredStudy) -> Page:
    """Return the page of a study."""
    measured = sum(bool(row.errors) for row in study.rows)
    failed = sum(bool(row.failed) for row in study.rows)
    names = ", ".join(one.name for one in study.quantities)
    seconds = sum(sum(row.seconds) for row in study.rows)
    return Page(
        title=f"Cost of {study.name}",
        state="ok" if study.complete else "unfinished",
        verdict="complete" if study.complete else "not complete",
        summary=(
            f"Settings: {measured}{f', and {failed} that failed' if failed else ''}. Errors of {names}. "
            f"Timed runs: {seconds:.3g} s on {study.settings.get('device')} with "
            f"{study.settings.get('threads')} threads."
        ),
        facts=_facts(study),
        recording=b"",
        notices=list(_notices(study)),
        sections=list(_sections(study)),
        footer=[f"Measured by tisim {study.versions.get('tisim')}. Written by tisim {__version__}."],
        scripts=COST_SCRIPTS,
        view=CHOSEN_SETTING,
    )


def _facts(study: StoredStudy) -> dict[str, Any]:
    best = [_best(study.rows, k) for k in range(len(study.quantities))]
    rows = [
        {
            "method": row.method, "setting": row.setting, "python": row.python, "options": row.options,
            "precision": row.precision, "arithmetic": row.arithmetic, "failed": row.failed, "same": row.same,
            "starts": row.starts, "time": _finite(row.median), "repeats": len(row.seconds),
            "least": min(row.seconds, default=None), "most": max(row.seconds, default=None),
            "steps": _finite(row.steps), "sums": _finite(row.sums), "rejections": _finite(row.rejections),
            "errors": [
                {
                    "error": error, "uncertainty": off, "atMost": max(row.at_most(k), LEAST_ERROR),
                    "known": row.trusted(k), "best": best[k].get(row.key, ""),
                }
                for k, (error, off) in enumerate(row.errors)
            ],
        }
        for row in study.rows
    ]  # fmt: skip
    quantities = [
        {"name": one.name, "relativeTo": one.relative_to, "reference": one.error, "source": one.source}
        for one in study.quantities
    ]
    return {"name": study.name, "rows": rows, "quantities": quantities}


def _best(rows: Sequence[Row], quantity: int) -> dict[tuple[str, str], str]:
    """Return for rows by key the error for which no other setting is faster, in brackets if another setting
    with less work is as fast."""
    best: dict[tuple[str, str], str] = {}
    for error, (first, *others) in decades(rows, quantity).items():
        best |= {row.key: f"({error:.0e})" for row in others} | {first.key: f"{error:.0e}"}
    return best


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _notices(study: StoredStudy) -> Iterable[str]:
    if not study.complete:
        yield "The budget was spent, or the study was stopped, before all settings were run."
    for one in study.quantities:
        if one.error > LARGEST_REFERENCE_ERROR:
            yield f"The reference itself is off by {one.error:.1g} for {one.name}, so its errors say little."


def _sections(study: StoredStudy) -> Iterable[Section]:
    words = "".join(f"<li>{escape(text)}</li>" for text in (*HEADINGS, *MARK_MEANINGS))
    yield Section(
        "work",
        "Error and time",
        '<fieldset id="methods" class="group range"></fieldset><div id="diagrams" class="figures"></div>'
        f'<ul class="quiet">{words}</ul>',
    )
    yield Section("settings", "Settings", '<div id="rows"></div>')
    truths = table(
        ("quantity", "relative to", "true value from", "its own error at most"),
        [(one.name, one.relative_to, one.source, f"{one.error:.1e}") for one in study.quantities],
        "quantities",
        (3,),
    )
    scene = copied_text("scene.toml", study.scene)
    yield Section("asked", "What was asked", f"<h3>Quantities</h3>{truths}<h3>Scene</h3>{scene}")
