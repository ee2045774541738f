"""Pictures of a run of packed_filter: the fibres, the streamlines and the places of captures, and the course
of the run."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from tisim import Result, Scene
from tisim.cases.packed_filter.measures import matrix_box
from tisim.io.reader import Frames
from tisim.plotting.field_lines import follow
from tisim.plotting.image import draw_solids
from tisim.plotting.style import TIME, empty, letters, plain
from tisim.rendering.solids import DrawnCylinders, DrawnRods, DrawnSpheres
from tisim.sources import FieldSampler, MagneticCylinders
from tisim.sources.base import Source

STREAMLINES = 5
"""Streamlines along each side of the cross section."""
LINE_STEP = 0.25
"""Length of a piece of a streamline, D."""
THIN, DOT = 0.06, 0.2
"""Diameters of streamlines and of captured colloids in pictures, D."""
FLOW = "flow_velocity"
STEEL, WATER = (0.82, 0.83, 0.85), (0.35, 0.62, 0.85)
"""Colours of fibres and streamlines."""


def pictures(frames: Frames) -> Mapping[str, Figure]:
    """filter.png: the fibres, the streamlines and the captured colloids in the last frame in which most are
    captured, and the course of the run."""
    every = list(frames)
    most = max(every, key=lambda frame: (int((frame.arrays["captured_by"] >= 0).sum()), frame.time))
    figure = empty(9.8, 5.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.1))
    draw_filter(figure, left, frames.scene, most.arrays, most.time)
    course(right, [frame.arrays for frame in every], np.asarray(frames.times))
    letters((left, right))
    return {"filter.png": figure}


def caught(result: Result) -> Figure:
    """Draw the filter of a run with the colloids captured at its end."""
    figure = empty(6.4, 5.6)
    draw_filter(figure, figure.subplots(), result.scene, result.state, result.time)
    return figure


def draw_filter(
    figure: Figure, axis: Axes, scene: Scene, state: Mapping[str, np.ndarray], end: float
) -> None:
    """Draw the fibres of the matrix, streamlines, and the captured colloids, coloured by the time of their
    capture."""
    low, high = matrix_box(scene)
    magnets = next(one for one in scene.effects if isinstance(one, MagneticCylinders)).cylinders
    centre = np.array([one.centre for one in magnets])
    held = state["captured_by"] >= 0
    # Images of fibres are drawn if they hold colloids.
    own = np.all((centre >= low) & (centre <= high), axis=1)
    own[state["captured_by"][held]] = True
    fibres = [one for k, one in enumerate(magnets) if own[k]]
    latest = state["captured_at"].max(initial=0.0)
    unit, norm = 2 * fibres[0].radius, Normalize(0.0, latest if latest > 0 else end)
    lines = streamlines(scene, unit)
    middle, along = (lines[1:] + lines[:-1]) / 2, lines[1:] - lines[:-1]
    length = np.linalg.norm(along, axis=-1).ravel()
    solids = (
        DrawnCylinders(
            centre=centre[own], colour=np.tile(STEEL, (len(fibres), 1)),
            axis=np.array([one.direction for one in fibres]),
            half=np.array([one.length / 2 for one in fibres]), radius=np.full(len(fibres), unit / 2),
        ),
        DrawnRods(
            centre=middle.reshape(-1, 3), colour=np.tile(WATER, (length.size, 1)),
            axis=along.reshape(-1, 3) / np.maximum(length, 1e-300)[:, None], half=length / 2,
            radius=np.full(length.size, THIN * unit / 2),
        ),
        DrawnSpheres(
            centre=state["position"][held], colour=TIME(norm(state["captured_at"][held]))[:, :3],
            radius=np.full(held.sum(), DOT * unit / 2),
        ),
    )  # fmt: skip
    draw_solids(axis, solids)
    axis.set_title(f"{held.sum()} of {len(held)} colloids are captured at {end:.3g} s", fontsize=10)
    figure.colorbar(ScalarMappable(norm, TIME), ax=axis, shrink=0.6, label="time of capture (s)")


def streamlines(scene: Scene, unit: float) -> np.ndarray:
    """Return points (m) of the streamlines in front of the matrix and through it, shape (points, lines, 3);
    no line without a flow. unit : D, m."""
    low, high = matrix_box(scene)
    if not any(isinstance(one, Source) and one.quantity == FLOW for one in scene.effects):
        return np.empty((1, 0, 3))
    side = (np.arange(STREAMLINES) + 0.5) / STREAMLINES
    x, y = np.meshgrid(low[0] + side * (high - low)[0], low[1] + side * (high - low)[1])
    place = np.stack([x.ravel(), y.ravel(), np.full(x.size, low[2] - 2 * unit)], axis=1)
    step = LINE_STEP * unit
    count = int((high[2] - low[2] + 4 * unit) / step * 1.3)
    with FieldSampler(scene.effects, FLOW) as flow:
        # Nothing flows outside a tube.
        some = place[flow(place)[0].any(axis=1)]
        return follow(lambda points: flow(points)[0], some, step, count)


def course(axis: Axes, states: list[Mapping[str, np.ndarray]], times: np.ndarray) -> None:
    """Draw the numbers of colloids that are captured, free in the filter, and out of it."""
    number = len(states[0]["mass"])
    held = np.array([(one["captured_by"] >= 0).sum() for one in states]) / number
    out = np.array([(one.get("exited_at", np.full(number, -1.0)) >= 0).sum() for one in states]) / number
    entered = np.array([(one.get("entered_at", np.zeros(number)) >= 0).sum() for one in states]) / number
    for values, colour, name in (
        (entered, "0.6", "entered"),
        (held, "#882255", "captured"),
        (out, "#4477aa", "out"),
        (entered - held - out, "#228833", "free, inside"),
    ):
        axis.plot(times, values, color=colour, lw=1.5, label=name)
    axis.set(xlabel="time (s)", ylabel="fraction of all colloids", ylim=(-0.02, 1.02))
    axis.legend(frameon=False, fontsize=9)
    plain(axis)
