"""A closed-form granular experiment with known exact intervals, and archives of searches on it.

Friction determines a sliding angle, restitution a rebound, and both frictions together an angle of repose and
a discharge rate. The exact interval follows from the derivatives: 1.96 times the square root of the diagonal
of (J^T J)^-1, with J in units of the uncertainties.

    PYTHONPATH=. python tests/optimize/analysis/granular_experiment.py METHOD QUANTITIES RUNS DATA_SETS
"""

import sys

import numpy as np

from tisim import optimize
from tisim.optimize import Gene, Misfit, Objective, Problem
from tisim.optimize.analysis.evidence import Evidence
from tisim.optimize.analysis.likelihood import Likelihood

GENES = (
    Gene("friction", "", 0.05, 1.0),
    Gene("rolling_friction", "", 0.0, 0.4),
    Gene("restitution", "", 0.2, 0.9),
)
LOW, HIGH = np.array([gene.low for gene in GENES]), np.array([gene.high for gene in GENES])
UNCERTAINTY = np.array([1.0, 0.02, 2.0, 0.02])
"""Uncertainties of the sliding angle (degrees), rebound, angle of repose (degrees) and rate (kg/s)."""


def quantities(points, number=4, curved=False):
    """The first ``number`` quantities at points of the unit cube, shape (..., quantities).

    curved : whether the angle of repose and the rate are curved functions of both frictions, as of real
        heaps.
    """
    friction, rolling, restitution = np.moveaxis(LOW + np.asarray(points) * (HIGH - LOW), -1, 0)
    straight = 60.0 * rolling + 6.0 * friction, 0.33 - 0.4 * rolling - 0.03 * friction
    saturating = 40.0 * (1.0 - np.exp(-5.0 * rolling * (0.3 + friction)))
    bulk = (saturating, 0.2 + 0.5 / (1.0 + 8.0 * rolling + 2.0 * friction)) if curved else straight
    all_four = np.degrees(np.arctan(friction)), restitution**2, *bulk
    return np.stack(all_four, axis=-1)[..., :number]


def right_widths(truth, number, curved=False):
    """Widths of the exact 95 % intervals, in units of the ranges; needs three quantities or more."""
    steps = 1e-5 * np.eye(3)
    moved, here = quantities(truth + steps, number, curved), quantities(truth, number, curved)
    slopes = (moved - here) / 1e-5 / UNCERTAINTY[:number]
    return 2 * 1.96 * np.sqrt(np.diag(np.linalg.inv(slopes @ slopes.T)))


def measured_objective(wanted):
    """The misfit between the returned values of a function and measurements, name -> (value, uncertainty)."""
    return Objective("misfit", lambda result: result.value, statistic=Misfit(wanted))


