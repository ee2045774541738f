"""Standard pictures of a run's file: the cloud at its start and end, and quantities against time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tisim.errors import must
from tisim.io.reader import Frames
from tisim.plotting.cloud import start_and_end
from tisim.plotting.style import empty, legend_above, letters, plain, quantity

COLOURS = ("#4477aa", "#cc6677", "#228833")
"""For x, y and z; told apart by all (P. Tol's bright set)."""


@dataclass(frozen=True)
class TimeSeries:
    """What is drawn against time; a value for each frame.

    time : s. kinetic_energy : J. number : of particles.
    shift : of the centre of gravity from where it was at the start, m, shape (frames, 3).
    drift : velocity of the centre of gravity, m/s, shape (frames, 3).
    """

    time: np.ndarray
    kinetic_energy: np.ndarray
    shift: np.ndarray
    drift: np.ndarray
    number: np.ndarray


def history(found: Frames) -> TimeSeries:
    """Of all frames, each read once."""
    energy, centre, drift, number = [], [], [], []
    for frame in found:
        mass, velocity = frame.arrays["mass"].astype(float), frame.arrays["velocity"].astype(float)
        energy.append(0.5 * float((mass * (velocity**2).sum(axis=1)).sum()))
        centre.append(np.average(frame.arrays["position"], axis=0, weights=mass))
        drift.append(np.average(velocity, axis=0, weights=mass))
        number.append(len(mass))
    shift = np.array(centre) - centre[0]
    return TimeSeries(found.times, np.array(energy), shift, np.array(drift), np.array(number))


def clouds(found: Frames) -> Figure:
    """First and last frame side by side. InputError when there is none."""
    must(len(found) > 0, "file", "one with a frame", "one with none yet")
    first, last = found[0], found[-1]
    states, times = (first.arrays, last.arrays), (first.time, last.time)
    return start_and_end(states, times, found.scene, "last frame" if found.missing else "end")


def mark_missing(figure: Figure, found: Frames) -> Figure:
    """The figure, with what frames are missing below it where the run has not reached its end."""
    if found.missing:
        figure.supxlabel(found.missing, fontsize=10, color=COLOURS[1])
    return figure


def quantities(found: Frames) -> Figure:
    """Kinetic energy, centre of gravity and number of particles against time; InputError for under 2 frames.

    Where particles re-enter through opposite faces, the centre of gravity jumps with them; its velocity is
    drawn instead. A number of particles that stays the same is written above.
    """
    must(len(found) > 1, "file", "one with 2 frames or more to draw against time", f"{len(found)} frames")
    seen = history(found)
    changes = bool(np.ptp(seen.number))
    figure = empty(7.2, 7.6 if changes else 5.6, pad=0.08)
    energy, centre, *more = axes = figure.subplots(3 if changes else 2, 1, sharex=True)
    # A dot for each frame where the eye can tell them apart.
    dots = {"marker": "o", "markersize": 3} if len(seen.time) <= 60 else {}
    energy.plot(seen.time, seen.kinetic_energy, color=COLOURS[0], **dots)
    energy.set_ylim(0, 1.08 * seen.kinetic_energy.max() or 1.0)
    quantity(energy.yaxis, "kinetic energy", "J")
    jumps = found.scene.domain.joined()
    for k, (name, colour) in enumerate(zip("xyz", COLOURS, strict=True)):
        values = (seen.drift if jumps else seen.shift)[:, k]
        # Dashes, so that a line under the last one is seen.
        centre.plot(seen.time, values, "--" if name == "z" else "-", color=colour, label=name, **dots)
    what = ("velocity", "m/s") if jumps else ("shift", "m")
    quantity(centre.yaxis, f"{what[0]} of the\ncentre of gravity", what[1])
    legend_above(centre)
    for axis in more:
        axis.step(seen.time, seen.number, where="post", color=COLOURS[0])
        axis.set_ylabel("number of particles")
        axis.yaxis.set_major_locator(MaxNLocator(5, integer=True, steps=[1, 2, 5, 10]))
        axis.set_ylim(0, 1.08 * seen.number.max())
    if not changes:
        number = int(seen.number[0])
        figure.suptitle(f"{number} particle{'s' * (number != 1)} throughout", fontsize=10)
    axes[-1].set_xlim(seen.time[0], seen.time[-1])
    quantity(axes[-1].xaxis, "time", "s")
    for axis in axes:
        plain(axis)
    letters(axes)
    figure.align_ylabels()
    return figure
