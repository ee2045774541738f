"""A picture of a cloud: its start and end at the same scale, with walls, magnets and the box."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.effects.external.gravity import Gravity
from tisim.engine.result import Result
from tisim.plotting.bodies import shapes_of, solids_of
from tisim.plotting.colours import colouring, plain_colours
from tisim.plotting.field_lines import FieldLines
from tisim.plotting.image import PIXELS, draw_solids
from tisim.plotting.look import USUAL, Look
from tisim.plotting.scenery import NO_SCENERY, Scenery, finite_grains, scenery, window
from tisim.plotting.style import empty, letters, si
from tisim.rendering.camera import USUAL_CAMERA, Camera, Window
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.shapes.particle_shape import ParticleShape

GRAVITY_COLOUR = "#b3413e"
"""Colour of the arrow of gravity."""
HALO: list[patheffects.AbstractPathEffect] = [
    patheffects.withStroke(linewidth=2.5, foreground="white", alpha=0.8)
]
"""White edges of texts and lines over a picture."""
NO_MEASURES: Mapping[str, float] = {}


def cloud(result: Result) -> Figure:
    """Draw start and end of a run side by side, as ``start_and_end`` does."""
    return start_and_end(
        (result.start, result.state), (0.0, result.time), result.scene,
        measures=(NO_MEASURES, result.measures),
    )  # fmt: skip


def start_and_end(
    states: tuple[Arrays, Arrays],
    times: tuple[float, float],
    scene: Scene,
    last: str = "end",
    look: Look = USUAL,
    measures: tuple[Mapping[str, float], Mapping[str, float]] = (NO_MEASURES, NO_MEASURES),
) -> Figure:
    """Draw two states (at times in s) side by side at the same scale, in a projection without perspective.

    last : title of the second. look : view, crop, cuts and colours. measures : of the world at both times.

    Grains are coloured by temperature if they have one, or by material if there are several, unless ``look``
    names another quantity. Very small grains are drawn as dots. Walls, magnets and fibres are drawn at their
    positions at the given time. Grains that leave the others do not make these smaller.
    """
    figure = empty(10.4, 5.0, pad=0.1)
    axes = figure.subplots(1, 2)
    colours = colouring(scene, states, look.colour)
    each = zip(states, times, measures, strict=True)
    beside = [scenery(scene, states, time, known, state) for state, time, known in each]
    part = window(states, beside, look)
    if look.lines is not None:
        with FieldLines(scene, look.lines) as field:
            pairs = zip(beside, states, times, strict=True)
            beside = [field.beside(around, state, time) for around, state, time in pairs]
    headings = "start", last
    for axis, state, heading, time, around in zip(axes, states, headings, times, beside, strict=True):
        tints = None if colours is None else colours.of(state)
        panel(axis, state, part, around, tints, shapes_of(scene), look)
        directions(axis, part, gravity(scene), camera=look.camera)
        axis.set_title(f"{heading}, {caption(state, time, scene)}")
    letters(axes)
    if colours is not None:
        colours.legend(figure, axes)
    return figure


def caption(state: Arrays, time: float, scene: Scene) -> str:
    """Return a caption with the time (s), and the number and mean radius of the grains; of bodies that are
    not spheres, it is the radius of the bounding sphere. Grains without a finite position are counted."""
    n, (place, radius) = len(state["radius"]), finite_grains(state)
    one, several, name = "grain", "grains", "radius"
    if shapes_of(scene):
        one, several, name = "body", "bodies", "bounding radius"
    size = f", mean {name} {si(float(radius.mean()), 'm')}" if len(radius) else ""
    lost = f", {n - len(place)} without a position" if len(place) < n else ""
    return f"t = {si(time, 's')}: {n} {one if n == 1 else several}{lost}{size}"


def panel(
    axis: Axes,
    state: Arrays,
    part: Window,
    around: Scenery = NO_SCENERY,
    colour: np.ndarray | None = None,
    shapes: Sequence[ParticleShape] = (),
    look: Look = USUAL,
    pixels: int = PIXELS,
) -> None:
    """Draw a state and its surroundings in a window, with a scale bar.

    colour : red, green and blue of each grain, shape (n, 3); the same for all by default. shapes : of the
        particles; empty for spheres. pixels : of the longer side.
    """
    tints = plain_colours(len(state["radius"])) if colour is None else colour
    solids = [*solids_of(state, shapes, tints), *around.solids]
    draw_solids(axis, solids, part, around.walls, around.edges, look.camera, look.clip, pixels)
    _scale_bar(axis, part)


def gravity(scene: Scene) -> np.ndarray:
    """Return the sum of the accelerations of gravity in a scene, m/s^2; 0 if there are none."""
    accelerations = [effect.acceleration for effect in scene.effects if isinstance(effect, Gravity)]
    return np.sum([(0.0, 0.0, 0.0), *accelerations], axis=0)


def directions(
    axis: Axes, part: Window, fall: np.ndarray, share: float = 0.07, camera: Camera = USUAL_CAMERA
) -> None:
    """Draw the coordinate axes in the lower right of a window, and the direction of gravity if there is any.

    fall : acceleration of gravity. share : length of an arrow relative to the shorter side of the window.
    """
    length = share * min(part.width, part.height)
    right = part.left + part.width
    origin = np.array([right - 1.7 * length, part.bottom + (1.6 if fall.any() else 0.5) * length])
    ends = [(name, end, "0.35") for name, end in zip("xyz", np.eye(3), strict=True)]
    if fall.any():
        ends.append(("g", fall / np.linalg.norm(fall), GRAVITY_COLOUR))
    for name, end, colour in ends:
        x, y = origin + length * camera.project(end)[:2]
        arrow = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
        axis.annotate("", (x, y), (origin[0], origin[1]), arrowprops=arrow, zorder=4)
        x, y = origin + 1.3 * length * camera.project(end)[:2]
        text = axis.text(x, y, name, color=colour, fontsize=9, ha="center", va="center", zorder=4)
        text.set_path_effects(HALO)


def _scale_bar(axis: Axes, part: Window) -> None:
    # A power of ten is not its own logarithm to the last bit.
    most = part.width / 4 * (1 + 1e-9)
    power = 10.0 ** np.floor(np.log10(most))
    length = power * max(k for k in (1, 2, 5) if k * power <= most)
    x, y = part.left + 0.02 * part.width, part.bottom + 0.015 * part.height
    line = axis.plot([x, x + length], [y, y], color="0.2", lw=2, solid_capstyle="butt", zorder=4)[0]
    middle, above = x + length / 2, y + 0.012 * part.height
    text = axis.text(middle, above, si(length, "m"), ha="center", fontsize=9, zorder=4)
    for drawn in (line, text):
        drawn.set_path_effects(HALO)
