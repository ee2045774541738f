"""Standard pictures of a run: the cloud at its start and end, and quantities against time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tisim.data_frames import data_frame, vector_columns
from tisim.engine.assembly import measured
from tisim.errors import Words, must
from tisim.io.reader import Frames
from tisim.plotting.cloud import start_and_end
from tisim.plotting.look import USUAL, Look
from tisim.plotting.style import AXIS_COLOURS, empty, legend_above, letters, plain, quantity, scale_of

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True)
class TimeSeries:
    """Time series of a run, one value per frame.

    time : s.
    kinetic_energy : J.
    number : number of particles.
    shift : displacement of the centre of gravity, m, shape (frames, 3).
    drift : velocity of the centre of gravity, m/s, shape (frames, 3).

    In a sheared box all velocities, including those in the kinetic energy, are relative to the flow of its
    images. Without particles the centre of gravity is NaN; its displacement is from its first known position.
    """

    time: np.ndarray
    kinetic_energy: np.ndarray
    shift: np.ndarray
    drift: np.ndarray
    number: np.ndarray


def history(frames: Frames) -> TimeSeries:
    """Return the time series of all frames; each frame is read once."""
    energy, centre, drift, number = [], [], [], []
    for frame in frames:
        mass, velocity = frame.arrays["mass"].astype(float), frame.arrays["velocity"].astype(float)
        velocity -= frames.scene.domain.streaming_velocity(frame.arrays["position"].astype(float))
        energy.append(0.5 * float((mass * (velocity**2).sum(axis=1)).sum()))
        centre.append(_mean(frame.arrays["position"], mass))
        drift.append(_mean(velocity, mass))
        number.append(len(mass))
    # Relative to the first frame with particles.
    begun = int(np.argmax(np.array(number) > 0))
    shift = np.array(centre) - centre[begun]
    return TimeSeries(frames.times, np.array(energy), shift, np.array(drift), np.array(number))


def time_series_frame(frames: Frames) -> DataFrame:
    """Return the time series and the measures of a run as a pandas data frame, a row for each frame.

    InputError if pandas is not installed.
    """
    series = history(frames)
    arrays = {
        "time": series.time, "particles": series.number, "kinetic_energy": series.kinetic_energy,
        "shift": series.shift, "drift": series.drift,
    }  # fmt: skip
    units = {"time": "s", "kinetic_energy": "J", "shift": "m", "drift": "m/s"}
    columns, unit_of = vector_columns(arrays, units)
    return data_frame(columns | dict(frames.measures), unit_of | measured(frames.scene.effects))


def _mean(values: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return the mass-weighted mean of vectors; NaN if there are none."""
    return np.average(values, axis=0, weights=mass) if len(mass) else np.full(3, np.nan)


def clouds(frames: Frames, look: Look = USUAL) -> Figure:
    """Draw the first and the last frame side by side. Raise InputError if there are no frames.

    look : view, crop, cuts and colours.
    """
    must(len(frames) > 0, "file", "one with a frame", Words("one with none yet"))
    first, last = frames[0], frames[-1]
    states, times = (first.arrays, last.arrays), (first.time, last.time)
    heading = "last frame" if frames.missing else "end"
    return start_and_end(states, times, frames.scene, heading, look, (first.measures, last.measures))


def mark_missing(figure: Figure, frames: Frames) -> Figure:
    """Return the figure; if the run has not reached its end, a note about missing frames is added below
    it."""
    if frames.missing:
        figure.supxlabel(frames.missing, fontsize=10, color=AXIS_COLOURS[1])
    return figure


def quantities(frames: Frames) -> Figure:
    """Draw kinetic energy, centre of gravity and number of particles against time; raise InputError for fewer
    than 2 frames.

    In a periodic domain the centre of gravity jumps when particles cross a face, so its velocity is drawn
    instead; in a sheared box velocities are relative to the flow. A constant number of particles is written
    in the title.
    """
    must(
        len(frames) > 1,
        "file",
        "one with 2 frames or more to draw against time",
        Words(f"{len(frames)} frames"),
    )
    series = history(frames)
    changes = bool(np.ptp(series.number))
    figure = empty(7.2, 7.6 if changes else 5.6, pad=0.08)
    energy, centre, *more = axes = figure.subplots(3 if changes else 2, 1, sharex=True)
    # Mark frames with dots if there are few; dots at the edges are not clipped.
    dots = {"marker": "o", "markersize": 3, "clip_on": False} if len(series.time) <= 60 else {}
    energy.plot(series.time, series.kinetic_energy, color=AXIS_COLOURS[0], **dots)
    if scale_of(series.kinetic_energy[series.kinetic_energy > 0]) == "log":
        # Zero energy of a start at rest cannot be shown on a logarithmic axis.
        energy.set_yscale("log", nonpositive="mask")
    else:
        energy.set_ylim(0, 1.08 * series.kinetic_energy.max() or 1.0)
    relative = ", relative\nto the flow" if frames.scene.domain.shears() else ""
    quantity(energy.yaxis, f"kinetic energy{relative}", "J")
    jumps = any(frames.scene.domain.joined())
    for k, (name, colour) in enumerate(zip("xyz", AXIS_COLOURS, strict=True)):
        values = (series.drift if jumps else series.shift)[:, k]
        # Dashes keep a line below visible.
        centre.plot(series.time, values, "--" if name == "z" else "-", color=colour, label=name, **dots)
    what = ("velocity", "m/s") if jumps else ("shift", "m")
    quantity(centre.yaxis, f"{what[0]} of the\ncentre of gravity{relative}", what[1])
    legend_above(centre)
    for axis in more:
        axis.step(series.time, series.number, where="post", color=AXIS_COLOURS[0])
        axis.set_ylabel("number of particles")
        axis.yaxis.set_major_locator(MaxNLocator(5, integer=True, steps=[1, 2, 5, 10]))
        axis.set_ylim(0, 1.08 * series.number.max())
    if not changes:
        number = int(series.number[0])
        figure.suptitle(f"{number} particle{'s' * (number != 1)} throughout", fontsize=10)
    axes[-1].set_xlim(series.time[0], series.time[-1])
    quantity(axes[-1].xaxis, "time", "s")
    for axis in axes:
        plain(axis)
    letters(axes)
    figure.align_ylabels()
    return figure