def synthetic(seed, number=4, inside=(0.2, 0.8), curved=False):
    """A true design and synthetic measurements of it: (truth, data, rng)."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(*inside, 3)
    return truth, quantities(truth, number, curved) + UNCERTAINTY[:number] * rng.normal(size=number), rng


def cloud(rng, misfits, runs=300, size=10):
    """Points drawn in generations from a normal cloud that moves to the better half, as in a search."""
    middle, covariance, points, values = np.full(3, 0.5), 0.09 * np.eye(3), [], []
    for _ in range(runs // size):
        drawn = np.abs(rng.multivariate_normal(middle, covariance, size))
        drawn = np.clip(np.where(drawn > 1, 2 - drawn, drawn), 0, 1)
        points.append(drawn)
        values.append(misfits(drawn))
        better = drawn[np.argsort(values[-1])[: size // 2]]
        off = better - middle
        middle, covariance = better.mean(axis=0), 0.6 * covariance + 0.4 * (off.T @ off / len(better))
    return np.vstack(points)


def crowded(seed, spread=40, close=170, starts=2, width=0.02):
    """(truth, intervals, exact widths) for a data set, from an archive like that of a surrogate's search.

    spread, close : numbers of designs over the whole ranges, and within ``width`` of the best design.

    Heap and rate, which are curved functions of both frictions, have a noise of one uncertainty in each run;
    the single grains have none. The close designs therefore do not tell how heap and rate depend on the
    genes; only the others do.
    """
    truth, data, rng = synthetic(seed, curved=True)
    best = truth + 0.03 * rng.normal(size=3)
    points = np.vstack([rng.uniform(0, 1, (spread, 3)), best + width * rng.normal(size=(close, 3))])
    points = np.clip(points, 0.0, 1.0)
    means = (quantities(points, curved=True) - data) / UNCERTAINTY
    off = means[:, None] + [0.0, 0.0, 1.0, 1.0] * rng.normal(size=(len(points), starts, 4))
    found = intervals(Evidence.of_quantities(points, off, False))
    return truth, found, right_widths(truth, 4, curved=True)


def interval_of(seed, number=4, tau=0.0, starts=1, common=True, inside=(0.2, 0.8), runs=300):
    """(truth, intervals, exact widths) for a data set, from an archive of ``runs`` designs.

    tau : noise of the random starts in each quantity, in uncertainties.
    """
    truth, data, rng = synthetic(seed, number, inside)
    sigma = UNCERTAINTY[:number]
    same = tau * rng.normal(size=(starts, number))
    off = []

    def misfits(points):
        own = same if common else tau * rng.normal(size=(len(points), starts, number))
        off.append((quantities(points, number)[:, None] - data) / sigma + own)
        return (off[-1].mean(axis=1) ** 2).sum(axis=-1)

    points = cloud(rng, misfits, runs)
    found = intervals(Evidence.of_quantities(points, np.concatenate(off), common))
    return truth, found, right_widths(truth, number)


def intervals(evidence):
    """The 95 % interval of each gene, shape (genes, 2)."""
    likelihood = Likelihood(evidence)
    return np.array([[end[k] for end in likelihood.interval(k)] for k in range(evidence.points.shape[1])])


def coverage(data_sets, archive=interval_of, **settings):
    """Fraction of the intervals of each gene that contain the truth, and their mean width over the exact
    width."""
    found = [archive(k, **settings) for k in range(data_sets)]
    truths, intervals, right = map(np.array, zip(*found, strict=True))
    inside = (intervals[..., 0] <= truths) & (truths <= intervals[..., 1])
    return inside.mean(axis=0), np.ptp(intervals, axis=2).mean(axis=0) / right.mean(axis=0)


def searched(seed, method, number, runs):
    """(truth, outcome) of a search for the design behind the measurements."""
    truth, data, _ = synthetic(seed, number)

    names = ("sliding angle", "rebound", "angle of repose", "rate")[:number]

    def experiment(design):
        point = (np.array(list(design.values())) - LOW) / (HIGH - LOW)
        return dict(zip(names, quantities(point, number), strict=True))

    wanted = dict(zip(names, zip(data, UNCERTAINTY[:number], strict=True), strict=True))
    problem = Problem.of_function(experiment, GENES, (measured_objective(wanted),), "grains", code=f"{seed}")
    outcome = optimize.run(problem, method=method, seed=seed, max_evaluations=runs, generations=10**6)
    return truth, outcome


def searched_coverage(method, number, runs, data_sets):
    """The result of ``coverage``, from searches."""
    inside, widths, right = [], [], []
    for seed in range(data_sets):
        truth, outcome = searched(seed, method, number, runs)
        found = optimize.calibration(outcome).genes
        values = LOW + truth * (HIGH - LOW)
        inside.append([one.low <= value <= one.high for one, value in zip(found, values, strict=True)])
        widths.append([one.part for one in found])
        right.append(right_widths(truth, number))
    return np.mean(inside, axis=0), np.mean(widths, axis=0) / np.mean(right, axis=0)


if __name__ == "__main__":
    method, *numbers = sys.argv[1:]
    inside, width = searched_coverage(method, *map(int, numbers))
    for gene, part, wide in zip(GENES, inside, width, strict=True):
        print(f"{gene.name:17s} truth inside {part:.3f}, width over the right one {wide:.3f}")
