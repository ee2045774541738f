"""Figures of the case avalanche: slopes, filling of the heaps, forces by grain size, and grains in motion.

In the pictures of grains in motion, the colour of a grain shows the strip of the column in which it started.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from tisim import Scene
from tisim.cases.avalanche.measures import diameter, filled_parts, profile
from tisim.cases.avalanche.scaling import ratio
from tisim.cases.avalanche.scene import DIAMETERS, FLUX, SIZES, time_unit
from tisim.cases.avalanche.stages import SLOPES, Avalanche, avalanches, of
from tisim.cases.case import size_named
from tisim.cases.common.csv_tables import csv_text
from tisim.effects import Translation, Walls
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.io.reader import Frames
from tisim.plotting.cloud import panel
from tisim.plotting.look import FROM_THE_SIDE
from tisim.plotting.scenery import window
from tisim.plotting.style import empty, letters, plain
from tisim.rendering.camera import Window
from tisim.scene.initial_state import Arrays

SEEDS = 3
"""Number of starts whose slopes are drawn."""
COLOURS = ("#4477aa", "#cc6677")
"""Colours of slopes without a field and of magnetised slopes."""
GROUP_NAMES = ("without a field", "magnetised")
SHOWN = (30.0, 16.0)
"""Length and height of the drawn part of a heap, in diameters."""

AFTER = (0.0, 2.0, 4.0, 6.0, 10.0, 30.0)
"""Times of the pictures after the dividing wall is removed, in sqrt(d/g) (L21 Fig. 4.14)."""
STRIP = 3.0
"""Width of a strip of the column, in diameters."""
STRIP_COLOURS = ("#4477aa", "#ccbb44", "#228833", "#cc6677")
"""Colours of the strips, repeated in this order."""


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """slopes.png, slopes.csv: profiles and angles by grain size, with and without a field; density.png:
    fraction of the volume filled by grains; forces.png: magnetic force over weight."""
    settings = dict(size_named(size, SIZES).scene)
    some = [name for name, one in SIZES.items() if "diameter" not in one.scene]
    rule = f"one whose cell holds grains of each diameter in turn ({', '.join(some)})"
    must(size in some, "size", rule, size)
    wanted = [(d, field, seed) for d in DIAMETERS for field in (0.0, FLUX) for seed in range(SEEDS)]
    runs = avalanches(settings.pop("cell"), wanted, progress, **settings)
    return {
        "slopes.png": slopes_figure(runs),
        "slopes.csv": table(runs),
        "density.png": density_figure(runs),
        "forces.png": forces_figure(),
    }


def slopes_figure(runs: Sequence[Avalanche]) -> Figure:
    """Draw the mean profile of slopes with and without a field, one panel per grain diameter."""
    figure = empty(11.6, 3.6)
    axes = figure.subplots(1, len(DIAMETERS), sharey=True)
    for axis, d in zip(axes, DIAMETERS, strict=True):
        for field, colour, name in zip((0.0, FLUX), COLOURS, GROUP_NAMES, strict=True):
            group = of(runs, d, field)
            for one in group:
                place, height = profile(one.end.state)
                axis.plot(place / d, height / d, color=colour, lw=0.7, alpha=0.5)
            place, height = mean_profile(group)
            axis.plot(place / d, height / d, color=colour, lw=2.0, label=name)
        without, magnetised = SLOPES[d]
        published = f"L21: {without.angle:.1f}°, {magnetised.angle:.1f}°"
        axis.set(title=f"grains of {1e3 * d:g} mm ({published})", xlabel="distance (diameters)")
        axis.set(xlim=(0.0, SHOWN[0]), ylim=(0.0, SHOWN[1]), aspect="equal")
        axis.legend(frameon=False, fontsize=8)
        plain(axis)
    axes[0].set_ylabel("height (diameters)")
    letters(axes)
    return figure


def mean_profile(group: Sequence[Avalanche]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (m) along the cell and the mean height (m) of the slopes there, for one grain
    diameter."""
    d = group[0].diameter
    place = (np.arange(SHOWN[0]) + 0.5) * d
    heights = [np.interp(place, *profile(one.end.state), right=0.0) for one in group]
    return place, np.mean(heights, axis=0)


def density_figure(runs: Sequence[Avalanche]) -> Figure:
    """Draw the filled fraction of heaps of the smallest grains, with and without a field, as means over
    starts (L21 Fig. 4.13)."""
    d = DIAMETERS[0]
    figure = empty(11.6, 3.4)
    axes = figure.subplots(1, 2, sharey=True)
    for axis, field, name in zip(axes, (0.0, FLUX), GROUP_NAMES, strict=True):
        mesh = filled(axis, of(runs, d, field))
        axis.set(title=f"grains of {1e3 * d:g} mm, {name}", xlabel="distance (diameters)")
    axes[0].set_ylabel("height (diameters)")
    letters(axes)
    figure.colorbar(mesh, ax=axes, label="part of the volume that grains fill")
    return figure


