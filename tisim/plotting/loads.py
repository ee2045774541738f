"""Forces and torques on walls and driven groups against time, and the travel of servos."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.effects.walls.motion import resultant_units
from tisim.io.reader import Frames
from tisim.plotting.style import AXIS_COLOURS, empty, legend_above, letters, plain, quantity

FORCE_SUFFIX = "_force_x"
"""Suffix of one of the measures of each body."""


def bodies(frames: Frames) -> list[str]:
    """Return the names of the bodies with recorded forces, in alphabetical order; empty for fewer than 2
    frames."""
    measures = frames.measures
    names = [name.removesuffix(FORCE_SUFFIX) for name in measures if name.endswith(FORCE_SUFFIX)]
    return [name for name in names if len(frames) > 1 and resultant_units(name).keys() <= measures.keys()]


def loads(frames: Frames) -> Figure:
    """Draw force and torque of the particles on each of the ``bodies`` against time, and the travel of bodies
    with a servo."""
    names, series = bodies(frames), frames.measures
    driven = any(f"{name}_travel" in series for name in names)
    figure = empty(10.8 if driven else 7.2, 2.8 * len(names), pad=0.08)
    panels = figure.subplots(len(names), 2 + driven, sharex=True, squeeze=False)
    for name, (force, torque, *travel) in zip(names, panels, strict=True):
        for panel, what, unit in ((force, "force", "N"), (torque, "torque", "N m")):
            for axis, colour in zip("xyz", AXIS_COLOURS, strict=True):
                # Dashes keep a line below visible.
                dashes = "--" if axis == "z" else "-"
                _draw(panel, frames.times, series[f"{name}_{what}_{axis}"], dashes, color=colour, label=axis)
            quantity(panel.yaxis, f"{what} on {name}", unit)
        for panel in travel:
            if f"{name}_travel" in series:
                _draw(panel, frames.times, series[f"{name}_travel"], "-", color=AXIS_COLOURS[0])
                quantity(panel.yaxis, f"travel of {name}", "m")
            else:
                panel.set_axis_off()
    legend_above(panels[0, 0])
    drawn = [panel for panel in panels.flat if panel.axison]
    for panel in drawn:
        quantity(panel.xaxis, "time", "s")
        plain(panel)
    letters(drawn)
    figure.align_ylabels()
    return figure


def _draw(panel: Axes, time: np.ndarray, values: np.ndarray, line: str, **more: Any) -> None:
    panel.plot(time, values, line, **more)
    panel.set_xlim(time[0], time[-1])
