"""What magnetism does: the force of two grains that touch beside their weight (L21 section 4.5), and what
moments of a bed do to each other."""

from __future__ import annotations

import math

import numpy as np
from scipy.constants import mu_0
from scipy.linalg import eigvalsh
from tisim.cases.avalanche.scene import CUTOFF, DENSITY, FLUX, GRAVITY, SUSCEPTIBILITY
from tisim.cases.dipoles import attraction_in_line

from tisim.analysis import nearest_image
from tisim.scene.initial_state import Arrays

CONTRAST = SUSCEPTIBILITY / (3 + SUSCEPTIBILITY)
"""chi / (3 + chi) = (mu_r - 1) / (mu_r + 2)."""


def moment(diameter: float, field: float = FLUX) -> float:
    """Return the moment (A m^2) of a single grain: 4 pi R^3 chi / (3 + chi) B / mu_0 (L21 Eq. 4.11)."""
    return 4 * math.pi * (diameter / 2) ** 3 * CONTRAST * field / mu_0


def attraction(diameter: float, field: float = FLUX, mutual: bool = True) -> float:
    """Return the force (N) with which two grains in contact along the field attract each other, with
    moments that are 1 / (1 - 2 a) as large where grains magnetise each other, a = chi / (3 + chi) / 8."""
    grown = 1 / (1 - CONTRAST / 4) if mutual else 1.0
    return attraction_in_line(grown * moment(diameter, field), diameter)


def weight(diameter: float) -> float:
    """Return the weight of a grain, N (L21 Eq. 4.13)."""
    return DENSITY * math.pi / 6 * diameter**3 * GRAVITY


def ratio(diameter: float, field: float = FLUX, mutual: bool = True) -> float:
    """Return the attraction over the weight; it falls as the diameter."""
    return attraction(diameter, field, mutual) / weight(diameter)


def moment_eigenvalues(state: Arrays, width: float) -> np.ndarray:
    """Return the eigenvalues, rising, of what the moments of equal grains in a cell of a width (m) do to each
    other within the cut-off: whole sweeps from the last moments converge where all are between -1 and 1."""
    place, d = state["position"], 2 * float(state["radius"].mean())
    apart = place[None] - place[:, None]
    apart = nearest_image(apart.reshape(-1, 3), (0.0, width, 0.0)).reshape(apart.shape)
    distance = np.linalg.norm(apart, axis=-1)
    np.fill_diagonal(distance, np.inf)
    n = apart / distance[..., None]
    strength = np.where(distance <= CUTOFF * d / 2, CONTRAST / 8 * (d / distance) ** 3, 0.0)
    tensor = strength[..., None, None] * (3 * n[..., :, None] * n[..., None, :] - np.eye(3))
    return np.asarray(eigvalsh(tensor.transpose(0, 2, 1, 3).reshape(3 * len(place), -1)))
