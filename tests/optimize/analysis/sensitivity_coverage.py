"""Coverage of the intervals of sensitivities, for functions with known sensitivities.

PYTHONPATH=. python tests/optimize/analysis/sensitivity_coverage.py [SEARCHES [FUNCTION ...]]
"""

import math
import sys

import numpy as np

from tisim import optimize
from tisim.optimize import Gene, Problem


def ishigami(x):
    """T. Ishigami and T. Homma, Proc. ISUMA (1990) 398-403, with a = 7 and b = 0.1; x in 0..1, (..., 3)."""
    x1, x2, x3 = np.moveaxis((2 * np.asarray(x) - 1) * math.pi, -1, 0)
    return np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def valley(x):
    """A curved valley of two genes, x in 0..1, (..., 2)."""
    u, v = np.moveaxis(np.asarray(x), -1, 0)
    return (u - 0.4) ** 2 + 2 * (v - 0.3 - u**2 / 2) ** 2


def pits(x):
    """A narrow and deep minimum and a wide one, on a slope; x in 0..1, (..., 3)."""
    x = np.asarray(x)
    narrow, wide = (np.sum((x - centre) ** 2, axis=-1) for centre in (0.3, 0.75))
    return 0.2 * x[..., 0] - np.exp(-narrow / 0.02) - 0.6 * np.exp(-wide / 0.08)


FUNCTIONS = {
    "ishigami": (ishigami, 3, 0.0, 150),
    "ishigami with noise": (ishigami, 3, 0.5, 150),
    "valley": (valley, 2, 0.0, 60),
    "valley with noise": (valley, 2, 0.1, 60),
    "narrow minimum": (pits, 3, 0.0, 150),
    "narrow minimum with noise": (pits, 3, 0.03, 150),
}
"""Function, number of genes, standard deviation of the noise, and number of designs."""


def exact_indices(function, genes, points=81):
    """First-order and total indices of each gene, (2, genes), by the trapezoidal rule."""
    nodes = np.linspace(0, 1, points)
    weight = np.full(points, 1.0 / (points - 1))
    weight[[0, -1]] /= 2
    values = function(np.stack(np.meshgrid(*[nodes] * genes, indexing="ij"), axis=-1))

    def mean(array, axes):
        for axis in sorted(axes, reverse=True):
            array = np.tensordot(array, weight, axes=(axis, 0))
        return array

    everything = range(genes)
    whole = mean(values**2, everything) - mean(values, everything) ** 2
    first, total = [], []
    for k in everything:
        by_gene = mean(values, [j for j in everything if j != k])
        by_others = mean(values, [k])
        first.append((by_gene**2) @ weight - (by_gene @ weight) ** 2)
        left = mean(by_others**2, range(genes - 1)) - mean(by_others, range(genes - 1)) ** 2
        total.append(whole - left)
    return np.array([first, total]) / whole


def searched(name, seed):
    """The outcome of a random search, and its function."""
    function, genes, noise, designs = FUNCTIONS[name]

    def run(design, seed):
        return float(function(list(design.values())) + noise * np.random.default_rng(seed).normal())

    starts = 2 if noise else 1
    problem = Problem.of_function(
        run if noise else (lambda design: run(design, 0)),
        [Gene(f"x{k}", "", 0.0, 1.0) for k in range(genes)], ("value",), "known", code=name,
    )  # fmt: skip
    ensemble = {"confirm": 0, "select": 0, "min_starts": starts, "common_starts": False}
    settings = {"generations": 0, "options": {"population": designs}, "ensemble": ensemble}
    return function, optimize.run(problem, method="random", seed=seed, **settings)


def held(name, seed):
    """Whether the intervals contain the truth: of changes by 1 % and by 10 %, and of indices; one list for
    each."""
    function, outcome = searched(name, seed)
    (found,) = optimize.sensitivity(outcome)
    at = np.array([gene.at for gene in found.genes])
    small, large, indices = [], [], []
    for k, gene in enumerate(found.genes):
        for move, change in gene.changes.items():
            if math.isfinite(change.value):
                exact = function(at + move * np.eye(len(at))[k]) - function(at)
                (small if abs(move) < 0.05 else large).append(change.low <= exact <= change.high)
    exact = exact_indices(function, len(at)) if found.trusted else []
    for kind, values in zip(("first", "total"), exact, strict=False):
        for gene, value in zip(found.genes, values, strict=True):
            between = getattr(gene, kind)
            indices.append(between.low - 1e-3 <= value <= between.high + 1e-3)
    return small, large, indices


def coverage(name, searches):
    """Fraction of intervals that contain the truth, with its standard error, for each kind in ``held``."""
    found = [[np.mean(one) if one else math.nan for one in held(name, seed)] for seed in range(searches)]
    return np.nanmean(found, axis=0), np.nanstd(found, axis=0) / math.sqrt(searches)


if __name__ == "__main__":
    number, *names = sys.argv[1:] or ["100"]
    for name in names or FUNCTIONS:
        parts = zip(("1 %", "10 %", "indices"), *coverage(name, int(number)), strict=True)
        print(
            f"{name:26s}",
            *(f"{kind}: {part:.3f} +- {1.96 * error:.3f}" for kind, part, error in parts),
            flush=True,
        )
