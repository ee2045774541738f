"""Directions across another, and points turned about the origin."""

import numpy as np
from numpy.typing import ArrayLike


def across(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors across a unit vector and each other, shape (3,) each; with it as the third they
    are right-handed."""
    first = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    first /= np.linalg.norm(first)
    return first, np.cross(direction, first)


def along_axis(points: np.ndarray, axis: ArrayLike) -> np.ndarray:
    """Return points (m), shape (n, 3), turned about the origin so that their z axis lies along an axis, shape
    (3,), of any length but 0."""
    direction = np.asarray(axis) / np.linalg.norm(axis)
    return points @ np.stack([*across(direction), direction])
