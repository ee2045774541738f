"""What forces on the parts of a body come to."""

from __future__ import annotations

import math

import numpy as np


def resultant_units(label: str) -> dict[str, str]:
    """Return the unit of each of the sums that ``resultant`` returns, by name."""
    what = (("force", "N"), ("torque", "N m"))
    return {f"{label}_{name}_{axis}": unit for name, unit in what for axis in "xyz"}


def resultant(
    label: str, position: np.ndarray, force: np.ndarray, torque: np.ndarray, centre: tuple[float, ...]
) -> dict[str, float]:
    """Return the sums of forces (N) and of their torques (N m) about a centre (m), by name, such as
    LABEL_force_x. Forces act at positions (m), with torques about these, each of shape (n, 3)."""
    moments = np.cross(position - np.array(centre), force) + torque
    # Exactly rounded sums, so the same in any order.
    sums = (math.fsum(column) for column in np.concatenate([force, moments], axis=1).T)
    return dict(zip(resultant_units(label), sums, strict=True))
