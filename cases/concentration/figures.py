"""Figures of the case concentration: chains, and captured fractions over time."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim import Recording, run
from tisim.analysis import head_to_tail, labels
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.concentration import scene as concentration
from tisim.cases.concentration.scene import coupling
from tisim.cases.concentration.statistics import CAPTURE, chain, held_fraction, touched_fraction
from tisim.engine.batches import Progress, progress_of_part
from tisim.io.reader import Frames, frames
from tisim.plotting.cloud import directions, panel
from tisim.plotting.clusters import cluster_colours
from tisim.plotting.look import FROM_THE_SIDE
from tisim.plotting.scenery import window
from tisim.plotting.style import empty, letters, plain
from tisim.scene.initial_state import Arrays

SNAPSHOT: dict[str, Any] = {"number": 125, "duration": 2e-3}
"""Settings of the runs for the snapshots."""
CONCENTRATIONS = (0.005, 0.5, 2.0)
"""Concentrations of the curves, g/mL."""
CURVE_DURATION = 0.6
"""The simulated time that curves span, s."""
CURVE_REPEATS, CURVE_FRAMES = 2, 90
"""Number of repeats averaged for a curve, and number of its points."""
HELD, TOUCHED = "captured or in a chain that is", "captured"
"""Names of the two curves of captured particles."""


def pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """chains.png: the particles at the end, or in the last frame before the first is captured; the mean chain
    length over time; and the captured fraction over time if any are captured."""
    every = list(trajectory)
    last = every[-1].arrays
    if "moment" not in last:
        return {}
    captured = touched_fraction(last) > 0
    free = max(k for k, frame in enumerate(every) if k == 0 or touched_fraction(frame.arrays) == 0)
    figure = empty(14.4 if captured else 10.4, 4.6)
    left, right, *beside = figure.subplots(1, 3 if captured else 2)
    snapshot(left, every[free].arrays)
    times = 1e3 * trajectory.times
    moment = last["moment"]
    right.plot(times, [chain(frame.arrays, moment) for frame in every], color="#4477aa")
    right.set(xlabel="time (ms)", ylabel="mean number of particles of a chain", ylim=(0, None))
    plain(right)
    left.set_title(f"after {times[free]:.3g} ms, coloured by chain; grey: single")
    for axis in beside:
        states = [frame.arrays for frame in every]
        axis.plot(times, [held_fraction(one) for one in states], color="#4477aa", label=HELD)
        axis.plot(times, [touched_fraction(one) for one in states], color="#4477aa", ls=":", label=TOUCHED)
        axis.set(xlabel="time (ms)", ylabel="fraction of the particles", ylim=(0, 1.02))
        soonest = 1e3 * float(last["captured_at"][last["captured_at"] >= 0].min())
        axis.set_title(f"the first after {soonest:.3g} ms, at the end {held_fraction(last):.3g}")
        axis.legend(frameon=False, fontsize=9)
        plain(axis)
    letters((left, right, *beside))
    return {"chains.png": figure}


def snapshot(axis: Axes, state: Arrays) -> None:
    """Draw the particles as seen along y, across the field; single particles are grey, the others coloured by
    chain."""
    position, moment, radius = state["position"], state["moment"], float(state["radius"][0])
    chains = labels(len(position), head_to_tail(position, moment, 2 * radius))
    part = window([state], look=FROM_THE_SIDE)
    panel(axis, state, part, colour=cluster_colours(chains), look=FROM_THE_SIDE)
    directions(axis, part, np.zeros(3), camera=FROM_THE_SIDE.camera)


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """snapshots.png (B16 Fig. 6.12); captured.png, captured.csv (Fig. 6.13); for any ``size``."""
    keys = [(size, c) for c in (0.5, 2.0) for size in (25, 75)]
    scenes = [concentration.scene(nanometres=n, concentration=c, **SNAPSHOT) for n, c in keys]
    figure = empty(8.8, 8.4)
    results = run(scenes, progress_of_part(progress, 0, 2))
    grid = figure.subplots(2, 2)
    for axis, (n, c), result in zip(grid.flat, keys, results, strict=True):
        snapshot(axis, result.state)
        length = chain(result.state, result.state["moment"])
        axis.set_title(f"{n} nm, {c:g} g/mL\ncoupling Γ = {coupling(n):.3g}, mean chain {length:.1f}")
    letters(grid.flat)
    curves = captured(progress_of_part(progress, 1, 2))
    return {"snapshots.png": figure, "captured.png": captured_figure(curves), "captured.csv": table(curves)}


Curves = Mapping[tuple[float, float], tuple[np.ndarray, np.ndarray, np.ndarray]]


def captured(progress: Progress) -> Curves:
    """Return times (s), fraction touching the cylinder and fraction held by it, by angle (degrees) and
    g/mL."""
    keys = [(angle, c) for angle in (0.0, 90.0) for c in CONCENTRATIONS]
    settings = {**CAPTURE, "duration": CURVE_DURATION}
    scenes = [
        concentration.scene(angle=angle, concentration=c, seed=seed, **settings)
        for angle, c in keys for seed in range(CURVE_REPEATS)
    ]  # fmt: skip
    curves = {}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "runs.h5"
        run(scenes, progress, Recording(path, frames=CURVE_FRAMES))
        for k, key in enumerate(keys):
            touched, hanging = [], []
            for world in range(k * CURVE_REPEATS, (k + 1) * CURVE_REPEATS):
                with frames(path, world) as trajectory:
                    every = [frame.arrays for frame in trajectory]
                    touched.append([touched_fraction(state) for state in every])
                    hanging.append([held_fraction(state) for state in every])
                    times = trajectory.times
            curves[key] = (times, np.mean(touched, axis=0), np.mean(hanging, axis=0))
    return curves


def captured_figure(curves: Curves) -> Figure:
    """Draw the longitudinal and the transverse orientation side by side."""
    figure = empty(10.4, 4.4)
    axes = figure.subplots(1, 2, sharey=True)
    for axis, angle in zip(axes, (0.0, 90.0), strict=True):
        for c, colour in zip(CONCENTRATIONS, ("#cc6677", "#4477aa", "#228833"), strict=True):
            times, touched, hanging = curves[angle, c]
            name = f"{1e3 * c:g} mg/mL"
            axis.plot(times, hanging, color=colour, lw=1.5, label=f"{name}, {HELD}")
            axis.plot(times, touched, color=colour, lw=1.0, ls=":", label=f"{name}, {TOUCHED}")
        axis.set(xlabel="time (s)", ylim=(0, 1.02), title=f"axis at {angle:.0f}° to the field")
        plain(axis)
    axes[0].set_ylabel(f"fraction of the particles,\nmean of {CURVE_REPEATS} starts")
    letters(axes)
    handles, names = axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", frameon=False, fontsize=8, ncols=3)
    return figure


def table(curves: Curves) -> str:
    """Return the captured fractions over time as CSV."""
    rows: list[list[object]] = [["angle_deg", "g_per_mL", "time_s", "touched", "held"]]
    for (angle, c), parts in curves.items():
        rows.extend([angle, c, *row] for row in zip(*parts, strict=True))
    return csv_text(rows)
