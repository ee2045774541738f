"""A noisy function of two genes, for searches with several methods that share a folder."""

import numpy as np

from tisim import optimize
from tisim.optimize.problem.genes import Gene
from tisim.optimize.problem.problem import Problem
from tisim.optimize.report import report
from tisim.optimize.report.analysis import Analysis


def noisy(design, seed):
    """A bowl with its minimum, 0.5, at x = 0.3, y = 0.6, and noise determined by the seed."""
    noise = 0.01 * np.random.default_rng(seed).normal()
    return (design["x"] - 0.3) ** 2 + (design["y"] - 0.6) ** 2 + 0.5 + noise


def problem(high=1.0, **fields):
    return Problem.of_function(noisy, [Gene("x", "m", 0, high), Gene("y", "m", 0, 1)], **fields)


def skip_pictures(replace):
    """Skip sensitivities and pictures, which take most of the time of such searches.

    replace : a function such as setattr.
    """
    replace(report, "picture", lambda path, draw: [])
    replace(Analysis, "of", lambda outcome: Analysis(None, ()))


def searched(folder, method, seed, **settings):
    return optimize.run(problem(), out=folder, method=method, seed=seed, **{"generations": 3, **settings})
