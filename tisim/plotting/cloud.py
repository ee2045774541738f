"""A picture of a cloud: its start and end at the same scale, with grains as shaded spheres, and walls."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure

from tisim.effects.external.gravity import Gravity
from tisim.engine.result import Result
from tisim.plotting.facets import LIGHT, PROJECTION, draw_shapes, shapes_of
from tisim.plotting.style import empty, letters, si
from tisim.plotting.walls import outlines
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.shapes.particle_shape import ParticleShape

PIXELS = 1400
"""Width of a panel in pixels, twice the width that is shown, to smooth edges."""
SMALLEST = 4.0
"""Smallest radius of a grain in these pixels, so that it is visible."""
GRAIN_COLOUR = (0.36, 0.55, 0.73)
"""Colour of grains without a temperature: red, green and blue, 0..1."""
WALL_COLOUR = "0.55"
"""Grey level of wall outlines, which are drawn behind grains."""
GRAVITY_COLOUR = "#b3413e"
"""Colour of the arrow of gravity."""
# The black end is left out, because cold grains would show neither shading nor edges.
HEAT = ListedColormap(colormaps["inferno"](np.linspace(0.17, 0.97, 256)))


def cloud(result: Result) -> Figure:
    """Draw start and end of a run side by side, as ``start_and_end`` does."""
    return start_and_end((result.start, result.state), (0.0, result.time), result.scene)


def start_and_end(
    states: tuple[Arrays, Arrays], times: tuple[float, float], scene: Scene, last: str = "end"
) -> Figure:
    """Draw two states (at times in s) side by side at the same scale, in a projection without perspective.

    last : title of the second.

    Grains are coloured by temperature if they have one. Very small grains are drawn as dots. Walls are drawn
    as outlines, at their positions at the given time.
    """
    figure = empty(10.4, 5.0, pad=0.1)
    axes = figure.subplots(1, 2)
    norm = temperatures(states)
    box = corners(*scene.domain.bounds())
    walls = [walls_at(scene, states, time) for time in times]
    square = common(states, np.vstack([box, *itertools.chain(*walls)]))
    for axis, state, heading, time, lines in zip(axes, states, ("start", last), times, walls, strict=True):
        panel(axis, state, square, box, heat_colours(state, norm), lines, shapes_of(scene))
        directions(axis, square, gravity(scene))
        axis.set_title(f"{heading}, {caption(state, time, scene)}")
    letters(axes)
    if norm is not None:
        scale(figure, axes, norm)
    return figure


def caption(state: Arrays, time: float, scene: Scene) -> str:
    """Return a caption with the time (s), and the number and mean radius of the grains; of bodies that are
    not spheres, it is the radius of the bounding sphere."""
    n = len(state["radius"])
    one, several, name = "grain", "grains", "radius"
    if shapes_of(scene):
        one, several, name = "body", "bodies", "bounding radius"
    size = f", mean {name} {si(float(state['radius'].mean()), 'm')}" if n else ""
    return f"t = {si(time, 's')}: {n} {one if n == 1 else several}{size}"


def scale(figure: Figure, beside: Any, norm: Normalize, place: Axes | None = None) -> None:
    """Draw the colour bar: beside axes, or in given axes."""
    at = {"ax": beside, "shrink": 0.72, "pad": 0.01} if place is None else {"cax": place}
    bar = figure.colorbar(ScalarMappable(norm, HEAT), **at)
    bar.set_label("temperature (K)")
    bar.outline.set_visible(False)


def temperatures(states: Sequence[Arrays]) -> Normalize | None:
    """Return the temperature scale over all states, logarithmic for a wide range; None if a state has no
    temperature."""
    some = [state for state in states if len(state["radius"])]
    if not some or any("temperature" not in state for state in some):
        return None
    values = np.concatenate([state["temperature"] for state in some])
    low, high = float(values.min()), float(values.max())
    if low > 0 and high > 20 * low:
        return LogNorm(low, high)
    # A scale finer than a hundredth would exaggerate negligible differences.
    least = max(0.01 * abs(low), 1e-9) / 2
    middle = (low + high) / 2
    return Normalize(min(low, middle - least), max(high, middle + least))


def heat_colours(state: Arrays, norm: Normalize | None) -> np.ndarray | None:
    """Return the colour of each grain by its temperature, red, green and blue, shape (n, 3); None without a
    scale."""
    return None if norm is None or not len(state["radius"]) else HEAT(norm(state["temperature"]))[:, :3]


def project(points: np.ndarray) -> np.ndarray:
    """Return the coordinates right, up and towards the viewer of points (m), shape (n, 3)."""
    return np.asarray(points) @ PROJECTION


def corners(low: np.ndarray | None, high: np.ndarray | None) -> np.ndarray:
    """Return the projected corners of the box (m), shape (8, 3); empty in open space."""
    if low is None or high is None:
        return np.empty((0, 3))
    return project(np.array(list(itertools.product(*zip(low, high, strict=True)))))


def walls_at(scene: Scene, states: Sequence[Arrays], time: float) -> list[np.ndarray]:
    """Return the projected outlines of the walls at a time (s), m; planes are cut around the grains of all
    states."""
    place, size = (np.concatenate([state[name] for state in states]) for name in ("position", "radius"))
    if not len(size):
        return []
    low, high = (place - size[:, None]).min(axis=0), (place + size[:, None]).max(axis=0)
    return [project(line) for line in outlines(scene, time, low, high, PROJECTION[:, 2])]


def common(states: Sequence[Arrays], box: np.ndarray) -> tuple[float, float, float]:
    """Return a ``view`` that contains all states."""
    both = {name: np.concatenate([state[name] for state in states]) for name in ("position", "radius")}
    return view(both, box)


def view(state: Arrays, box: np.ndarray) -> tuple[float, float, float]:
    """Return left, bottom and side (m) of a square that contains all grains and the box; of side 1 m if there
    are none."""
    if not len(state["radius"]) and not len(box):
        return -0.5, -0.5, 1.0
    projected, radius = project(state["position"]), state["radius"][:, None]
    low = np.vstack([projected - radius, box]).min(axis=0)[:2]
    high = np.vstack([projected + radius, box]).max(axis=0)[:2]
    side = 1.06 * float((high - low).max())
    left, bottom = (low + high) / 2 - side / 2
    return float(left), float(bottom), side


def panel(
    axis: Axes, state: Arrays, square: tuple[float, float, float], box: np.ndarray,
    colour: np.ndarray | None = None, walls: Sequence[np.ndarray] = (),
    shapes: Sequence[ParticleShape] = (),
) -> None:  # fmt: skip
    """Draw a state in a square from ``view``, with a box from ``corners`` and lines from ``walls_at``.

    colour : red, green and blue of each grain, shape (n, 3); the same for all by default. shapes : of the
    particles; empty for spheres.
    """
    left, bottom, side = square
    if colour is None:
        colour = np.tile(GRAIN_COLOUR, (len(state["radius"]), 1))
    if shapes:
        draw_shapes(axis, state, shapes, colour)
        axis.set_aspect("equal")
    else:
        image = _draw(project(state["position"]) - (left, bottom, 0.0), state["radius"], colour, side)
        axis.imshow(image, extent=(left, left + side, bottom, bottom + side), origin="lower", zorder=2)
    if len(box):
        _edges(axis, box)
    for line in walls:
        axis.plot(*line[:, :2].T, color=WALL_COLOUR, lw=0.8, zorder=1)
    _scale_bar(axis, left, bottom, side)
    axis.set_xlim(left, left + side)
    axis.set_ylim(bottom, bottom + side)
    axis.set_axis_off()


def gravity(scene: Scene) -> np.ndarray:
    """Return the sum of the accelerations of gravity in a scene, m/s^2; 0 if there are none."""
    accelerations = [effect.acceleration for effect in scene.effects if isinstance(effect, Gravity)]
    return np.sum([(0.0, 0.0, 0.0), *accelerations], axis=0)


def directions(axis: Axes, square: tuple[float, float, float], fall: np.ndarray, share: float = 0.07) -> None:
    """Draw the coordinate axes in the lower right of a panel, and the direction of gravity if there is any.

    share : length of an arrow relative to the side of the panel.
    """
    left, bottom, side = square
    length = share * side
    origin = np.array([left + side - 1.7 * length, bottom + (1.6 if fall.any() else 0.5) * length])
    ends = [(name, end, "0.35") for name, end in zip("xyz", np.eye(3), strict=True)]
    if fall.any():
        ends.append(("g", fall / np.linalg.norm(fall), GRAVITY_COLOUR))
    for name, end, colour in ends:
        x, y = origin + length * (end @ PROJECTION)[:2]
        arrow = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
        axis.annotate("", (x, y), (origin[0], origin[1]), arrowprops=arrow, zorder=4)
        x, y = origin + 1.3 * length * (end @ PROJECTION)[:2]
        axis.text(x, y, name, color=colour, fontsize=9, ha="center", va="center", zorder=4)


def _draw(projected: np.ndarray, radius: np.ndarray, colour: np.ndarray, side: float) -> np.ndarray:
    """Return an image of shaded spheres with hidden surfaces removed, RGBA, shape (PIXELS / 2, PIXELS / 2,
    4)."""
    scale = PIXELS / side
    depth = np.full((PIXELS, PIXELS), -np.inf)
    image = np.zeros((PIXELS, PIXELS, 4))
    for (x, y, z), r, rgb in zip(
        projected * scale, np.maximum(radius * scale, SMALLEST), colour, strict=True
    ):
        # A grain outside of the square has an empty range of pixels.
        (i0, i1), (j0, j1) = (np.clip([int(a - r), int(a + r) + 2], 0, PIXELS) for a in (y, x))
        v, u = np.mgrid[i0:i1, j0:j1] + 0.5
        u, v = (u - x) / r, (v - y) / r
        w2 = 1.0 - u * u - v * v
        w = np.sqrt(np.maximum(w2, 0.0))
        front = (w2 > 0) & (z + r * w > depth[i0:i1, j0:j1])
        depth[i0:i1, j0:j1][front] = (z + r * w)[front]
        lit = np.clip(u * LIGHT[0] + v * LIGHT[1] + w * LIGHT[2], 0.0, 1.0)[..., None]
        # Dark grains keep a visible outline; the highlight distinguishes a sphere from a disc.
        shade = np.clip((0.42 + 0.58 * lit) * (0.1 + 0.9 * rgb) + 0.35 * lit**24, 0.0, 1.0)
        image[i0:i1, j0:j1, :3][front] = shade[front]
        image[i0:i1, j0:j1, 3][front] = 1.0
    half = image.reshape(PIXELS // 2, 2, PIXELS // 2, 2, 4)
    covered = half[..., 3:].sum(axis=(1, 3))
    rgb = (half[..., :3] * half[..., 3:]).sum(axis=(1, 3)) / np.maximum(covered, 1.0)
    return np.concatenate([rgb, covered / 4], axis=2)


def _edges(axis: Axes, corners: np.ndarray) -> None:
    """Draw the twelve edges of the box; the three at its farthest corner are behind the grains."""
    farthest = int(np.argmin(corners[:, 2]))
    for a, b in itertools.combinations(range(8), 2):
        if bin(a ^ b).count("1") == 1:
            behind = farthest in (a, b)
            axis.plot(
                *corners[[a, b], :2].T, color="0.72" if behind else "0.45", lw=0.8, zorder=1 if behind else 3
            )


def _scale_bar(axis: Axes, left: float, bottom: float, side: float) -> None:
    power = 10.0 ** np.floor(np.log10(side / 4))
    length = power * max(k for k in (1, 2, 5) if k * power <= side / 4)
    x, y = left + 0.02 * side, bottom + 0.015 * side
    axis.plot([x, x + length], [y, y], color="0.2", lw=2, solid_capstyle="butt", zorder=4)
    axis.text(x + length / 2, y + 0.012 * side, si(length, "m"), ha="center", fontsize=9, zorder=4)