def filled(axis: Axes, group: Sequence[Avalanche]) -> QuadMesh:
    """Draw the fraction of the volume filled by grains, and return the mesh for the colour bar."""
    length, height = SHOWN
    parts = np.mean(
        [
            filled_parts(one.end.state, one.width, length * one.diameter, height * one.diameter)
            for one in group
        ],
        axis=0,
    )
    edges = np.arange(length + 1), np.arange(height + 1)
    axis.set_aspect("equal")
    return axis.pcolormesh(*edges, np.ma.masked_less(parts.T, 0.02), cmap="viridis", vmin=0.0, vmax=0.7)


def forces_figure() -> Figure:
    """Draw attraction over weight of two touching grains against their diameter, for several fields.

    Solid lines include mutual magnetisation, dotted lines do not (L21 Figs 4.15 and 4.16).
    """
    figure = empty(5.6, 4.0)
    axis = figure.subplots()
    line = np.geomspace(1e-4, 1.0, 50)
    for field, colour in zip((5e-5, 5e-4, 5e-3), ("#228833", "#ccbb44", "#cc6677"), strict=True):
        axis.plot(line, [ratio(d, field) for d in line], color=colour, label=f"{1e3 * field:g} mT")
        axis.plot(line, [ratio(d, field, mutual=False) for d in line], color=colour, ls=":")
    axis.axhline(1.0, color="0.5", lw=0.8)
    axis.plot(DIAMETERS, [ratio(d) for d in DIAMETERS], "o", color="#cc6677", ms=6)
    axis.set(xscale="log", yscale="log", xlabel="diameter of the grains (m)", ylabel="attraction over weight")
    axis.legend(frameon=False, fontsize=8, title="dotted: moments of single grains")
    plain(axis)
    return figure


def table(runs: Sequence[Avalanche]) -> str:
    """Return the angles, the volume and the largest overlap of each avalanche as CSV."""
    rows: list[list[object]] = [
        [
            "diameter_m", "field_T", "seed", "angle_degrees", "upper_angle_degrees", "lower_angle_degrees",
            "volume_over_grains", "largest_overlap_over_radius",
        ]
    ]  # fmt: skip
    for one in runs:
        measured = (one.angle, *one.slopes, one.volume, one.overlap)
        rows.append([one.diameter, one.field, one.seed, *(f"{value:.4g}" for value in measured)])
    return csv_text(rows)


def opening(scene: Scene) -> float:
    """Return the time at which the dividing wall of a scene is removed, s."""
    gate = next(one for one in scene.effects if isinstance(one, Walls) and one.name == "gate")
    assert isinstance(gate.motion, Translation)
    return gate.motion.begin


def pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """calving.png: the collapse of the slope after the wall is removed, seen from the side.

    Returns nothing for a file with fewer frames than are drawn, such as a result.h5.
    """
    if len(trajectory) < len(AFTER):
        return {}
    scene, times = trajectory.scene, trajectory.times
    d = diameter(trajectory[0].arrays)
    begin, unit = opening(scene), time_unit(d)
    chosen = [trajectory[int(np.abs(times - begin - after * unit).argmin())] for after in AFTER]
    strips = strips_of(chosen[0].arrays, d)
    figure = empty(11.6, 5.4, pad=0.1)
    axes = figure.subplots(2, 3).ravel()
    part = window([frame.arrays for frame in chosen], look=FROM_THE_SIDE, ratio=1.4)
    for axis, frame in zip(axes, chosen, strict=True):
        side_view(axis, frame.arrays, strips, part)
        axis.set_title(f"after {max(frame.time - begin, 0.0):.2g} s")
    letters(axes)
    return {"calving.png": figure}


def strips_of(state: Arrays, d: float) -> dict[int, int]:
    """Return the strip of the column of each grain, by its id."""
    strip = (state["position"][:, 0] / (STRIP * d)).astype(int)
    return dict(zip(state["id"].tolist(), strip.tolist(), strict=True))


def side_view(axis: Axes, state: Arrays, strips: Mapping[int, int], part: Window) -> None:
    """Draw the grains on the floor as seen along the width of the cell, in the colours of their strips."""
    colours = [to_rgb(STRIP_COLOURS[strips[k] % len(STRIP_COLOURS)]) for k in state["id"].tolist()]
    panel(axis, state, part, colour=np.array(colours), look=FROM_THE_SIDE)
    axis.axhline(0.0, color="0.4", lw=1.0, zorder=1)
