"""Figures of the case blast: figures of one run, and a comparison of the runs of Z16."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim import Recording, run
from tisim.cases.blast import scene as blast
from tisim.cases.blast.rest_figure import growth, rest_figure, rest_table, rested
from tisim.cases.blast.shape import contacts, extents, half_axes
from tisim.cases.case import size_named
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.common.runs import sound
from tisim.engine.batches import Progress, progress_of_part
from tisim.io.reader import Frame, Frames, frames
from tisim.plotting.cloud import directions, panel
from tisim.plotting.scenery import window
from tisim.plotting.style import AXIS_COLOURS, empty, legend_above, letters, plain
from tisim.rendering.camera import USUAL_CAMERA, Window
from tisim.scene.initial_state import Arrays

SEQUENCE_FRAMES = 6
"""Number of frames in a sequence."""
NO_GRAVITY = np.zeros(3)
"""The blast has no gravity."""
PATHS = 40
"""Number of particles whose paths are drawn."""
RUNS = {
    "no_field": "no field (Z16 Fig. 7)",
    "default": "in the field, no interaction (Fig. 5)",
    "contact": "contact (Fig. 8)",
    "near_field": "contact and near field as printed (Fig. 9)",
    "clumps": "contact and near field of neighbours",
}
"""Titles of the compared runs, by size."""


@dataclass(frozen=True)
class BlastHistory:
    """The history of a run, with one entry per frame.

    time : s, (frames,). axes : half axes along x, y and z, m, (frames, 3). touching : number of touching
    pairs.
    paths, velocities : of PATHS particles, m and m/s, (frames, PATHS, 3).
    """

    time: np.ndarray
    axes: np.ndarray
    touching: np.ndarray
    paths: np.ndarray
    velocities: np.ndarray

    @classmethod
    def of(cls, trajectory: Frames) -> BlastHistory:
        """Read the history from all frames in one pass; particles are always in the order of their ids."""
        axes, touching, paths, velocities = [], [], [], []
        for frame in trajectory:
            state = frame.arrays
            axes.append(half_axes(state))
            touching.append(contacts(state))
            paths.append(state["position"][:PATHS])
            velocities.append(state["velocity"][:PATHS])
        return cls(
            trajectory.times, np.array(axes), np.array(touching), np.array(paths), np.array(velocities)
        )

    def dense(self, k: int) -> bool:
        """Return whether the frames of a particle are dense enough to be joined by a line: 8 or more per
        circle."""
        v = self.velocities[:, k, 1] + 1j * self.velocities[:, k, 2]
        return bool(np.median(np.abs(np.angle(v[1:] * v[:-1].conj()))) < np.pi / 4)


def pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """sequence.png: the cloud at six times; velocities.png: its velocities at these times; envelope.png: half
    axes, velocities of one particle, and paths.

    Returns nothing for a file with fewer frames than SEQUENCE_FRAMES, such as a result.h5.
    """
    if len(trajectory) < SEQUENCE_FRAMES:
        return {}
    chosen = [trajectory[k] for k in np.linspace(0, len(trajectory) - 1, SEQUENCE_FRAMES).round().astype(int)]
    return {
        "sequence.png": sequence(chosen),
        "velocities.png": velocities(chosen),
        "envelope.png": envelope(BlastHistory.of(trajectory)),
    }


def sequence(chosen: Sequence[Frame]) -> Figure:
    """Return the cloud at the chosen times, all on one scale, as in Z16 figures 5 to 9."""
    figure = empty(10.4, 7.2)
    part = window([frame.arrays for frame in chosen])
    axes = figure.subplots(2, 3)
    for axis, frame in zip(axes.flat, chosen, strict=True):
        snapshot(axis, frame.arrays, part)
        directions(axis, part, NO_GRAVITY)
        axis.set_title(f"t = {1e3 * frame.time:.0f} ms")
    letters(axes.flat)
    return figure


def velocities(chosen: Sequence[Frame]) -> Figure:
    """Draw velocity vectors at the positions of the particles, all on one scale (Z16 Fig. 6, left)."""
    figure = empty(10.4, 7.2)
    left, bottom, side, _ = window([frame.arrays for frame in chosen])
    fastest = max(np.linalg.norm(frame.arrays["velocity"], axis=1).max() for frame in chosen)
    # The longest arrow is an eighth of the picture, so a margin is added for it.
    left, bottom, side = left - side / 8, bottom - side / 8, 1.25 * side
    part = Window(left, bottom, side, side)
    scale = 8.0 * fastest / side
    axes = figure.subplots(2, 3)
    for axis, frame in zip(axes.flat, chosen, strict=True):
        seen = {name: USUAL_CAMERA.project(frame.arrays[name]) for name in ("position", "velocity")}
        (x, y), (u, v) = (seen[name][:, :2].T for name in ("position", "velocity"))
        axis.quiver(
            x,
            y,
            u,
            v,
            angles="xy",
            scale_units="xy",
            scale=scale,
            color=AXIS_COLOURS[0],
            width=0.0025,
            alpha=0.6,
        )
        axis.set(xlim=(left, left + side), ylim=(bottom, bottom + side), aspect="equal", xticks=[], yticks=[])
        directions(axis, part, NO_GRAVITY)
        axis.set_title(f"t = {1e3 * frame.time:.0f} ms")
    figure.suptitle(f"longest arrow: {fastest:.3g} m/s", fontsize=10)
    letters(axes.flat)
    return figure


def snapshot(axis: Axes, state: Arrays, part: Window) -> None:
    """Draw a state within a window."""
    panel(axis, state, part)


def envelope(history: BlastHistory) -> Figure:
    """Draw the half axes of the cloud over time, velocities across the field (Z16 Fig. 6), and paths along
    and across it."""
    figure = empty(10.4, 7.4)
    (left, right), (along, across) = figure.subplots(2, 2)
    for k, colour in enumerate(AXIS_COLOURS):
        left.plot(history.time, history.axes[:, k], "--" if k == 2 else "-", color=colour, label="xyz"[k])
    left.set(xlabel="time (s)", ylabel="half axes of the cloud (m)", ylim=(0, None))
    left.set_title("half axes")
    legend_above(left)
    fastest = int(np.linalg.norm(history.velocities[0, :, 1:], axis=1).argmax())
    line = "-" if history.dense(fastest) else "."
    for k in (1, 2):
        speed = history.velocities[:, fastest, k]
        right.plot(history.time, speed, line, ms=3, color=AXIS_COLOURS[k], lw=1.0, label="xyz"[k])
    right.set(xlabel="time (s)", ylabel="velocity (m/s)", title="one particle")
    legend_above(right)
    along.plot(history.paths[:, :, 0], history.paths[:, :, 1], color=AXIS_COLOURS[0], lw=0.7)
    along.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title=f"paths of {PATHS} particles")
    # The particle that starts fastest across the field, enlarged: its circle is far smaller than the cloud.
    across.plot(
        history.paths[:, fastest, 1], history.paths[:, fastest, 2], line, ms=3, color=AXIS_COLOURS[0], lw=0.8
    )
    across.set(xlabel="y (m)", ylabel="z (m)", title="path of one particle")
    across.set_aspect("equal", "datalim")
    for axis in (left, right, along, across):
        plain(axis)
    letters((left, right, along, across))
    return figure


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """blast.png, blast.csv: comparison of the runs of Z16. rest.png, rest.csv: the blast at rest. With 500
    particles for the size small, and otherwise 2000."""
    number = int(size_named(size, blast.SIZES).scene.get("number", blast.NUMBER))
    histories, ends, parts = {}, {}, len(RUNS) + 2
    for finished, name in enumerate(RUNS):
        settings = {**size_named(name, blast.SIZES).scene, "number": number}
        with TemporaryDirectory() as folder:
            path = Path(folder) / "trajectory.h5"
            result = run(
                blast.scene(**settings),
                progress_of_part(progress, finished, parts),
                Recording(path, frames=50),
            )
            sound([result])
            with frames(path) as trajectory:
                histories[name], ends[name] = BlastHistory.of(trajectory), trajectory[-1]
    cloud = growth(number, progress_of_part(progress, len(RUNS), parts))
    clouds = rested(number, progress_of_part(progress, len(RUNS) + 1, parts))
    return {
        "blast.png": beside(histories, ends),
        "blast.csv": table(histories),
        "rest.png": rest_figure(cloud, clouds),
        "rest.csv": rest_table(clouds),
    }


def beside(histories: Mapping[str, BlastHistory], ends: Mapping[str, Frame]) -> Figure:
    """Draw the clouds at the end on one scale, and their half axes and contacts over time."""
    figure = empty(11.6, 6.4)
    grid = figure.add_gridspec(2, 15, height_ratios=(0.75, 1.0))
    part = window([frame.arrays for frame in ends.values()])
    for k, (name, frame) in enumerate(ends.items()):
        axis = figure.add_subplot(grid[0, 3 * k : 3 * k + 3])
        snapshot(axis, frame.arrays, part)
        axis.set_title(RUNS[name].replace(" (", "\n(").replace("near field ", "near field\n"))
    # The last panel has space for the axes.
    directions(figure.axes[-1], part, NO_GRAVITY, share=0.12)
    along, across, touching = (figure.add_subplot(grid[1, 5 * k : 5 * k + 5]) for k in range(3))
    colours = ("0.45", "#4477aa", "#228833", "#cc6677", "#aa7733")
    for (name, history), colour in zip(histories.items(), colours, strict=False):
        for axis, values in (
            (along, history.axes[:, 0]),
            (across, np.sqrt((history.axes[:, 1:] ** 2).mean(axis=1))),
            (touching, history.touching),
        ):
            axis.plot(history.time, values, color=colour, lw=1.4, label=RUNS[name].split(" (")[0])
    number = len(next(iter(ends.values())).arrays["mass"])
    start = float(next(iter(histories.values())).axes[0].mean())
    time = np.linspace(0.0, 1.0, 400)
    for axis, moment in zip(
        (along, across), extents(blast.SPECIFIC_CHARGE * blast.FLUX, time, start), strict=True
    ):
        axis.plot(time, np.sqrt(5 * moment), ":", color="k", lw=1.2, label="closed form, no interaction")
        axis.set(xlabel="time (s)", ylim=(0, 3.4))
    along.set_ylabel("half axis along x, the field (m)")
    across.set_ylabel("half axis across (m)")
    touching.set(xlabel="time (s)", ylabel=f"pairs that touch, of {number} particles", yscale="symlog")
    figure.legend(
        *across.get_legend_handles_labels(), frameon=False, fontsize=8, loc="outside lower center", ncols=3
    )
    for axis in (along, across, touching):
        plain(axis)
    letters(figure.axes, 8)
    return figure


def table(histories: Mapping[str, BlastHistory]) -> str:
    """Return the half axes and contacts of all runs over time as CSV."""
    rows: list[list[object]] = [
        ["run", "time_s", "half_axis_x_m", "half_axis_y_m", "half_axis_z_m", "pairs_that_touch"]
    ]
    for name, history in histories.items():
        for time, axes, pairs in zip(history.time, history.axes, history.touching, strict=True):
            rows.append([name, float(time), *map(float, axes), int(pairs)])
    return csv_text(rows)
