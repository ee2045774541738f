"""The Gaussian process compared with a dense reference, and acquisition values with integrals and known
fronts."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import check_grad
from scipy.stats import norm, spearmanr

from tests.optimize.fake_runs import fake_problem, individual_of
from tisim.optimize.surrogate import gaussian_process
from tisim.optimize.surrogate.acquisition import Worth, log_expected_improvement
from tisim.optimize.surrogate.belief import Belief
from tisim.optimize.surrogate.gaussian_process import GaussianProcess, Parameters
from tisim.optimize.surrogate.ranking import best, spread
from tisim.optimize.surrogate.selection import MOST_LEARNED, beaten_by, representative, thinned

RNG = np.random.default_rng(4)
POINTS = RNG.random((25, 3))
VALUES = 7.0 + np.sin(4 * POINTS[:, 0]) + POINTS[:, 1] ** 2
NOISE = RNG.uniform(0.001, 0.1, 25)
PARAMETERS = Parameters(np.array([0.4, 0.7, 2.0]), 1.3, 0.01)


def matern(a, b):
    """k(a, b) of Rasmussen and Williams Eq. 4.17 with nu = 5/2, point by point."""
    r = np.sqrt(sum(((x - y) / length) ** 2 for x, y, length in zip(a, b, PARAMETERS.lengths, strict=True)))
    return PARAMETERS.signal * (1 + 5**0.5 * r + 5 * r**2 / 3) * np.exp(-(5**0.5) * r)


def test_predictions_equal_a_dense_reference():
    process = GaussianProcess(POINTS, VALUES, NOISE, PARAMETERS)
    new = RNG.random((4, 3))
    z = (VALUES - VALUES.mean()) / VALUES.std()
    k = np.array([[matern(a, b) for b in POINTS] for a in POINTS])
    k += np.diag(NOISE / VALUES.var() + PARAMETERS.nugget + 1e-8)
    inverse = np.linalg.inv(k)
    mean, deviation = process.predict(new)
    for at, m, s in zip(new, mean, deviation, strict=True):
        across = np.array([matern(at, b) for b in POINTS])
        expected = across @ inverse @ z
        assert m == pytest.approx(VALUES.mean() + VALUES.std() * expected, rel=1e-10)
        assert s == pytest.approx(
            VALUES.std() * np.sqrt(PARAMETERS.signal - across @ inverse @ across), rel=1e-8
        )


def test_the_gradient_of_the_likelihood_matches_its_values():
    z = (VALUES - VALUES.mean()) / VALUES.std()
    likelihood = gaussian_process._Likelihood(POINTS, z, NOISE, Parameters.prior(3))
    at = PARAMETERS.logarithms
    assert check_grad(lambda x: likelihood(x)[0], lambda x: likelihood(x)[1], at) < 1e-5


def test_known_noise_is_not_fitted():
    """With 120 values of noise 0.3 the rms error is below 0.15 and agrees with the predicted deviation."""
    points = RNG.random((120, 2))
    process = GaussianProcess(points, bowl(points) + 0.3 * RNG.standard_normal(120), np.full(120, 0.09))
    new = RNG.random((400, 2))
    mean, deviation = process.predict(new)
    off = mean - bowl(new)
    assert np.sqrt(np.mean(off**2)) < 0.15
    assert 0.5 < np.sqrt(np.mean((off / deviation) ** 2)) < 1.6


def bowl(points):
    return 4 * ((points - 0.3) ** 2).sum(axis=1)


@pytest.mark.parametrize("z", [-35.0, -8.0, -1.0, 0.0, 3.0])
def test_expected_improvement_is_the_integral(z):
    """E[max(best - f, 0)] for a normal f with mean 2 and deviation 0.5; far out, the first term of a
    series."""
    mean, deviation = 2.0, 0.5
    level = mean + z * deviation
    found = log_expected_improvement(np.array([mean]), np.array([deviation]), level)[0]
    if z < -10:
        expected = norm.logpdf(z) - 2 * np.log(-z) + np.log(deviation)
        assert found == pytest.approx(expected, abs=3 / z**2 * 1.1)
    else:
        low = mean - 12 * deviation
        value, _ = quad(lambda f: (level - f) * norm.pdf(f, mean, deviation), low, level, epsabs=0)
        assert found == pytest.approx(np.log(value), rel=1e-6)


def test_of_certain_improvements_the_most_uncertain_is_best():
    """The predicted improvements are 40, 10, 2 and 1 standard deviations."""
    worth = worth_of([(0.0,), (1.0,), (2.0,)])
    deviations = np.array([0.01, 0.02, 0.02, 0.02])
    means = worth.best[0] - np.array([40, 10, 2, 1]) * deviations
    found = worth(means[:, None], deviations[:, None])
    assert list(np.argsort(-found)) == [1, 2, 0, 3]
    exact = log_expected_improvement(means[2:], deviations[2:], worth.best[0])
    assert found[2:] == pytest.approx(exact)


def test_the_hypervolume_that_a_design_adds_is_counted_right():
    """Two costs, computed exactly: a front of (0, 1), (0.4, 0.4), (1, 0), and areas computed by hand."""
    worth = worth_of([(0.0, 1.0), (0.4, 0.4), (1.0, 0.0)])
    volume = worth.volume
    reference = 1.1  # a tenth of the range beyond the worst
    points = np.array([[0.2, 0.2], [0.6, 0.1], [0.5, 0.5], [-0.1, 1.05]])
    added = volume.improvement(points)
    assert added[0] == pytest.approx((0.4 - 0.2) * (1 - 0.2) + (1 - 0.4) * (0.4 - 0.2))
    assert added[1] == pytest.approx((1.0 - 0.6) * (0.4 - 0.1))
    assert added[2] == pytest.approx(-0.1, abs=1e-9)
    assert added[3] == pytest.approx(0.1 * (reference - 1.05))


def test_three_costs_are_sampled():
    worth = worth_of([(0.0, 0.5, 1.0), (1.0, 0.0, 0.5), (0.5, 1.0, 0.0)])
    inside = worth.volume.improvement(np.array([[0.3, 0.3, 0.3], [1.05, 1.05, 1.05]]))
    assert inside[0] > 0 > inside[1]


def worth_of(costs):
    belief = Belief()
    belief.learn([individual_of([0.1 + 0.2 * k] * 2, *row) for k, row in enumerate(costs)])
    return Worth(belief, np.random.default_rng(0))


def test_a_batch_is_spread_out():
    individuals = [
        individual_of(point, value) for point, value in zip(RNG.random((30, 2)), RNG.random(30), strict=True)
    ]
    belief = Belief()
    belief.learn(individuals)
    points = np.random.default_rng(1).random((600, 2))
    batch = Worth(belief, np.random.default_rng(0)).batch(points, 6)
    assert len({tuple(point) for point in batch}) == 6
    alone = Worth(belief, np.random.default_rng(0)).of(points)
    assert tuple(batch[0]) == tuple(points[np.argmax(alone)])
    nearest = points[np.argsort(-alone)[:6]]
    assert np.std(batch, axis=0).sum() > np.std(nearest, axis=0).sum()


def test_unknown_noise_is_not_zero():
    """With one start for each design the model does not interpolate the values but recovers the bowl behind
    them."""
    rng = np.random.default_rng(2)
    points = rng.random((60, 2))
    truth, values = bowl(points), bowl(points) + 0.1 * rng.standard_normal(60)
    belief = Belief()
    belief.learn(
        [individual_of(point, value, std=np.nan) for point, value in zip(points, values, strict=True)]
    )
    assert not belief.exact
    assert np.mean((belief.means[:, 0] - truth) ** 2) < 0.5 * np.mean((values - truth) ** 2)
    belief.learn([individual_of(point, value) for point, value in zip(points, truth, strict=True)])
    assert belief.exact
    assert belief.predict(points)[0][:, 0] == pytest.approx(belief.means[:, 0], abs=1e-3)


def test_the_best_represents_close_designs():
    points = np.array([[0.5, 0.5], [0.51, 0.5], [0.5, 0.6], [0.52, 0.5]])
    costs = np.array([3.0, 1.0, 2.0, 4.0])
    assert list(thinned(points, costs, 0.015)) == [1, 2]
    assert list(thinned(points, costs, 0.005)) == [0, 1, 2, 3]


def test_a_subset_of_a_large_archive_is_not_biased_by_luck():
    """All 1200 designs cost 1; the means of two starts have a deviation of 0.7.

    A process trained on the 250 luckiest and a few others would predict 0.7.
    """
    rng = np.random.default_rng(5)
    points, runs = rng.random((1200, 2)), 1.0 + rng.standard_normal((1200, 2))
    belief = Belief()
    belief.learn(
        [
            individual_of(point, row.mean(), std=row.std(ddof=1), starts=2)
            for point, row in zip(points, runs, strict=True)
        ]
    )
    assert len(belief.chosen) == MOST_LEARNED
    assert belief.predict(points[::10])[0].mean() == pytest.approx(1.0, abs=0.1)


def test_without_noise_half_of_a_large_archive_are_the_best():
    costs = np.random.default_rng(3).random((1000, 1))
    chosen = representative(costs, 100, exact=True)
    assert len(set(chosen)) == 100
    assert set(np.argsort(costs[:, 0])[:50]) <= set(chosen)
    assert costs[chosen].max() > 0.95
    assert list(representative(costs, 5, exact=False)) == [0, 249, 499, 749, 999]


def test_beaten_designs():
    costs = np.array([[0.0, 1.0], [1.0, 0.0], [1.0, 1.0], [2.0, 2.0], [1.0, 1.0]])
    assert list(beaten_by(costs)) == [0, 0, 2, 4, 2]
    assert list(spread(np.array([[0.0, 4.0], [0.1, 3.9], [2.0, 2.0], [4.0, 0.0]]), 3)) == [0, 2, 3]


def test_the_luckiest_of_many_is_not_the_best():
    """100 designs of a bowl with two noisy starts each, 20 times.

    The true cost of the design with the best posterior mean is at most half of the true cost of the design
    with the best sample mean.
    """
    genome, regrets = fake_problem(2).genome, []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        points = rng.random((100, 2))
        runs = bowl(points)[:, None] + 0.5 * rng.standard_normal((100, 2))
        individuals = [
            individual_of(point, row.mean(), std=row.std(ddof=1), starts=2)
            for point, row in zip(points, runs, strict=True)
        ]
        (chosen,) = best(genome, individuals, 1)
        lucky = points[np.argmin(runs.mean(axis=1))]
        regrets.append([bowl(np.array([list(chosen)]))[0], bowl(lucky[None])[0]])
    posterior, luck = np.mean(regrets, axis=0)
    assert posterior < luck / 2


@pytest.mark.parametrize("penalty", [1e12, 1e300])
@pytest.mark.parametrize("share", [0.3, 0.6])
def test_penalties_do_not_hide_the_differences_of_good_designs(share, penalty):
    """A share of the designs has the penalty; the order of the others must still be predicted."""
    found = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        points = rng.random((60, 2))
        costs = np.where(points[:, 0] > 1 - share, penalty, bowl(points))
        belief = Belief()
        belief.learn([individual_of(point, cost) for point, cost in zip(points, costs, strict=True)])
        inside = rng.random((200, 2)) * [0.9 - share, 1.0]
        found.append(spearmanr(belief.predict(inside)[0][:, 0], bowl(inside)).statistic)
        order = np.argsort(costs, kind="stable")
        assert np.all(np.diff(belief.costs[order, 0]) >= 0)
    assert np.median(found) > 0.8
