"""Directions normal to a given one, and rotation of points about the origin."""

import numpy as np
from numpy.typing import ArrayLike


def across(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors normal to a unit vector and to each other, shape (3,) each; with it as the
    third they form a right-handed system."""
    first = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    first /= np.linalg.norm(first)
    return first, np.cross(direction, first)


def along_axis(points: np.ndarray, axis: ArrayLike) -> np.ndarray:
    """Return points (m), shape (n, 3), rotated about the origin such that their z axis is along an axis,
    shape (3,), of any length but 0."""
    direction = np.asarray(axis) / np.linalg.norm(axis)
    return points @ np.stack([*across(direction), direction])
