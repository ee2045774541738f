"""The designs of generation 0, spread evenly."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from optimize.surrogate.gaussian_process import Array


def sobol(genes: int, count: int, rng: np.random.Generator) -> Array:
    """Return the first points of a scrambled Sobol' sequence, (count, genes)."""
    whole = qmc.Sobol(genes, rng=rng).random_base2(max(count - 1, 1).bit_length())
    return np.asarray(whole[:count])
