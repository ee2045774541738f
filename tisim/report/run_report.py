"""The report on a run: one HTML file with the scene, the particles in motion, time series and balances."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import cast

import numpy as np

from tisim.describe.explained_parts import Part
from tisim.engine.result import Result
from tisim.errors import InputError, Words, must
from tisim.files import regular_file
from tisim.files.atomic import replace_file
from tisim.io.reader import Frames, frames
from tisim.plotting import time_series
from tisim.plotting.style import superscripts
from tisim.reading import read
from tisim.report import tables
from tisim.report.columns import Column
from tisim.report.compressed_trajectory import CompressedTrajectory
from tisim.report.contact_network import ContactNetwork
from tisim.report.kept_frames import KeptFrames
from tisim.report.page import Page, Section, copied_text, picture, table
from tisim.report.viewer_data import ReportOptions, viewer_data
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.version import __version__

RESERVED_BYTES, SIZE_ATTEMPTS = 0.25e6, 4
"""Bytes that are reserved at first for everything but the recording and the pictures, and the number of
attempts to keep the limit with more reserved."""
LONGEST_VALUE = 160
"""Number of characters of a setting that are shown in the table."""
LONGEST_TOML = 200_000
"""Number of characters from which on a scene is not shown as text."""
CHECKS = ("case", "check", "measured", "half_interval", "expected", "allowed", "verdict")
"""Columns of the file of checks that are shown."""


def read_checks(path: Path) -> list[list[str]]:
    """Return the rows of checks in a CSV file that ``tisim check --out`` has written.

    Raise InputError if it is another file.
    """
    rule = "a table of checks, written by tisim check --out"
    content = regular_file.content(path)
    must(content is not None, "file of checks", rule, str(path))
    rows = list(csv.DictReader(io.StringIO((content or b"").decode(errors="replace"))))
    must(bool(rows) and set(CHECKS) <= rows[0].keys(), "file of checks", rule, str(path))
    return [[row[name] or "" for name in CHECKS] for row in rows]


def run_report(
    file: str | Path, to: str | Path, world: int = 0, options: ReportOptions | None = None
) -> Path:
    """Write the report on a run: one HTML file that a browser shows without a network; return its path.

    file : trajectory.h5 or result.h5 of the run. to : file to write, replaced if it exists.
    world : index in a batch. options : the default is ``ReportOptions()``.

    Raise InputError if there are no frames, if an option does not fit, or if the page exceeds the limit
    without any frames; RunError if the disk is full.
    """
    chosen, path, reserved = options or ReportOptions(), Path(to), RESERVED_BYTES
    with frames(file, world) as sequence:
        kept, result = KeptFrames(sequence), result_of(Path(file), sequence.scene)
        for _ in range(SIZE_ATTEMPTS):
            page = run_page(kept, chosen, result, reserved)
            content = page.html().encode()
            if len(content) <= 1e6 * chosen.limit:
                replace_file(path, content)
                return path
            # Everything but the recording and the pictures, which are in base64.
            encoded = len(page.recording) + sum(map(len, chosen.pictures.values()))
            reserved = 1.01 * (len(content) - 4 / 3 * encoded)
    rule = f"large enough for the scene, its walls and its pictures, such as {2e-6 * len(content):.3g} MB"
    raise InputError(f"limit must be {rule}; received {chosen.limit:g} MB")


def run_page(
    sequence: KeptFrames, options: ReportOptions, result: Result | None, reserved: float = RESERVED_BYTES
) -> Page:
    """Return the page of a run.

    result : of the same run; None if it has not ended. reserved : bytes of everything but the recording and
    the pictures.
    """
    must(len(sequence) > 0, "file", "one with a frame", Words("one with none yet"))
    scene, count = sequence.scene, len(sequence)
    # The function asks for a scene, times and frames alone.
    series = time_series.history(cast(Frames, sequence))
    times, panels = tables.time_series(series, scene, sequence.measures)
    data = viewer_data(sequence, options, reserved)
    state, verdict, sentences = status_of(sequence.missing, result)
    first, last = sequence[0].arrays, sequence[-1].arrays
    ends = len(first["mass"]), len(last["mass"])
    return Page(
        title=scene.name,
        state=state,
        verdict=verdict,
        summary=summary(ends, len(data.trajectory.times), count, (times[0], times[-1])),
        facts=data.facts
        | {
            "series": {"times": tables.digits(times), "curves": panels},
            "spectra": [one.facts() for one in options.spectra],
        },
        recording=data.recording,
        notices=[*sentences, *data.notices],
        sections=list(_sections(scene, result, (first, last), options)),
        footer=[rounding(data.trajectory, data.network), _versions(result)],
    )


def result_of(file: Path, scene: Scene) -> Result | None:
    """Return the result of the run, if it has ended."""
    path = file if file.name == "result.h5" else file.with_name("result.h5")
    if not regular_file.exists(path):
        return None
    try:
        result = read(path)
    except InputError:
        return None
    same = isinstance(result, Result) and result.scene.digest() == scene.digest()
    return result if same else None


def status_of(missing: str, result: Result | None) -> tuple[str, str, list[str]]:
    """Return the state of a run, a word for it, and sentences about it. missing : see ``Frames.missing``."""
    if result is None:
        return (
            ("unfinished", "unfinished", [f"{missing[0].upper()}{missing[1:]}."])
            if missing
            else ("ok", "complete", [])
        )
    status = result.status
    return ("ok", "ok", []) if status.ok else ("failed", "failed", [f"The run failed {status.reason}."])


def summary(ends: tuple[int, int], shown: int, count: int, times: tuple[float, float]) -> str:
    """Return a sentence about the numbers of particles at both ends, of frames, and their times (s)."""
    number = f"{ends[0]:,}" if ends[0] == ends[1] else f"{ends[0]:,} at the start, {ends[1]:,} at the end"
    frames_shown = f"{shown} of {count}" if shown < count else f"{count}"
    return f"Particles: {number}. Frames: {frames_shown}, from t = {times[0]:.6g} s to {times[1]:.6g} s."


def _sections(
    scene: Scene, result: Result | None, states: tuple[Arrays, Arrays], options: ReportOptions
) -> list[Section]:
    """Return the sections below the view."""
    spectra = '<h3>Spectra</h3>\n<div id="spectra"></div>\n' if options.spectra else ""
    happened = f'<div id="curves"></div>\n{spectra}<div id="numbers">{numbers(result, states)}</div>'
    sections = [
        Section("happened", "What happened", happened),
        Section("asked", "What was asked", _asked(scene)),
    ]
    if options.checks:
        checks = table(CHECKS, options.checks, "checks", (2, 3, 4, 5))
        sections.append(Section("checks", "Checks of the case", checks))
    if options.pictures:
        shown = "\n".join(picture(title, png) for title, png in options.pictures.items())
        sections.append(Section("pictures", "Pictures", f'<div class="pictures">{shown}</div>'))
    return sections


def numbers(result: Result | None, states: tuple[Arrays, Arrays]) -> str:
    """Return the balances between two states, and the counts and measures of a run, as HTML."""
    html = "<h3>Balances</h3>" + table(
        ("quantity", "unit", "start", "end", "change"),
        [
            (name, unit, f"{start:.10g}", f"{end:.10g}", f"{end - start:.3g}")
            for name, unit, start, end in tables.balances(*states)
        ],
        "balances",
        (2, 3, 4),
    )
    if result is not None and (result.work or result.measures):
        html += "<h3>Counts and measures at the end</h3>" + table(
            ("quantity", "value"),
            [
                *((name.replace("_", " "), f"{number}") for name, number in result.work.items()),
                *((name.replace("_", " "), f"{value:.8g}") for name, value in result.measures.items()),
            ],
            "counts",
            (1,),
        )
    return html


def _asked(scene: Scene) -> str:
    """Return the scene as HTML: its parts as a table, and as TOML."""
    rows, parts = [], []
    for role, part in tables.scene_parts(scene):
        parts.append(part)
        rows.append(_part_rows(role, part))
    head = "".join(f'<th scope="col">{name}</th>' for name in ("setting", "value", "unit", "meaning, source"))
    general = (
        ("duration", f"{scene.duration:g}", "s", "simulated time"),
        ("accuracy", f"{scene.accuracy:g}", "", "relative accuracy for which a stepper is chosen"),
        ("seed", f"{scene.seed}", "", "seed of all random numbers"),
    )
    first = _part_row("scene", scene.name, "", "") + "".join(map(_setting_row, general))
    text = (
        f'<div class="wide"><table data-csv="scene"><thead><tr>{head}</tr></thead><tbody>{first}'
        f"{''.join(rows)}</tbody></table></div>"
    )
    if works := tables.publications(parts):
        text += "<h3>Publications</h3><ul>" + "".join(f"<li>{escape(work)}</li>" for work in works) + "</ul>"
    toml = scene.to_toml()
    if len(toml) > LONGEST_TOML:
        size = len(toml) / 1e6
        return text + f"<p>As a file, the scene has {size:.3g} MB: scene.toml in the folder of the run.</p>"
    return text + (
        '<details class="block"><summary>The scene as a file, to run again or to change</summary>'
        f"{copied_text('scene.toml', toml)}</details>"
    )


def _part_rows(role: str, part: Part) -> str:
    summary = "" if part.summary in ("a material", "contact properties") else part.summary
    rows = (_setting_row(row, row[0] in part.off) for row in part.parameters)
    return _part_row(role, part.name, summary, part.source) + "".join(rows)


def _part_row(role: str, name: str, summary: str, source: str) -> str:
    text = "; source: ".join(filter(None, (summary, source)))
    return (
        f'<tr class="part"><th scope="rowgroup">{escape(name)}</th><td>{escape(role)}</td><td></td>'
        f"<td>{escape(text)}</td></tr>"
    )


def _setting_row(row: Sequence[str], off: bool = False) -> str:
    """Return a setting as a row; one that leaves something out, as by default, is ``off``."""
    name, value, unit, text = row
    if len(value) > LONGEST_VALUE:
        value = f"{value[:LONGEST_VALUE]} ... (the scene as a file has all)"
    return (
        f'<tr{" class=off" if off else ""}><th scope="row">{escape(name)}</th>'
        f'<td class="value">{escape(value)}</td><td>{escape(superscripts(unit))}</td>'
        f"<td>{escape(text)}</td></tr>"
    )


def rounding(trajectory: CompressedTrajectory, network: ContactNetwork | None = None) -> str:
    """Return sentences about the rounding of the quantities shown."""
    position = trajectory.column("position")
    others = [one for one in trajectory.columns if one.name not in ("id", "position", "orientation", "shape")]
    sentences = [_accuracy(one) for one in others if one.scale.rounding() > 0 and not _exact(one)]
    rest = f" Rounding of the colours: {'; '.join(sentences)}." if sentences else ""
    half = 0.5 * np.array(position.scale.step) * 2**position.scale.unused
    along = ", ".join(f"{axis} {size:.2g} m" for axis, size in zip("xyz", half, strict=True))
    if network is not None and network.usual > 0:
        rest += (
            " Contact forces are the normal forces of the contact laws at the overlaps of a frame, without "
            f"damping and friction, to within {network.rounding():.2g} N, and closer if they are weaker."
        )
    return f"Positions are shown to within {along}, of the image inside a periodic box.{rest}"


def _exact(one: Column) -> bool:
    return set(one.scale.step) == {1.0}


def _accuracy(one: Column) -> str:
    size, name = one.scale.rounding(), one.name.replace("_", " ")
    return f"{name} {100 * size:.2g} %" if one.scale.logarithmic else f"{name} {size:.2g} {one.unit}".rstrip()


def _versions(result: Result | None) -> str:
    """Return a sentence about the settings of a run."""
    made = f"Written by tisim {__version__}."
    if result is None:
        return made
    settings = result.settings
    names = ("device", "precision", "arithmetic", "threads")
    told = [f"{name} {settings[name]}" for name in names if name in settings]
    edited = f" Edited during the run: {settings['edited']}." if "edited" in settings else ""
    return f"Run on {', '.join(told)}; wall time {result.wall_s:.3g} s.{edited} {made}"
