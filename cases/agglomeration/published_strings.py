"""The six best individuals of Z04 (tables 1 to 3), in SI units."""

from __future__ import annotations

import numpy as np

KEYS = (
    "relative_velocity", "length_ratio", "density", "hardness", "heat_capacity",
    "friction", "temperature", "activation_energy", "reaction", "surface_energy",
)  # fmt: skip
FACTORS = (200.0, 1.0, 1e4, 1e6, 2e3, 0.1, 1e3, 1e3, 1e7, 1e16)
"""The tables of Z04 print each value divided by these factors, which are the upper ends of the search ranges
except for L. The exponent at the head of the friction column cannot be read in the copy at hand. By the same
rule it is 0.1, which puts all six individuals inside the printed range."""
PRINTED = (
    (0.92344, 0.79041, 0.66527, 0.26548, 0.89815, 0.13456, 0.50218, 0.35241, 0.17765, 0.83685),
    (0.99307, 0.79510, 0.90509, 0.49048, 0.94075, 0.17535, 0.62494, 0.12457, 0.20836, 0.85267),
    (0.96042, 0.79726, 0.66773, 0.39772, 0.34235, 0.11000, 0.21911, 0.19785, 0.19901, 0.93462),
    (0.93911, 0.79280, 0.53228, 0.20459, 0.98942, 0.15624, 0.90323, 0.38558, 0.15209, 0.91321),
    (0.84977, 0.79226, 0.91791, 0.15671, 0.96995, 0.10455, 0.36270, 0.32326, 0.20403, 0.80388),
    (0.16761, 0.79362, 0.93962, 0.10877, 0.95669, 0.15099, 0.52338, 0.29311, 0.11186, 0.25457),
)
"""The six individuals as Z04 tables 1 and 2 print them."""
PUBLISHED_COSTS = (0.67708, 0.79078, 0.79636, 0.79957, 0.80036, 0.80691)
"""The cost Pi of each individual in Z04 table 3."""


def designs() -> list[dict[str, float]]:
    """Return the six individuals in SI units, best first."""
    return [dict(zip(KEYS, np.multiply(row, FACTORS).tolist(), strict=True)) for row in PRINTED]
