"""Measures of a slope: its angles, the volume of the heap, and the fraction filled by grains."""

import numpy as np
from scipy.spatial import cKDTree

from tisim import InputError, Result, Scene
from tisim.accuracy import Quantity
from tisim.analysis import slope_angles, surface_profile
from tisim.cases.avalanche.scene import GRAVITY
from tisim.cases.common.runs import overlap
from tisim.scene.initial_state import Arrays

SAMPLES = 8
"""Number of sample points along each diameter for the filled fraction."""


def diameter(state: Arrays) -> float:
    """Return the diameter of the grains, m."""
    return 2 * float(state["radius"].mean())


def profile(state: Arrays) -> tuple[np.ndarray, np.ndarray]:
    """Return positions along the cell, one diameter apart, and the height of the surface there; m."""
    return surface_profile(state["position"], state["radius"], along=0, across=1)


def repose(state: Arrays) -> float:
    """Return the angle of repose, degrees; NaN if the fitted part is shorter than three diameters.

    It is the angle of a line fitted to the slope between one fifth and four fifths of its height.
    """
    place, height = profile(state)
    return float(np.degrees(_angles(place, height, 1)[0]))


def two_slopes(state: Arrays) -> tuple[float, float]:
    """Return the angles of the upper and the lower part of the slope, degrees; NaN if the slope is shorter
    than six diameters.

    They are the angles of the best fitting line with one bend.
    """
    place, height = profile(state)
    upper, lower = np.degrees(_angles(place, height, 2))
    return float(upper), float(lower)


def _angles(place: np.ndarray, height: np.ndarray, pieces: int) -> np.ndarray:
    try:
        return slope_angles(place, height, pieces=pieces).angles
    except InputError:
        return np.full(pieces, np.nan)


def heap_volume(state: Arrays, width: float) -> float:
    """Return the volume (m^3) below the surface of a heap in a cell of a given width (m).

    The floor is divided into squares of about one diameter; each is filled up to the highest point of a grain
    in it.
    """
    d, place = diameter(state), state["position"]
    rows = round(width / d)
    column = (place[:, 0] / d).astype(int)
    row = (place[:, 1] % width / width * rows).astype(int) % rows
    tops = np.zeros((column.max() + 1, rows))
    np.maximum.at(tops, (column, row), place[:, 2] + state["radius"])
    return float(tops.sum() * d * width / rows)


def grains_volume(state: Arrays) -> float:
    """Return the volume of all grains, m^3."""
    return float((4 / 3 * np.pi * state["radius"] ** 3).sum())


def filled_parts(state: Arrays, width: float, length: float, height: float) -> np.ndarray:
    """Return the fraction of the volume filled by grains, in squares of one diameter along and up; shape
    (length, height) in diameters.

    It is averaged over the width, from SAMPLES points along each diameter. All grains must have the same
    size.
    width, length, height : of the cell, m.
    """
    d = diameter(state)
    columns, layers = round(length / d), round(height / d)
    along, up = (((np.arange(n * SAMPLES) + 0.5) / SAMPLES) * d for n in (columns, layers))
    across = (np.arange(round(width / d * SAMPLES)) + 0.5) / round(width / d * SAMPLES) * width
    points = np.stack(np.meshgrid(along, across, up, indexing="ij"), axis=-1)
    inside_cell = np.where([False, True, False], state["position"] % width, state["position"])
    shifts = np.array([[0.0, k * width, 0.0] for k in (-1, 0, 1)])
    images = (inside_cell + shifts[:, None]).reshape(-1, 3)
    near, _ = cKDTree(images).query(points, distance_upper_bound=d / 2)
    inside = np.isfinite(near).mean(axis=1)
    return np.asarray(inside.reshape(columns, SAMPLES, layers, SAMPLES).mean(axis=(1, 3)))


def load_on_walls(result: Result) -> float:
    """Return the downward force of the grains on floor and walls divided by their weight; 1 at rest."""
    down = -(result.measures["box_force_z"] + result.measures["gate_force_z"])
    return down / (float(result.state["mass"].sum()) * GRAVITY)


def width(result: Result) -> float:
    """Return the width of the cell of a result, m."""
    return float(result.scene.domain.edges(0.0)[1, 1])


def volume(result: Result) -> float:
    """Return the volume of the heap divided by the volume of its grains."""
    return heap_volume(result.state, width(result)) / grains_volume(result.state)


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``: properties of the final heap and the largest overlap, as paths
    of grains are chaotic."""
    return (
        Quantity("angle of repose", lambda result: repose(result.state), random=True),
        Quantity("volume of the heap", volume, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
