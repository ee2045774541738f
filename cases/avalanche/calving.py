"""Pictures of an avalanche in motion; the colour of a grain shows the strip of the column in which it
started."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from tisim import Scene
from tisim.cases.avalanche.measures import diameter
from tisim.cases.avalanche.scene import time_unit
from tisim.effects import Translation, Walls
from tisim.io.reader import Frames
from tisim.plotting.style import empty, letters
from tisim.scene.initial_state import Arrays

AFTER = (0.0, 2.0, 4.0, 6.0, 10.0, 30.0)
"""Times of the pictures after the dividing wall is removed, in sqrt(d/g) (L21 Fig. 4.14)."""
STRIP = 3.0
"""Width of a strip of the column, in diameters."""
STRIP_COLOURS = ("#4477aa", "#ccbb44", "#228833", "#cc6677")
"""Colours of the strips, repeated in this order."""


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
    figure = empty(11.6, 5.4)
    axes = figure.subplots(2, 3, sharex=True, sharey=True).ravel()
    furthest = max(float(frame.arrays["position"][:, 0].max()) for frame in chosen) / d
    for axis, frame in zip(axes, chosen, strict=True):
        side_view(axis, frame.arrays, strips)
        axis.set(xlim=(0.0, furthest + 1.0), aspect="equal")
        axis.set_title(f"after {max(frame.time - begin, 0.0):.2g} s")
    for axis in axes[3:]:
        axis.set_xlabel("distance (diameters)")
    for axis in axes[::3]:
        axis.set_ylabel("height (diameters)")
    letters(axes)
    return {"calving.png": figure}


def strips_of(state: Arrays, d: float) -> dict[int, int]:
    """Return the strip of the column of each grain, by its id."""
    strip = (state["position"][:, 0] / (STRIP * d)).astype(int)
    return dict(zip(state["id"].tolist(), strip.tolist(), strict=True))


def side_view(axis: Axes, state: Arrays, strips: Mapping[int, int]) -> None:
    """Draw the grains as seen along the width of the cell, in the colours of their strips."""
    order = np.argsort(-state["position"][:, 1])
    place, size = (state[name][order] / diameter(state) for name in ("position", "radius"))
    colours = [STRIP_COLOURS[strips[k] % len(STRIP_COLOURS)] for k in state["id"][order].tolist()]
    grains = EllipseCollection(
        2 * size, 2 * size, np.zeros(len(size)), units="xy", offsets=place[:, [0, 2]],
        offset_transform=axis.transData, facecolors=colours, edgecolors="white", linewidths=0.3,
    )  # fmt: skip
    axis.add_collection(grains)
    axis.set_ylim(0.0, float(place[:, 2].max()) + 1.0)
