"""Measures of a draw-down test, its angle of repose and discharge rate, and of a bed in a cup."""

import numpy as np
from scipy.constants import g as STANDARD_GRAVITY
from scipy.spatial import cKDTree

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.cases.common.runs import overlap
from tisim.effects import Walls
from tisim.geometry import Disc
from tisim.operators import Passage

FALLING = 0.1
"""Speed above which a grain counts as falling, m/s: it is reached after half a millimetre."""
FLANK_PART = (0.15, 0.9)
"""Range of the heap's flank for the fitted slope, as fractions of the disc's radius."""
CLOSED = 0.1
"""Fraction of the run without passage after which a silo counts as closed; in this time, about eighty grains
pass the narrowest outlet that flows."""
FEWEST = 20
"""Least number of grains on the flank of a heap for which an angle is measured."""


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
    """Return a mask of the grains that lie on the disc or on other grains there, without falling ones; shape
    (n,)."""
    height, bottom = result.state["position"][:, 2], floor(result)
    speed = np.linalg.norm(result.state["velocity"], axis=1)
    return (height > bottom) & (height < bottom / 4) & (speed < FALLING)


def surface(position: np.ndarray, diameter: float) -> np.ndarray:
    """Return a mask of the grains with none above them within half a diameter (m) sideways; shape (n,).

    position : m, shape (n, 3).
    """
    pairs = cKDTree(position[:, :2]).query_pairs(0.5 * diameter, output_type="ndarray").reshape(-1, 2)
    covered = np.where(position[pairs[:, 0], 2] < position[pairs[:, 1], 2], pairs[:, 0], pairs[:, 1])
    free = np.ones(len(position), bool)
    free[covered] = False
    return free


def repose(result: Result) -> float:
    """Return the angle of repose of the heap, degrees; NaN if there are too few grains.

    It is the slope of a straight line, fitted by least squares to the surface grains between FLANK_PART of
    the disc's radius. The foot of a heap that fills its disc is at the rim, so this works for smaller heaps
    than ``tisim.analysis.angle_of_repose``, which determines the end of the heap.
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
    """Return the discharge rate in steady flow, kg/s; NaN if an arch has closed the silo."""
    return result.measures["passage_rate"] if flowed(result) else float("nan")


def flowed(result: Result) -> bool:
    """Return whether a silo flows until the mass for its discharge rate has passed, or to the end of the run.

    A silo counts as closed by an arch if nothing has passed during the last CLOSED of its run.
    """
    passage = next(one for one in result.scene.effects if isinstance(one, Passage))
    names = ("passed_mass", "passage_rate", "passage_begin_mass", "passage_begin_time")
    passed, rate, first_mass, first_time = (result.measures[name] for name in names)
    if passed >= passage.end or rate == 0:
        return bool(rate > 0)
    last = first_time + (passed - first_mass) / rate
    return bool(last > (1 - CLOSED) * result.scene.duration)


def side_load(result: Result) -> float:
    """Return the outward force of the grains on the side of the cup at the end, divided by their weight."""
    state = result.state
    outward = state["position"][:, :2] / np.linalg.norm(state["position"][:, :2], axis=1, keepdims=True)
    push = -float((state["side_loads"][:, :2] * outward).sum())
    return push / (float(state["mass"].sum()) * STANDARD_GRAVITY)


def centre_height(result: Result) -> float:
    """Return the height of the centre of mass at the end, m; it measures the density of the bed."""
    return float(np.average(result.state["position"][:, 2], weights=result.state["mass"]))


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``, over random starts, as paths of grains are chaotic.

    They are the angle of repose and the discharge rate of a draw-down test, or height, load on the side and
    largest overlap of a bed.
    """
    if any(isinstance(effect, Passage) for effect in scene.effects):
        return (
            Quantity("discharge rate", discharge, random=True),
            Quantity("angle of repose", repose, random=True),
        )
    return (
        Quantity("height of the bed", centre_height, random=True),
        Quantity("load on the side", side_load, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
