"""The stages of an avalanche: grains settle, are magnetised, and run out when the dividing wall is removed.

Each stage is a batch of scenes, one for each avalanche, and ends when the grains are at rest. The next stage
begins from its final states. Avalanches of the same grain size and start share one settling run, because the
field is off while grains settle.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tisim import Result, run
from tisim.cases.avalanche.measures import grains_volume, heap_volume, repose, two_slopes
from tisim.cases.avalanche.scene import LATEST, Cell, scene
from tisim.cases.common.runs import overlap, sound
from tisim.engine.batches import Progress, progress_of_part
from tisim.scene.initial_state import Arrays


@dataclass(frozen=True)
class Slope:
    """The slope of a heap: angle of repose, degrees, and volume, m^3."""

    angle: float
    volume: float


SLOPES = {
    5e-3: (Slope(37.2209, 1.1602), Slope(50.4837, 1.2659)),
    1e-2: (Slope(32.4847, 1.4859), Slope(34.4926, 1.6097)),
    5e-2: (Slope(31.2953, 37.6239), Slope(31.4193, 38.1069)),
}
"""Slopes without a field and with one, by grain diameter, m. Only the ratio of the volumes is used: they are
larger than the volume of 1.2 m^3 of the cells, and larger than the volume of these numbers of grains at a
packing fraction of four tenths."""


def larger(diameter: float) -> float:
    """Return the ratio of the volumes of a heap with and without a field."""
    without, magnetised = SLOPES[diameter]
    return magnetised.volume / without.volume


@dataclass(frozen=True)
class Avalanche:
    """An avalanche: its settings and its states after each stage.

    cell : of the avalanche. diameter : of the grains, m. field : T. seed : of the start.
    settled, magnetised : states after the first and the second stage. end : result of the last stage.
    """

    cell: Cell
    diameter: float
    field: float
    seed: int
    settled: Arrays
    magnetised: Arrays
    end: Result

    @property
    def width(self) -> float:
        """Return the width of the cell, m."""
        return self.cell.width * self.diameter

    @property
    def angle(self) -> float:
        """Return the angle of repose, degrees."""
        return repose(self.end.state)

    @property
    def slopes(self) -> tuple[float, float]:
        """Return the angles of the upper and the lower part of the slope, degrees."""
        return two_slopes(self.end.state)

    @property
    def volume(self) -> float:
        """Return the volume of the heap divided by the volume of its grains."""
        return heap_volume(self.end.state, self.width) / grains_volume(self.end.state)

    @property
    def loosened(self) -> float:
        """Return the ratio of the column's volumes when magnetised and when settled."""
        return heap_volume(self.magnetised, self.width) / heap_volume(self.settled, self.width)

    @property
    def overlap(self) -> float:
        """Return the largest overlap at the end, divided by a radius."""
        return overlap(self.end)


Key = tuple[float, float, int]
"""Diameter (m), flux density (T), and seed."""


def avalanches(
    cell: Cell, wanted: Sequence[Key], progress: Progress = lambda part: None, **more: Any
) -> list[Avalanche]:
    """Run the avalanches of given diameters (m), flux densities (T) and seeds.

    progress : receives the completed fraction, 0..1. more : settings of all scenes. RunError if one fails.
    """

    def stage(number: int, begin: Mapping[Key, Arrays | None], opens: float | None) -> dict[Key, Result]:
        scenes = [
            scene(
                cell, diameter=d, field=field, seed=seed, state=state, opens=opens, duration=LATEST,
                rests=True, **more,
            )
            for (d, field, seed), state in begin.items()
        ]  # fmt: skip
        return dict(zip(begin, sound(run(scenes, progress_of_part(progress, number, 3))), strict=True))

    unmagnetised = {key: (key[0], 0.0, key[2]) for key in wanted}
    loose: dict[Key, Arrays | None] = dict.fromkeys(unmagnetised.values())
    first = stage(0, loose, None)
    settled = {key: first[alike].state for key, alike in unmagnetised.items()}
    second = stage(1, settled, None)
    magnetised = {key: result.state for key, result in second.items()}
    third = stage(2, magnetised, 0.0)
    return [Avalanche(cell, *key, settled[key], magnetised[key], third[key]) for key in wanted]


def of(runs: Sequence[Avalanche], diameter: float, field: float) -> list[Avalanche]:
    """Return the avalanches of a diameter (m) in a field (T), in the order of their seeds."""
    chosen = [one for one in runs if one.diameter == diameter and one.field == field]
    return sorted(chosen, key=lambda one: one.seed)


def steeper_by(these: Sequence[Avalanche], those: Sequence[Avalanche]) -> np.ndarray:
    """Return the difference in slope angle (degrees) between two groups of avalanches, start by start."""
    return np.array([a.angle - b.angle for a, b in zip(these, those, strict=True)])
