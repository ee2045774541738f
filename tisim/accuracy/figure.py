"""Plot of error against time, one line per method."""

from __future__ import annotations

import re
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, LogLocator, NullFormatter

from tisim.accuracy.cost_study import Row, Study, decades
from tisim.accuracy.sweep import USUAL_NUMBERS
from tisim.plotting.style import empty, letters, plain

METHOD_COLOURS = ("#4477aa", "#ee6677", "#228833", "#aa3377", "#ccbb44", "#66ccee", "#444444", "#ee8866")
"""Colours of the methods: P. Tol's bright scheme, and one colour of his light scheme."""
MARKERS = "osD^vP<>X"
"""Markers of the methods, used in turn."""
STYLES = {USUAL_NUMBERS: "-", ("f64", "fast"): ":"}
"""Line styles of precisions and arithmetics; others are dashed."""
LARGEST_ERROR = 100.0
"""Relative error beyond which an axis is not extended."""
LEGEND_WIDTH = 80
"""Largest number of characters in a line of the legend; a panel is this wide."""


def plot(study: Study) -> Figure:
    """Draw one panel per quantity: wall time (s) on the horizontal axis, error on the vertical, both
    logarithmic.

    A method in another precision or arithmetic has the same colour and a broken line. Laws with different
    parameters are not joined by a line.

    A plotted error includes its uncertainty. A hollow mark is only an upper bound. A solid ring marks the
    cheapest setting for each power of ten of the error; dotted rings mark settings with timings
    indistinguishable from it. The shaded area lies below the error of the reference, so errors there cannot
    be measured.
    """
    wide = len(study.quantities)
    lines = list(dict.fromkeys(row.method for row in study.rows))
    figure = empty(5.6 * wide + 0.4, 4.6 + 0.24 * (len(lines) + 1))
    axes = figure.subplots(1, wide, squeeze=False)[0]
    for k, axis in enumerate(axes):
        _panel(axis, study, lines, k)
    if wide > 1:
        letters(axes)
    axes[0].set_ylabel("relative error")
    if any(row.errors and not row.trusted(k) for row in study.rows for k in range(wide)):
        axes[0].plot([], [], "o", mfc="white", mec="0.3", ms=5, label="hollow: upper bound")
    # Lines appear in every panel, rings in some.
    named = {name: h for axis in axes for h, name in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(
        named.values(), named.keys(), loc="outside lower center", ncols=1 if wide == 1 else 2, frameon=False,
        fontsize=8.5,
    )  # fmt: skip
    return figure


def _panel(axis: Axes, study: Study, lines: list[str], k: int) -> None:
    methods = list(dict.fromkeys(map(_usual_method, study.rows)))
    for at, method in enumerate(lines):
        drawn = (row for row in study.line(method) if row.at_most(k) > 0 and row.errors and not row.same)
        # Sort by time: after a resumed study, rows are not in the order of the settings.
        rows = sorted(drawn, key=lambda row: row.median)
        one = study.line(method)[0]
        colour = METHOD_COLOURS[methods.index(_usual_method(one)) % len(METHOD_COLOURS)]
        marker, style = MARKERS[at % len(MARKERS)], STYLES.get((one.precision, one.arithmetic), "--")
        line = style if len({_parameters(row) for row in study.line(method)}) == 1 else ""
        times, errors = [row.median for row in rows], [row.at_most(k) for row in rows]
        axis.plot(times, errors, ls=line, color=colour, lw=1.3, zorder=2)
        label = fill(_label(study, method), LEGEND_WIDTH)
        axis.plot([], [], ls=line, color=colour, marker=marker, ms=5, lw=1.3, label=label)
        for row in rows:
            _mark(axis, row, k, colour, marker)
    cheapest = list(decades(study.rows, k).values())
    best = {row.key: row for row, *_ in cheapest}
    others = {row.key: row for _, *rows in cheapest for row in rows if row.key not in best}
    _ring(axis, list(best.values()), k, "-", "cheapest for a power of ten of the error")
    _ring(axis, list(others.values()), k, ":", "equally cheap within timing uncertainty, with more work")
    axis.set_xscale("log")
    axis.set_yscale("log")
    # If nothing was measured, the axis has no data to fit.
    low, high = axis.get_ylim() if any(row.errors for row in study.rows) else (1e-3, 1.0)
    own = study.truths[k].error if k < len(study.truths) else 0.0
    if own > 0:
        low = min(low, own / 4)
        axis.axhspan(low, own, color="0.9", zorder=0)
        axis.annotate(
            "error of the reference", (0.99, own), (0, -3), xycoords=("axes fraction", "data"),
            textcoords="offset points", ha="right", va="top", fontsize=8,
        )  # fmt: skip
    # Leave room for a ring at the top; do not extend the axis for outliers.
    axis.set_ylim(low, min(1.2 * high, max(LARGEST_ERROR, 30.0 * low)))
    quantity = study.quantities[k]
    axis.set_title(f"{quantity.name}, relative to {quantity.relative_to}")
    left, right = axis.get_xlim()
    narrow = right < 300 * left
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if narrow else (1.0,)))
    axis.xaxis.set_major_formatter(EngFormatter("s"))
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.set_xlabel(f"wall time{' of all starts' if study.random else ''}")
    plain(axis)


def _parameters(row: Row) -> str:
    """Return the names of the parameters in a setting, without values: only settings of the same parameters
    are joined by a line."""
    return re.sub(r"(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?", "", row.setting)


def _usual_method(row: Row) -> str:
    """Return the name of the method of a row in the usual precision and arithmetic, which determines its
    colour."""
    numbers = zip((row.precision, row.arithmetic), USUAL_NUMBERS, strict=True)
    return row.method.removesuffix("".join(f", {kind}" for kind, usual in numbers if kind != usual))


def _label(study: Study, method: str) -> str:
    """Return the name of a method, with the number of failed settings; the causes are in the table."""
    rows = study.line(method)
    failed = sum(bool(row.failed) for row in rows)
    return f"{method} ({failed} of {len(rows)} failed)" if failed else method


def _ring(axis: Axes, rows: list[Row], k: int, style: str, label: str) -> None:
    if rows:
        axis.scatter(
            [row.median for row in rows], [row.at_most(k) for row in rows], s=130, facecolors="none",
            edgecolors="black", linewidths=1.1, linestyles=style, zorder=4, label=label,
        )  # fmt: skip


def _mark(axis: Axes, row: Row, k: int, colour: str, marker: str) -> None:
    face = colour if row.trusted(k) else "white"
    spread = np.array([[row.median - min(row.seconds)], [max(row.seconds) - row.median]])
    axis.errorbar(
        [row.median], [row.at_most(k)], xerr=spread, fmt=marker, ms=5, mfc=face, mec=colour, color=colour,
        lw=1, zorder=3,
    )  # fmt: skip
