"""What a draw-down test measures: the angle of repose of the heap and the discharge rate."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from tisim import Result
from tisim.effects import Walls
from tisim.geometry import Disc
from tisim.operators import Passage

FALLING = 0.1
"""What is faster falls, m/s: from half a millimetre on."""
FLANK_PART = (0.15, 0.9)
"""Between these parts of the disc's radius the flank of the heap is taken."""
CLOSED = 0.1
"""A silo is closed if nothing passes for this part of its run, in which some eighty grains pass the narrowest
that flows."""
FEWEST = 20
"""A heap has a flank, and so an angle, if so many grains lie on it at least."""


def disc(result: Result) -> Disc:
    """Return the disc on which the heap lies."""
    return next(one for one in result.scene.effects if isinstance(one, Walls)).discs[0]


def disc_radius(result: Result) -> float:
    """Return the radius of that disc, m."""
    return float(disc(result).radius)


def floor(result: Result) -> float:
    """Return the height of that disc, m."""
    return float(disc(result).centre[2])


def heap(result: Result) -> np.ndarray:
    """Return which grains lie on the disc or on others that do, and do not fall onto them; shape (n,)."""
    height, bottom = result.state["position"][:, 2], floor(result)
    speed = np.linalg.norm(result.state["velocity"], axis=1)
    return (height > bottom) & (height < bottom / 4) & (speed < FALLING)


def surface(position: np.ndarray, diameter: float) -> np.ndarray:
    """Return which grains at some places (m), shape (n, 3), have none above them within half a diameter (m)
    sideways; shape (n,)."""
    pairs = cKDTree(position[:, :2]).query_pairs(0.5 * diameter, output_type="ndarray").reshape(-1, 2)
    covered = np.where(position[pairs[:, 0], 2] < position[pairs[:, 1], 2], pairs[:, 0], pairs[:, 1])
    free = np.ones(len(position), bool)
    free[covered] = False
    return free


def repose(result: Result) -> float:
    """Return the angle of repose of the heap, degrees: the slope of a straight line, by least squares,
    through the grains of its surface between FLANK_PART of the disc's radius; NaN where there are few.

    The foot of a heap that fills its disc is at the rim, so that this is right of smaller heaps than
    ``tisim.analysis.angle_of_repose`` takes, which finds where a heap ends.
    """
    position = result.state["position"][heap(result)]
    away = np.hypot(*position[:, :2].T) / disc_radius(result)
    chosen = (away > FLANK_PART[0]) & (away < FLANK_PART[1])
    if chosen.sum() > FEWEST:
        chosen &= surface(position, 2 * float(result.state["radius"].mean()))
    if chosen.sum() < FEWEST:
        return float("nan")
    slope = np.polyfit(away[chosen] * disc_radius(result), position[chosen, 2], 1)[0]
    return float(np.degrees(np.arctan(-slope)))


def discharge(result: Result) -> float:
    """Return the discharge rate in steady flow, kg/s; not a number where an arch has closed the silo."""
    return result.measures["passage_rate"] if flowed(result) else float("nan")


def flowed(result: Result) -> bool:
    """Return whether a silo flows on until the mass has passed that its discharge rate is of, or to the end:
    an arch has closed one through which nothing has passed for the last CLOSED of its run."""
    passage = next(one for one in result.scene.effects if isinstance(one, Passage))
    names = ("passed_mass", "passage_rate", "passage_begin_mass", "passage_begin_time")
    passed, rate, first_mass, first_time = (result.measures[name] for name in names)
    if passed >= passage.end or rate == 0:
        return bool(rate > 0)
    last = first_time + (passed - first_mass) / rate
    return bool(last > (1 - CLOSED) * result.scene.duration)
