"""The figure of the blast at rest: Stokes drag and a field leave a stationary ellipsoid (Z16 3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim import Recording, Result, run
from tisim.cases.blast import scene as blast
from tisim.cases.blast.closed_forms import displacement
from tisim.cases.blast.shape import AGES, extents, half_axes
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.common.runs import sound
from tisim.engine.batches import Progress
from tisim.io.reader import frames
from tisim.plotting.style import AXIS_COLOURS, empty, letters, plain

W_TAU = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
"""The values of w tau of the clouds at rest."""
SPIRALS = (0.5, 1.0, 2.0, 4.0)
"""The values of w tau of the paths that are drawn."""
RUN = "o"
EXACT: dict[str, Any] = {"ls": ":", "color": "k", "lw": 1.3}
"""The marker of runs, and the line of closed forms."""


@dataclass(frozen=True)
class Growth:
    """A cloud that comes to rest, in the size "rest", at times (s, (frames,)).

    axes : half axes, m, (frames, 3). path : displacement across the field of the particle that starts fastest
    across it, as a complex number (1 along its first velocity) over its first speed across times tau,
    (frames,).
    """

    time: np.ndarray
    axes: np.ndarray
    path: np.ndarray


def flux_of(w_tau: float) -> float:
    """Return the field that gives w tau in the fluid of the size "rest", T."""
    return w_tau / blast.TAU / blast.SPECIFIC_CHARGE


def growth(number: int, progress: Progress | None = None) -> Growth:
    """Run the size "rest" with a number of particles, and return the growth of its cloud."""
    scene = blast.scene(number=number, flux=blast.REST_FLUX, **blast.REST)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "trajectory.h5"
        sound([run(scene, progress, Recording(path, frames=40))])
        with frames(path) as trajectory:
            states = [frame.arrays for frame in trajectory]
            times = trajectory.times
    across = states[0]["velocity"][:, 1] + 1j * states[0]["velocity"][:, 2]
    k = int(np.abs(across).argmax())
    places = np.array([state["position"][k, 1] + 1j * state["position"][k, 2] for state in states])
    path = (places - places[0]) / (across[k] * blast.TAU)
    return Growth(times, np.array([half_axes(state) for state in states]), path)


def rested(number: int, progress: Progress | None = None) -> list[Result]:
    """Return the results of clouds at rest for W_TAU, all from the same start."""
    return sound(run([blast.scene(flux_of(x), number=number, **blast.REST) for x in W_TAU], progress))


def turn(result: Result) -> float:
    """Return the mean angle (radians) by which displacements across B are turned clockwise from the velocity
    at the start, weighted by their products."""
    moved = result.state["position"] - result.start["position"]
    (shift, speed) = (a[:, 1] + 1j * a[:, 2] for a in (moved, result.start["velocity"]))
    return float(-np.angle((shift * speed.conj()).sum()))


def rest_figure(cloud: Growth, clouds: Sequence[Result]) -> Figure:
    """Draw the growth of a cloud to rest, the half axes and the turn at rest against w tau, and paths."""
    figure = empty(10.4, 8.0)
    (left, right), (below, paths) = figure.subplots(2, 2)
    grow(left, cloud)
    shapes(right, clouds)
    x = np.linspace(0.0, max(W_TAU), 300)
    turned = np.degrees([turn(result) for result in clouds])
    below.plot(W_TAU, turned, RUN, color=AXIS_COLOURS[0], label="as run")
    below.plot(x, np.degrees(np.arctan(x)), **EXACT, label=r"arctan $\omega\tau$")
    below.set(xlabel=r"$\omega\tau$", ylabel="degrees", ylim=(-3, 93))
    below.set_title("turn of displacements across the field, at rest")
    spirals(paths, cloud)
    for axis in (left, right, below):
        axis.legend(frameon=False, fontsize=8)
    for axis in (left, right, below, paths):
        plain(axis)
    letters((left, right, below, paths))
    return figure


def grow(axis: Axes, cloud: Growth) -> None:
    """Draw half axes over time, with their closed form."""
    for k, colour in enumerate(AXIS_COLOURS):
        axis.plot(cloud.time, cloud.axes[:, k], RUN, ms=4, mfc="none", color=colour, label="xyz"[k])
    time = np.linspace(0.0, cloud.time[-1], 300)
    w = blast.SPECIFIC_CHARGE * blast.REST_FLUX
    for moment, label in zip(
        extents(w, time, float(cloud.axes[0].mean()), blast.TAU), ("closed form", None), strict=True
    ):
        axis.plot(time, np.sqrt(5 * moment), **EXACT, label=label)
    axis.set(xlabel="time (s)", ylabel="half axes of the cloud (m)", ylim=(0, None))
    axis.set_title(rf"growth to rest, field along x, $\omega\tau$ = {w * blast.TAU:g}")


def shapes(axis: Axes, clouds: Sequence[Result]) -> None:
    """Draw half axes at rest along and across the field against w tau, with their closed form."""
    axes = np.array([half_axes(result.state) for result in clouds])
    across = np.sqrt((axes[:, 1:] ** 2).mean(axis=1))
    start = float(half_axes(clouds[0].start).mean())
    x = np.linspace(0.0, max(W_TAU), 300)
    along_exact, across_exact = extents(x / blast.TAU, AGES * blast.TAU, start, blast.TAU)
    for values, exact, colour, label in (
        (axes[:, 0], along_exact, AXIS_COLOURS[0], "along the field"),
        (across, across_exact, AXIS_COLOURS[1], "across"),
    ):
        axis.plot(W_TAU, values, RUN, color=colour, label=label)
        axis.plot(x, np.sqrt(5 * exact) * np.ones_like(x), **EXACT)
    axis.axhline(start, color="0.6", lw=0.8, label="at the start")
    axis.set(xlabel=r"$\omega\tau$", ylabel="half axes of the cloud (m)", ylim=(0, None))
    axis.set_title("half axes at rest")


def spirals(axis: Axes, cloud: Growth) -> None:
    """Draw paths across the field in closed form, in units of v tau, with the places of rest, and a path of a
    run.

    The places of rest for all fields are on a half circle, 1/(1 + i w tau).
    """
    time = np.linspace(0.0, 12.0, 2000)
    for w_tau, colour in zip(SPIRALS, ("#4477aa", "#cc6677", "#228833", "#aa7733"), strict=True):
        path = displacement(time, 1.0, 1.0, w_tau)
        axis.plot(path.real, path.imag, color=colour, lw=1.4, label=rf"$\omega\tau$ = {w_tau:g}")
        axis.plot(path.real[-1], path.imag[-1], RUN, color=colour)
    ends = 1 / (1 + 1j * np.geomspace(1e-3, 1e3, 400))
    axis.plot(ends.real, ends.imag, **EXACT, label="places of rest for all fields")
    axis.plot(cloud.path.real, cloud.path.imag, RUN, ms=4, mfc="none", color="k", label="as run, of (a)")
    axis.set(xlabel=r"displacement along the first velocity over $v\tau$", ylabel=r"across it, over $v\tau$")
    axis.set(aspect="equal", ylim=(-0.62, 0.06))
    axis.set_title("paths of one particle across the field")
    axis.legend(frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3)


def rest_table(clouds: Sequence[Result]) -> str:
    """Return the half axes and the turn of clouds at rest, and their closed forms, as CSV."""
    rows: list[list[object]] = [
        ["w_tau", "half_axis_x_m", "half_axis_y_m", "half_axis_z_m", "closed_form_along_m",
         "closed_form_across_m", "turn_rad", "closed_form_turn_rad"],
    ]  # fmt: skip
    for w_tau, result in zip(W_TAU, clouds, strict=True):
        start = float(half_axes(result.start).mean())
        exact = extents(w_tau / blast.TAU, AGES * blast.TAU, start, blast.TAU)
        axes = half_axes(result.state).tolist()
        closed = [float(np.sqrt(5 * moment)) for moment in exact]
        rows.append([w_tau, *axes, *closed, turn(result), float(np.arctan(w_tau))])
    return csv_text(rows)
