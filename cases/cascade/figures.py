"""Figures of the case cascade: captured fractions over time, and a comparison of random and optimal
cascades."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.analysis import Mean
from tisim.cases.cascade.scene import STAGE, Cascade, Orientation
from tisim.cases.cascade.statistics import (
    CAPTURED_SHARE,
    OFF,
    ORIENTATIONS,
    PUBLISHED_TIMES,
    RANDOM,
    captured_at,
    time_to,
)
from tisim.cases.common.csv_tables import csv_text
from tisim.engine.batches import Progress
from tisim.plotting.style import empty, legend_beside, letters, plain

CURVE_SHARE = 0.97
"""Share of the particles at which curves end."""
CURVE_REPEATS = 20
"""Number of repeats of a cascade for each curve."""
STAGES = (0.1, 0.5, 2.0, 10.0)
"""Stage durations in the figure of 125 nm, s (B16 Fig. 6.11b)."""
SIZE_COLOURS = {25: "#cc6677", 125: "#4477aa"}
LIKELY = {"directions": "all directions alike", "angles": "all angles alike"}
"""The uniformly distributed quantity of a random cascade, by its orientation."""
LINES: dict[Orientation, str] = {"optimal": "-", "directions": ":", "angles": "--"}

Times = Mapping[Cascade, np.ndarray]


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """cascade.png, cascade.csv: all cascades, for any ``size``."""
    runs = [
        Cascade(n, STAGE[n], how, aspect, gap=gap)
        for gap, aspect in ((OFF, 20.0), (0.0, 20.0), (0.0, 5 / 3))
        for n in PUBLISHED_TIMES
        for how in LINES
    ]  # fmt: skip
    stages = [
        Cascade(125, stage, how, gap=OFF) for stage in STAGES for how in ORIENTATIONS[:2]
    ]  # fmt: skip
    cascades = list(dict.fromkeys([*runs, *stages]))
    times = captured_at(cascades, CURVE_REPEATS, CURVE_SHARE, progress=progress)
    times_of = dict(zip(cascades, times, strict=True))
    figure = empty(12.6, 7.6)
    (a, b), (c, d) = figure.subplots(2, 2)
    of_size(a, times_of, 125)
    of_size(b, times_of, 25)
    of_stage(c, times_of)
    of_ratio(d, times_of)
    letters((a, b, c, d))
    return {"cascade.png": figure, "cascade.csv": table(times_of)}


def curve(axis: Axes, times: np.ndarray, label: str, **style: Any) -> None:
    """Draw the captured fraction over time, the mean over repeats."""
    when = np.sort(times[np.isfinite(times)])
    share = np.arange(1, len(when) + 1) / times.size
    in_range = share <= CURVE_SHARE
    axis.plot(when[in_range], share[in_range], label=label, lw=1.4, **style)


def of_size(axis: Axes, times_of: Times, nanometres: int) -> None:
    """Draw random and optimal cascades of a size (B16 Fig. 6.11a), and the published times to 90 %."""
    for how, line in LINES.items():
        one = Cascade(nanometres, STAGE[nanometres], how, gap=OFF)
        label = {"optimal": "optimal", "directions": "random direction", "angles": "random angle"}[how]
        curve(axis, times_of[one], label, color=SIZE_COLOURS[nanometres], linestyle=line)
    axis.axhline(CAPTURED_SHARE, color="0.6", lw=0.8, label=f"{CAPTURED_SHARE:.0%}")
    for time, name in zip(PUBLISHED_TIMES[nanometres], ("B16, random", "B16, optimal"), strict=True):
        axis.plot(
            time,
            CAPTURED_SHARE,
            "o" if name.endswith("optimal") else "s",
            color="0.3",
            ms=5,
            label=name,
            ls="",
        )
    axis.set(xlabel="time (s)", ylabel="captured fraction", ylim=(0, 1.02), xlim=(0, None))
    axis.set_title(f"{nanometres} nm, stages of {STAGE[nanometres]:g} s")
    legend_beside(axis)
    plain(axis)


def of_stage(axis: Axes, times_of: Times) -> None:
    """Draw cascades of 125 nm with different stage durations (B16 Fig. 6.11b)."""
    for stage, colour in zip(STAGES, ("#aa3377", "#4477aa", "#228833", "#ccbb44"), strict=True):
        for how in ORIENTATIONS[:2]:
            label = f"{stage:g} s, {'optimal' if how == 'optimal' else 'random direction'}"
            curve(
                axis, times_of[Cascade(125, stage, how, gap=OFF)], label, color=colour, linestyle=LINES[how]
            )
    axis.axhline(CAPTURED_SHARE, color="0.6", lw=0.8, label=f"{CAPTURED_SHARE:.0%}")
    axis.set(xlabel="time (s)", ylabel="captured fraction", ylim=(0, 1.02), xlim=(0, 40))
    axis.set_title("125 nm, by length of a stage")
    legend_beside(axis)
    plain(axis)


def of_ratio(axis: Axes, times_of: Times) -> None:
    """Draw the time to 90 % of random cascades over the optimal ones, by L/D, layer and kind of
    randomness."""
    bases = [one for one in times_of if one.orientation == "optimal" and one.stage == STAGE[one.nanometres]]
    names = {(r.aspect, r.gap): f"L/D {r.aspect:.3g},\n{r.gap:g} R off" for r in bases}
    places = {key: k for k, key in enumerate(names)}
    for base in bases:
        for how, mark, shift in zip(RANDOM, "oD", (-0.08, 0.08), strict=True):
            m = ratio(times_of, replace(base, orientation=how))
            x = places[base.aspect, base.gap] + shift + (0.2 if base.nanometres == 25 else -0.2)
            colour = SIZE_COLOURS[base.nanometres]
            label = f"{base.nanometres} nm, {LIKELY[how]}" if x < 0.5 else None
            axis.errorbar(x, m.value, m.half, color=colour, marker=mark, ms=4, capsize=2, ls="", label=label)
    for nanometres, (random, best) in PUBLISHED_TIMES.items():
        label = f"B16, {nanometres} nm"
        axis.axhline(random / best, color=SIZE_COLOURS[nanometres], lw=0.9, ls="--", label=label)
    axis.set_xticks(list(places.values()), list(names.values()))
    axis.set(ylabel=f"time to {CAPTURED_SHARE:.0%}, random over optimal", ylim=(0.8, 3.6))
    axis.set_title("random cascades against optimal ones; 95 % intervals")
    legend_beside(axis)
    plain(axis)


def ratio(times_of: Times, one: Cascade) -> Mean:
    """Return the time to 90 % of a cascade divided by the time of the optimal one."""
    best = times_of[replace(one, orientation="optimal")]
    return Mean.of(time_to(CAPTURED_SHARE, times_of[one])).over(Mean.of(time_to(CAPTURED_SHARE, best)))


def table(times_of: Times) -> str:
    """Return the time to 90 % of each cascade, as CSV."""
    names = [field.name for field in fields(Cascade)]
    rows: list[list[object]] = [[*names, "repeats", "s_to_90_percent", "half_width_95"]]
    for one, times in times_of.items():
        m = Mean.of(time_to(CAPTURED_SHARE, times))
        rows.append([*(getattr(one, name) for name in names), len(times), m.value, m.half])
    return csv_text(rows)
