"""Scaling of magnetism in a bed: the attraction of two touching grains over their weight (L21 section 4.5),
and the eigenvalues of mutual magnetisation."""

import math

import numpy as np
from scipy.constants import mu_0
from scipy.linalg import eigvalsh

from tisim.analysis import nearest_image
from tisim.cases.avalanche.scene import CUTOFF, DENSITY, FLUX, GRAVITY, SUSCEPTIBILITY
from tisim.cases.common.two_spheres import attraction_in_line
from tisim.scene.initial_state import Arrays

CONTRAST = SUSCEPTIBILITY / (3 + SUSCEPTIBILITY)
"""chi / (3 + chi) = (mu_r - 1) / (mu_r + 2)."""


def moment(diameter: float, field: float = FLUX) -> float:
    """Return the moment (A m^2) of a single grain: 4 pi R^3 chi / (3 + chi) B / mu_0 (L21 Eq. 4.11)."""
    return 4 * math.pi * (diameter / 2) ** 3 * CONTRAST * field / mu_0


def attraction(diameter: float, field: float = FLUX, mutual: bool = True) -> float:
    """Return the attraction (N) of two grains in contact along the field.

    With mutual magnetisation the moments are larger by the factor 1 / (1 - 2 a), a = chi / (3 + chi) / 8.
    """
    grown = 1 / (1 - CONTRAST / 4) if mutual else 1.0
    return attraction_in_line(grown * moment(diameter, field), diameter)


def weight(diameter: float) -> float:
    """Return the weight of a grain, N (L21 Eq. 4.13)."""
    return DENSITY * math.pi / 6 * diameter**3 * GRAVITY


def ratio(diameter: float, field: float = FLUX, mutual: bool = True) -> float:
    """Return the attraction over the weight; it is inversely proportional to the diameter."""
    return attraction(diameter, field, mutual) / weight(diameter)


def moment_eigenvalues(state: Arrays, width: float) -> np.ndarray:
    """Return the eigenvalues, in rising order, of the mutual magnetisation of equal grains within the
    cut-off.

    Whole sweeps, each from the previous moments, converge if all eigenvalues are between -1 and 1. width : of
    the cell, m.
    """
    place, d = state["position"], 2 * float(state["radius"].mean())
    apart = place[None] - place[:, None]
    apart = nearest_image(apart.reshape(-1, 3), (0.0, width, 0.0)).reshape(apart.shape)
    distance = np.linalg.norm(apart, axis=-1)
    np.fill_diagonal(distance, np.inf)
    n = apart / distance[..., None]
    strength = np.where(distance <= CUTOFF * d / 2, CONTRAST / 8 * (d / distance) ** 3, 0.0)
    tensor = strength[..., None, None] * (3 * n[..., :, None] * n[..., None, :] - np.eye(3))
    return np.asarray(eigvalsh(tensor.transpose(0, 2, 1, 3).reshape(3 * len(place), -1)))
