"""Draw-down tests of grains that differ in one property, and of silos with other outlets, as one batch.

The rate of discharge is held against Beverloo's law, W = C rho_b sqrt(g) (D - k d)^(5/2), by a straight line
through W^(2/5): its slope has C and where it meets 0 has k.
"""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.constants import g as STANDARD_GRAVITY

from cases.granular_bench.measures import discharge, heap, repose
from cases.granular_bench.scene import DENSITY, DIAMETER, NATURAL, scene
from cases.runs import sound
from tisim import Result, run
from tisim.engine.batches import Progress
from tisim.plotting.cloud import common, corners, panel, walls_at
from tisim.plotting.style import empty, letters, plain

VALUES = {
    "friction": (0.1, 0.3, 0.5, 0.8),
    "rolling_friction": (0.0, 0.1, 0.2, 0.4),
    "restitution": (0.3, 0.5, 0.8),
    "seed": (0, 1, 2),
    "outlet": (5.0, 6.0, 7.0, 8.0, 9.0),
}
"""What is varied alone: of NATURAL, the random start, and the outlet of the silo in diameters of a grain."""
SHOWN = (("rolling_friction", 0.0), ("rolling_friction", 0.2), ("rolling_friction", 0.4))
"""These are drawn as they lie."""
PACKED = 0.6
"""The part of the space that grains in the silo fill, for the bulk density in Beverloo's law."""
COLOURS = ("#4477aa", "#cc6677", "#228833")


@dataclass(frozen=True)
class Bed:
    """A bed has what was varied and to what, and its result."""

    what: str
    value: float
    result: Result

    @property
    def angle(self) -> float:
        """Return the angle of repose, degrees."""
        return repose(self.result)

    @property
    def rate(self) -> float:
        """Return the discharge rate, kg/s."""
        return discharge(self.result)


def beds(progress: Progress, size: Mapping[str, Any]) -> list[Bed]:
    """Run the beds of VALUES as one batch, those that are alike once."""
    wanted = [(what, value) for what, values in VALUES.items() for value in values]
    scenes = [
        scene({**NATURAL, what: value}, **size) if what in NATURAL else scene(**{**size, what: value})
        for what, value in wanted
    ]
    digests = [one.digest() for one in scenes]
    different = dict(zip(digests, scenes, strict=True))
    found = sound(run(list(different.values()), progress))
    results = dict(zip(different, found, strict=True))
    return [Bed(*one, results[digest]) for one, digest in zip(wanted, digests, strict=True)]


def beverloo_fit(outlets: np.ndarray, rates: np.ndarray) -> tuple[float, float]:
    """Return C and k of Beverloo's law for outlets (in diameters) and rates (kg/s), by least squares."""
    slope, offset = np.polyfit(outlets * DIAMETER, rates**0.4, 1)
    constant = slope**2.5 / (PACKED * DENSITY * np.sqrt(STANDARD_GRAVITY))
    return float(constant), float(-offset / slope / DIAMETER)


def bed_figure(found: Sequence[Bed]) -> Figure:
    """Draw three heaps, what angle and rate depend on, and Beverloo's law."""
    figure = empty(11.6, 7.2)
    (first, second, angles), (third, rates, law) = figure.subplots(2, 3)
    chosen = [next(one for one in found if (one.what, one.value) == key) for key in SHOWN]
    states = [one.result.state for one in chosen]
    walls = [walls_at(one.result.scene, states, one.result.time) for one in chosen]
    # No box: the silo stands in open space.
    square = common(states, np.vstack([corners(None, None), *itertools.chain(*walls)]))
    for axis, one, lines in zip((first, second, third), chosen, walls, strict=True):
        panel(axis, one.result.state, square, corners(None, None), walls=lines)
        angle = "no heap" if np.isnan(one.angle) else f"{one.angle:.0f} degrees"
        axis.set_title(f"{one.what.replace('_', ' ')} {one.value:g}: {angle}")
    for k, what in enumerate(NATURAL):
        group = [one for one in found if one.what == what]
        values = [one.value for one in group]
        for axis, numbers in ((angles, [one.angle for one in group]), (rates, [one.rate for one in group])):
            axis.plot(values, numbers, "os^"[k] + "-", ms=5, color=COLOURS[k], label=what.replace("_", " "))
            axis.set_xlabel("coefficient, the others as usual")
            axis.legend(frameon=False, fontsize=8)
    angles.set(ylabel="angle of repose (degrees)", title="angle of repose")
    rates.set(ylabel="discharge rate (kg/s)", title="discharge rate")
    beverloo(law, [one for one in found if one.what == "outlet"])
    for axis in (angles, rates, law):
        plain(axis)
    letters((first, second, angles, third, rates, law))
    return figure


def beverloo(axis: Axes, found: Sequence[Bed]) -> None:
    """Draw the rate to the power 2/5 by the outlet, and the line of Beverloo's law."""
    outlets, rates = np.array([one.value for one in found]), np.array([one.rate for one in found])
    # An arch has closed those that nothing flows through.
    flows = rates > 0
    constant, empty_part = beverloo_fit(outlets[flows], rates[flows])
    line = np.linspace(empty_part, outlets.max(), 50)
    bulk = PACKED * DENSITY
    free = np.maximum((line - empty_part) * DIAMETER, 0.0)
    rate = constant * bulk * np.sqrt(STANDARD_GRAVITY) * free**2.5
    label = f"Beverloo, C = {constant:.2f}, k = {empty_part:.2f}"
    axis.plot(line, rate**0.4, color="0.2", lw=1.0, label=label)
    axis.plot(outlets, rates**0.4, "o", ms=6, mfc="none", color=COLOURS[0], label="as run")
    axis.set(xlabel="outlet (diameters of a grain)", ylabel=r"rate$^{2/5}$ ((kg/s)$^{2/5}$)",
             title="Beverloo's law")  # fmt: skip
    axis.legend(frameon=False, fontsize=8)


def table(found: Sequence[Bed]) -> str:
    """Return what was varied, the angle of repose and the discharge rate as CSV."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(
        ["varied", "value", "angle_of_repose_degrees", "discharge_rate_kg_s", "grains_of_the_heap"]
    )
    for one in found:
        writer.writerow([one.what, one.value, one.angle, one.rate, int(heap(one.result).sum())])
    return text.getvalue()
