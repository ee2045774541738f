"""Analytic functions that a worker process can import."""

import numpy as np


def rosenbrock(design):
    """H. H. Rosenbrock, Comput. J. 3 (1960) 175-184: a curved valley with its minimum, 0, at (1, 1)."""
    return 100 * (design["y"] - design["x"] ** 2) ** 2 + (1 - design["x"]) ** 2


def noisy(design, seed):
    """A bowl with its minimum, 0.5, at x = 0.3, and noise determined by the seed."""
    return (design["x"] - 0.3) ** 2 + 0.5 + 0.01 * np.random.default_rng(seed).normal()
