"""Figures of packed_filter that need many runs: static separation (B16 Figs 7.4 b, 7.7), dynamic separation
(7.5), and the matrix beside single fibres."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim import Result
from tisim.analysis import Mean, breakthrough_curve, captured_by_size
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.packed_filter.checks import (
    CASCADE_COLLOIDS,
    FAST,
    LONE_FIBRES,
    SLOW,
    WAITS,
    free_radius,
    runs,
    stream,
)
from tisim.cases.packed_filter.lone_fibre import COMPARED_RESOLUTION, lone_fibres
from tisim.cases.packed_filter.measures import captured_by, captured_fraction, penetration
from tisim.cases.packed_filter.pictures import caught
from tisim.cases.packed_filter.scene import Flow, filter_of
from tisim.engine.batches import Progress
from tisim.plotting.style import empty, letters, plain

FIGURE_STARTS = 6
"""Packings of each setting."""
TIMES = np.linspace(0.0, WAITS[-1], 37)
"""Times of the points of a curve, s."""
SPEEDS = (3e-5, 1e-4, 3e-4, 1e-3)
"""Superficial velocities, m/s."""
RADII = 1e-9 * np.array([1.0, 2.5, 3.5, 4.5, 5.5, 7.0, 9.0, 20.0])
"""Edges of classes of magnetic radius, m."""
CURVE_INTERVALS = 40
"""Intervals of time of a breakthrough curve."""
BLUE, RED, GREEN, PURPLE = "#4477aa", "#cc6677", "#228833", "#882255"


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """static.png, dynamic.png, neighbours.png and neighbours.csv, and filter.png, of filters of a size."""
    made = {"static.png": static(size)}
    progress(0.3)
    made["dynamic.png"], one = dynamic(size)
    progress(0.5)
    made["filter.png"] = caught(one)
    rows = beside(size, lambda share: progress(0.5 + 0.5 * share))
    return {**made, "neighbours.png": neighbours(rows), "neighbours.csv": table(rows)}


def band(axis: Axes, x: np.ndarray, by_start: np.ndarray, colour: str, label: str, line: str = "-") -> None:
    """Draw the mean over starts with its 95 % interval. by_start : values, shape (starts, len(x))."""
    means = [Mean.of(column) for column in by_start.T]
    value, half = (np.array([getattr(one, name) for one in means]) for name in ("value", "half"))
    axis.plot(x, value, color=colour, ls=line, lw=1.6, label=label)
    axis.fill_between(x, value - half, value + half, color=colour, alpha=0.18, lw=0)


def static(size: str) -> Figure:
    """Draw the colloids left by time, their mean radius, and the captured fraction by size."""
    filter = filter_of(size, "static", duration=WAITS[-1])
    figure = empty(12.6, 3.9)
    left, middle, right = figure.subplots(1, 3)
    mutual = runs(filter, FIGURE_STARTS)
    for results, colour, name in (
        (mutual, BLUE, "matrix"),
        (runs(replace(filter, mutual=False), FIGURE_STARTS), RED, "not magnetised\nby each other"),
    ):
        free = np.array([[1 - captured_fraction(one, t) for t in TIMES] for one in results])
        band(left, TIMES, free, colour, name)
    lone = lone_fibres(filter, LONE_FIBRES)
    alone = [lone.passed(t, filter.matrix.density).value for t in TIMES]
    left.plot(TIMES, alone, color="0.3", ls=":", lw=1.6, label="single fibres")
    left.axhspan(0.4, 0.5, color="0.9", zorder=0, label="B16, 10 to 180 s")
    left.set(xlabel="time (s)", ylabel="fraction not captured", ylim=(0, 1.02))
    left.legend(frameon=False, fontsize=8)
    radii = np.array([[free_radius(one, t) for t in TIMES] for one in mutual])
    band(middle, TIMES, radii, BLUE, "matrix")
    middle.plot(WAITS, [3.0] * len(WAITS), "s", color="0.4", ms=5, label="B16, about 3 nm")
    middle.set(xlabel="time (s)", ylabel="mean radius of the free (nm)", ylim=(0, None))
    middle.legend(frameon=False, fontsize=8)
    radius = np.concatenate([one.state["radius"] for one in mutual])
    for wait, colour in zip(WAITS, (GREEN, BLUE, PURPLE), strict=True):
        found = captured_by_size(radius, np.concatenate([captured_by(one, wait) for one in mutual]), RADII)
        centre = 0.5e9 * (RADII[1:] + RADII[:-1])
        errors = np.array([found.value - found.low, found.high - found.value])
        right.errorbar(
            centre, found.value, errors, color=colour, marker="o", ms=3, capsize=2, label=f"{wait:g} s"
        )
    right.set(xlabel="magnetic radius (nm)", ylabel="captured fraction", ylim=(0, 1.02), xlim=(0, 15))
    right.legend(frameon=False, fontsize=8)
    finish((left, middle, right))
    return figure


def dynamic(size: str) -> tuple[Figure, Result]:
    """Draw breakthrough curves at two speeds, and return one of the runs."""
    figure = empty(11.0, 3.9)
    axes = figure.subplots(1, 2, sharey=True)
    first: Result | None = None
    for axis, speed, name in zip(axes, (SLOW, FAST), ("slow", "four times as fast"), strict=True):
        for flow, colour in (("resolved", BLUE), ("uniform", RED)):
            filter = stream(speed, size, flow=flow)
            results = runs(filter, FIGURE_STARTS)
            first = first or results[0]
            edges = np.linspace(0.0, filter.duration, CURVE_INTERVALS + 1)
            exits = np.concatenate([one.state["exited_at"] for one in results])
            found = breakthrough_curve(exits, edges, len(exits), filter.feed)
            axis.stairs(found.value, edges, color=colour, lw=1.5, label=f"{flow} flow")
        axis.axvline(filter.field_end, color="0.5", ls="--", lw=0.9)
        axis.set(xlabel="time (s)", title=f"{name}, {1e3 * speed:g} mm/s")
    axes[0].set(ylabel="concentration, outlet over feed")
    axes[0].legend(frameon=False, fontsize=9)
    finish(axes)
    assert first is not None
    return figure, first


def beside(size: str, progress: Progress) -> list[tuple[float, str, Mean]]:
    """Return the penetration of matrix, single fibres, cascade and matrix in a uniform flow, by speed."""
    rows = []
    for k, speed in enumerate(SPEEDS):
        filter = stream(speed, size, resolution=COMPARED_RESOLUTION)
        matrix = filter.matrix
        flows: tuple[tuple[Flow, str], ...] = (("resolved", "matrix"), ("uniform", "matrix, uniform flow"))
        for flow, name in flows:
            some = runs(replace(filter, flow=flow), FIGURE_STARTS)
            rows.append((speed, name, Mean.of([penetration(one) for one in some])))
        n, stages = matrix.density, matrix.depth * matrix.density ** (1 / 3)
        rows.append(
            (speed, "single fibres", lone_fibres(filter, LONE_FIBRES).passed(np.inf, n * matrix.depth))
        )
        still = filter_of(size, "static", duration=filter.stage, number=CASCADE_COLLOIDS)
        rows.append((speed, "cascade", lone_fibres(still, LONE_FIBRES).passed(np.inf, n, stages)))
        progress((k + 1) / len(SPEEDS))
    return rows


def neighbours(rows: Sequence[tuple[float, str, Mean]]) -> Figure:
    """Draw the penetration of the matrix beside estimates, by speed."""
    figure = empty(6.2, 4.2)
    axis = figure.subplots()
    names = list(dict.fromkeys(name for _, name, _ in rows))
    for name, colour in zip(names, (BLUE, RED, GREEN, PURPLE), strict=False):
        some = [(1e3 * speed, mean.value, mean.half) for speed, other, mean in rows if other == name]
        axis.errorbar(*np.array(some).T, color=colour, marker="o", ms=3, capsize=2, label=name)
    axis.set(xscale="log", xlabel="superficial velocity (mm/s)", ylabel="penetration", ylim=(0, 1.02))
    axis.legend(frameon=False, fontsize=9)
    plain(axis)
    return figure


def table(rows: Sequence[tuple[float, str, Mean]]) -> str:
    """Return the penetrations as CSV."""
    lines: list[list[object]] = [["speed_m_per_s", "estimate", "penetration", "half_width_95"]]
    return csv_text([*lines, *([speed, name, mean.value, mean.half] for speed, name, mean in rows)])


def finish(axes: Sequence[Axes]) -> None:
    """Give panels letters and plain frames."""
    for axis in axes:
        plain(axis)
    letters(axes)
