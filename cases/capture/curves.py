"""Captured fractions of the case capture over time and at the end, and the Brownian fractions of the free
particles, by angle, particle size and aspect ratio."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim import Result
from tisim.analysis import Mean
from tisim.cases.capture import scene as capture
from tisim.cases.capture.diffusing import FREE, Part, brownian, brownian_fraction
from tisim.cases.capture.statistics import (
    ANGLES,
    ASPECTS,
    Settings,
    even,
    fraction,
    fractions,
    isotropic,
    mean,
    results,
)
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.common.magnetic_fibre import SATURATION_MOMENTS
from tisim.engine.batches import Progress, progress_of_part
from tisim.plotting.style import empty, legend_beside, letters, plain

CURVE_REPEATS = 10
"""Number of starts of each setting for the curves; the checks use more."""
TIMES = np.linspace(0.0, capture.DURATION, 101)
"""The times of the points of a curve, s."""
SOME = (50, 125, 212)
"""The particle radii for which the aspect ratio of the cylinder is varied, nm."""

Row = tuple[Settings, Sequence[Result]]
"""A setting and its results."""


def figures(progress: Progress) -> Mapping[str, Figure | str]:
    """Return the files capture.png and capture.csv, captured fractions by angle, size and aspect ratio, and
    brownian.png, the Brownian fractions of the same runs."""
    angles: list[Settings] = [
        {"nanometres": n, "angle": a, "aspect": 20.0, "part": part}
        for n in (75, 212) for part in ("top", "side") for a in ANGLES
    ]  # fmt: skip
    sizes: list[Settings] = [
        {"nanometres": n, "angle": a, "aspect": 20.0} for n in SATURATION_MOMENTS for a in ANGLES
    ]
    aspects: list[Settings] = [
        {"nanometres": n, "angle": a, "aspect": r} for n in SOME for r in ASPECTS for a in ANGLES
    ]
    parts = []
    for finished, settings in enumerate((angles, sizes, aspects)):
        groups = results(settings, CURVE_REPEATS, progress_of_part(progress, finished, 3))
        parts.append(list(zip(settings, groups, strict=True)))
    return {
        "capture.png": captured(*parts),
        "brownian.png": diffusing(*parts[1:]),
        "capture.csv": table([row for part in parts for row in part]),
    }


def captured(angles: Sequence[Row], sizes: Sequence[Row], aspects: Sequence[Row]) -> Figure:
    """Draw the captured fraction over time and at the end.

    Over time: by angle for TOP and SIDE (B16 Fig. 6.4), by size, and by aspect ratio. At the end: by angle
    and size (6.6a), and by aspect ratio and size (6.6b).
    """
    figure = empty(12.0, 13.0)
    grid = figure.subplots(4, 2)
    for k, axis in enumerate(grid[:2].flat):
        in_time_by_angle(axis, angles[k * len(ANGLES) : (k + 1) * len(ANGLES)])
    handles, names = grid[0, 0].get_legend_handles_labels()
    in_time_by_size(grid[2, 0], [row for row in sizes if row[0]["angle"] == 90.0])
    in_time_by_aspect(grid[2, 1], [row for row in aspects if row[0]["nanometres"] == 125])
    by_size(grid[3, 0], sizes)
    by_aspect(grid[3, 1], aspects)
    for axis in grid[:3].flat:
        axis.set(xlabel="time (s)", ylabel="captured fraction", ylim=(0, 1.02))
    for axis in grid.flat:
        plain(axis)
    letters(grid.flat)
    figure.legend(
        handles, names, loc="outside upper center", frameon=False, ncols=len(names),
        title="(a) to (d): angle of the axis to the field",
    )  # fmt: skip
    return figure


def curve(group: Iterable[Result]) -> np.ndarray:
    """Return the captured fraction at TIMES, the mean over repeats."""
    return np.mean([[fraction(result.state, t) for t in TIMES] for result in group], axis=0)


def in_time_by_angle(axis: Axes, rows: Sequence[Row]) -> None:
    for (settings, group), colour in zip(rows, _colours("viridis", len(rows)), strict=True):
        axis.plot(TIMES, curve(group), color=colour, lw=1.4, label=f"{settings['angle']:.0f}°")
    settings = rows[0][0]
    part, aspect = str(settings["part"]).upper(), float(settings["aspect"])
    axis.set_title(f"{settings['nanometres']} nm, {part}, L/D = {aspect:.3g}")


def in_time_by_size(axis: Axes, rows: Sequence[Row]) -> None:
    for (settings, group), colour in zip(rows, _colours("plasma", len(rows)), strict=True):
        axis.plot(TIMES, curve(group), color=colour, lw=1.4, label=f"{settings['nanometres']} nm")
    axis.set_title("transverse, L/D = 20, by radius")
    legend_beside(axis)


def in_time_by_aspect(axis: Axes, rows: Sequence[Row]) -> None:
    for aspect, colour in zip(ASPECTS, _colours("cividis", len(ASPECTS)), strict=True):
        curves = [curve(group) for settings, group in rows if settings["aspect"] == aspect]
        axis.plot(TIMES, even(np.array(curves)), color=colour, lw=1.4, label=f"L/D = {aspect:.3g}")
    axis.set_title("125 nm, even mean over angles, by aspect ratio")
    legend_beside(axis)


def by_size(axis: Axes, rows: Sequence[Row]) -> None:
    for n, colour in zip(SATURATION_MOMENTS, _colours("plasma", len(SATURATION_MOMENTS)), strict=True):
        means = [mean(group) for settings, group in rows if settings["nanometres"] == n]
        bars(axis, ANGLES, means, colour, f"{n} nm")
    axis.set(xlabel="angle of the axis to the field (°)", ylabel="captured fraction after 50 s")
    axis.set(ylim=(0, 1.02), title="L/D = 20, by radius; 95 % intervals")
    legend_beside(axis)


def by_aspect(axis: Axes, rows: Sequence[Row]) -> None:
    for n, colour in zip(SOME, ("#228833", "#4477aa", "#cc6677"), strict=True):
        groups = [
            np.array([fractions(group) for s, group in rows if (s["nanometres"], s["aspect"]) == (n, aspect)])
            for aspect in ASPECTS
        ]
        bars(axis, ASPECTS, [Mean.of(even(group)) for group in groups], colour, f"{n} nm")
        alike = [Mean.of(isotropic(group)) for group in groups]
        bars(axis, ASPECTS, alike, colour, f"{n} nm, all directions\nequally likely", ":")
    axis.set(xlabel="aspect ratio L/D", ylabel="captured fraction after 50 s", ylim=(0.4, 1.0), xscale="log")
    axis.set_xticks([2, 5, 10, 20], ["2", "5", "10", "20"])
    axis.minorticks_off()
    axis.set_title("even mean over angles; 95 % intervals")
    legend_beside(axis)


def diffusing(sizes: Sequence[Row], aspects: Sequence[Row]) -> Figure:
    """Draw the Brownian fraction after 50 s, by B16 (6.24).

    By angle and size for SIDE and TOP (B16 Fig. 6.8a), by angle for two aspect ratios (6.8b), and by size,
    averaged over angles (6.9). The regions are those in which particles have started.
    """
    figure = empty(12.0, 7.2)
    grid = figure.subplots(2, 2)
    brownian_by_size(grid[0, 0], sizes, "side")
    brownian_by_size(grid[0, 1], sizes, "top")
    brownian_by_aspect(grid[1, 0], aspects)
    by_angle = [
        np.array([[brownian(one).mean() for one in group] for s, group in sizes if s["nanometres"] == n])
        for n in SATURATION_MOMENTS
    ]
    radii = tuple(SATURATION_MOMENTS)
    for average, label, line in (
        (even, "uniform in angle", "-"),
        (isotropic, "all directions\nequally likely", ":"),
    ):
        bars(grid[1, 1], radii, [Mean.of(average(one)) for one in by_angle], "#4477aa", label, line)
    grid[1, 1].set(xlabel="radius (nm)", title="L/D = 20, mean over angles; 95 % intervals")
    legend_beside(grid[1, 1])
    for axis in grid.flat:
        axis.axhline(FREE, color="0.6", lw=0.8, ls="--")
        axis.set(ylabel="Brownian fraction after 50 s", ylim=(-0.02, 1.0))
        plain(axis)
    grid[0, 1].text(ANGLES[-1], FREE + 0.02, "without a magnet", ha="right", fontsize="small", color="0.4")
    letters(grid.flat)
    return figure


def brownian_by_size(axis: Axes, rows: Sequence[Row], part: Part) -> None:
    for n, colour in zip(SATURATION_MOMENTS, _colours("plasma", len(SATURATION_MOMENTS)), strict=True):
        means = [brownian_fraction(group, part) for settings, group in rows if settings["nanometres"] == n]
        bars(axis, ANGLES, means, colour, f"{n} nm")
    axis.set(xlabel="angle of the axis to the field (°)", title=f"{part.upper()}, L/D = 20; 95 % intervals")
    legend_beside(axis)


def brownian_by_aspect(axis: Axes, rows: Sequence[Row]) -> None:
    for n, colour in zip(SOME, ("#228833", "#4477aa", "#cc6677"), strict=True):
        for aspect, line in ((ASPECTS[0], "-"), (ASPECTS[2], ":")):
            of_both = [g for s, g in rows if (s["nanometres"], s["aspect"]) == (n, aspect)]
            means = [brownian_fraction(group) for group in of_both]
            bars(axis, ANGLES, means, colour, f"{n} nm, L/D = {aspect:.3g}", line)
    axis.set(xlabel="angle of the axis to the field (°)", title="both regions; 95 % intervals")
    legend_beside(axis)


def bars(
    axis: Axes, x: Sequence[float], means: Sequence[Mean], colour: object, label: str, line: str = "-"
) -> None:
    """Draw means with their confidence intervals."""
    axis.errorbar(
        x, [m.value for m in means], [m.half for m in means], color=colour, lw=1.3, ls=line, marker="o",
        ms=3, capsize=2, label=label,
    )  # fmt: skip


def table(rows: Sequence[Row]) -> str:
    """Return the captured fractions at the end as CSV."""
    lines: list[list[object]] = [
        ["radius_nm", "angle_deg", "aspect", "part", "repeats", "captured", "half_width_95"]
    ]
    for settings, group in rows:
        m = mean(group)
        part = settings.get("part", "all")
        setting = (settings["nanometres"], settings["angle"], settings["aspect"], part)
        lines.append([*setting, len(group), m.value, m.half])
    return csv_text(lines)


def _colours(name: str, number: int) -> np.ndarray:
    return colormaps[name](np.linspace(0.0, 0.88, number))
