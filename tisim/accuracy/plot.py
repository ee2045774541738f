"""Error against time, a line for each method."""

from __future__ import annotations

import re
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, LogLocator, NullFormatter

from tisim.accuracy.cost_study import Study
from tisim.accuracy.row import Row, decades
from tisim.accuracy.sweep import USUAL_NUMBERS
from tisim.plotting.style import empty, letters, plain

METHOD_COLOURS = ("#4477aa", "#ee6677", "#228833", "#aa3377", "#ccbb44", "#66ccee", "#444444", "#ee8866")
"""The methods are drawn in P. Tol's bright set of colours, and one of his light one."""
MARKERS = "osD^vP<>X"
"""The methods are drawn with these marks, one after the other."""
STYLES = {USUAL_NUMBERS: "-", ("f64", "fast"): ":"}
"""The lines of precisions and arithmetics; others are dashed."""
LEGEND_WIDTH = 80
"""A line of the legend has so many characters at most, which a panel has room for."""


def picture(study: Study) -> Figure:
    """Draw a panel for each quantity: wall seconds across, error up, both logarithmic.

    A method in another precision or arithmetic has its colour and a broken line. Laws that differ in one part
    or another are not joined.

    An error includes what it may be off by; a hollow mark is one of which no more is known than that it is no
    larger. Rings are the cheapest setting for each power of ten of the error, dotted ones others that timings
    do not tell from it. Below the shaded edge, the error of the reference itself, nothing can be told.
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
        axes[0].plot([], [], "o", mfc="white", mec="0.3", ms=5, label="hollow: no more than this")
    # Lines are in every panel, rings not.
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
        # Not as they were measured, which is another order where a study was stopped and goes on.
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
    _ring(axis, list(others.values()), k, ":", "as cheap, as far as timings tell, with more work")
    axis.set_xscale("log")
    axis.set_yscale("log")
    # Where nothing could be measured there is nothing to fit the axis to.
    low, high = axis.get_ylim() if any(row.errors for row in study.rows) else (1e-3, 1.0)
    own = study.truths[k].error if k < len(study.truths) else 0.0
    if own > 0:
        low = min(low, own / 4)
        axis.axhspan(low, own, color="0.9", zorder=0)
        axis.annotate(
            "error of the reference", (0.99, own), (0, -3), xycoords=("axes fraction", "data"),
            textcoords="offset points", ha="right", va="top", fontsize=8,
        )  # fmt: skip
    # Room for a ring on the topmost; what is far off where others are not is left out.
    axis.set_ylim(low, min(1.2 * high, max(30.0, 30.0 * low)))
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
    """Return what a setting sets, without its values: a line joins values of the same parameters, not laws
    that differ in one part or another."""
    return re.sub(r"(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?", "", row.setting)


def _usual_method(row: Row) -> str:
    """Return the name of the method of a row in the usual precision and arithmetic, whose colour it has."""
    numbers = zip((row.precision, row.arithmetic), USUAL_NUMBERS, strict=True)
    return row.method.removesuffix("".join(f", {kind}" for kind, usual in numbers if kind != usual))


def _label(study: Study, method: str) -> str:
    """Return the name of a method, with how many of its settings have failed and why."""
    rows = study.line(method)
    failed = [row.failed for row in rows if row.failed]
    if not failed:
        return method
    many = "" if len(failed) == len(rows) else f"{len(failed)} of {len(rows)} "
    return f"{method}; {many}failed: {failed[0]}"


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
