"""Pictures of a run of packed_filter: the fibres, the streamlines and the places of captures, and the course
of the run."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from tisim import Result, Scene
from tisim.analysis import PackedBodies
from tisim.cases.packed_filter.measures import matrix_box
from tisim.io.reader import Frames
from tisim.plotting.bodies import draw_bodies
from tisim.plotting.style import TIME, empty, letters, plain
from tisim.shapes import SpherocylinderShape, SuperquadricShape
from tisim.sources import MagneticCylinders, sample
from tisim.sources.base import Source

STREAMLINES = 5
"""Streamlines along each side of the cross section."""
LINE_STEP = 0.25
"""Length of a piece of a streamline, D."""
THIN, DOT = 0.06, 0.2
"""Diameters of streamlines and of captured colloids in pictures, D."""
FLAT_ENDS = (2.0, 2.0, 20.0)
"""Exponents of the superquadric that a cylinder is drawn as."""
FLOW = "flow_velocity"
STEEL, WATER = (0.82, 0.83, 0.85), (0.35, 0.62, 0.85)
"""Colours of fibres and streamlines."""


def pictures(frames: Frames) -> Mapping[str, Figure]:
    """filter.png: the fibres, the streamlines and the captured colloids, and the course of the run."""
    last = frames[-1]
    figure = empty(11.0, 5.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
    draw_filter(figure, left, frames.scene, last.arrays, last.time)
    course(right, [frame.arrays for frame in frames], np.asarray(frames.times))
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
    shapes = (
        SuperquadricShape(semi_axes=(unit / 2, unit / 2, fibres[0].length / 2), exponents=FLAT_ENDS),
        SpherocylinderShape(length=LINE_STEP * unit, diameter=THIN * unit),
        SpherocylinderShape(length=0.0, diameter=DOT * unit),
    )
    groups = (
        (centre[own], np.array([one.direction for one in fibres]), np.tile(STEEL, (len(fibres), 1))),
        (middle.reshape(-1, 3), along.reshape(-1, 3), np.tile(WATER, (middle[..., 0].size, 1))),
        (
            state["position"][held],
            np.tile([0.0, 0.0, 1.0], (held.sum(), 1)),
            TIME(norm(state["captured_at"][held]))[:, :3],
        ),
    )
    place, axes, colours = (np.concatenate([group[k] for group in groups]) for k in range(3))
    packing = PackedBodies(
        position=place,
        orientation=turns_to(axes),
        shape=np.repeat([0, 1, 2], [len(group[0]) for group in groups]),
        scale=np.ones(len(place)),
        shapes=shapes,
        low=low,
        high=high,
        periodic=(False, False, False),
    )
    draw_bodies(axis, packing, colours)
    axis.set_title(f"{held.sum()} of {len(held)} colloids are captured", fontsize=10)
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
    points, step = [place], LINE_STEP * unit
    for _ in range(int((high[2] - low[2] + 4 * unit) / step * 1.3)):
        # The midpoint rule, with steps of equal length.
        half = points[-1] + 0.5 * step * _direction(scene, points[-1])
        points.append(points[-1] + step * _direction(scene, half))
    return np.array(points)


def _direction(scene: Scene, place: np.ndarray) -> np.ndarray:
    velocity, _ = sample(scene.effects, FLOW, place)
    return np.asarray(velocity / np.maximum(np.linalg.norm(velocity, axis=1), 1e-300)[:, None])


def turns_to(axes: np.ndarray) -> np.ndarray:
    """Return unit quaternions w, x, y, z that turn z to directions of any length, shape (n, 4)."""
    unit = axes / np.linalg.norm(axes, axis=1)[:, None]
    polar, azimuth = np.arccos(np.clip(unit[:, 2], -1, 1)), np.arctan2(unit[:, 1], unit[:, 0])
    turns = Rotation.from_euler("ZY", np.stack([azimuth, polar], axis=1))
    return np.asarray(turns.as_quat(scalar_first=True))


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
