"""Statistics over the starts of a design: estimates, intervals, and searches for them."""

from itertools import combinations

import numpy as np
import pytest
from scipy.stats import beta, norm
from scipy.stats.mstats import hdquantiles

from tisim import InputError, optimize
from tisim.optimize import Expectation, Gene, Misfit, Objective, Problem, Quantile, WorstOf
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.evaluation.executors import evaluator_for
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache

RNG = np.random.default_rng(5)
VALUES = RNG.normal(size=12)
TARGET = {"angle": (20.0, 2.0), "rate": (0.5, 0.1)}


def objective(statistic, maximise=False, of=lambda result: result.value):
    return Objective("value", of, statistic=statistic, maximise=maximise)


def test_estimates_follow_their_definitions():
    assert Expectation().value(VALUES) == pytest.approx(VALUES.mean(), rel=1e-14)
    assert Quantile(0.9).value(VALUES) == pytest.approx(hdquantiles(VALUES, [0.9])[0], rel=1e-12)
    subsets = [max(part) for part in combinations(VALUES, 3)]
    assert WorstOf(3).value(VALUES) == pytest.approx(np.mean(subsets), rel=1e-12)
    subsets = [min(part) for part in combinations(VALUES, 3)]
    assert objective(WorstOf(3), maximise=True).cost(VALUES) == pytest.approx(-np.mean(subsets), rel=1e-12)
    runs = np.column_stack([20 + 3 * VALUES, 0.6 + 0.1 * VALUES[::-1]])
    off = (runs.mean(axis=0) - [20, 0.5]) / [2, 0.1]
    variance = runs.var(axis=0, ddof=1) / 12 / [4, 0.01]
    assert Misfit(TARGET).value(runs) == pytest.approx(np.mean(off**2 - variance), rel=1e-12)


def test_maximised_values_are_small_costs():
    """A quantile refers to the value, whether it is minimised or maximised; the worst of maximised values is
    the least."""
    up, down = objective(Quantile(0.1), maximise=True), objective(Quantile(0.9))
    assert up.cost(VALUES) == pytest.approx(-hdquantiles(VALUES, [0.1])[0], rel=1e-12)
    assert down.cost(-VALUES) == pytest.approx(up.cost(VALUES), rel=1e-12)
    many = RNG.normal(size=50)
    ends = [FitnessEstimate.of(one, sign * many, False) for one, sign in ((up, 1), (down, -1))]
    assert (ends[0].low, ends[0].high) == pytest.approx((ends[1].low, ends[1].high), rel=1e-12)
    assert objective(WorstOf(12), maximise=True).cost(VALUES) == -VALUES.min()
    assert objective(WorstOf(12)).cost(VALUES) == VALUES.max()


def test_the_misfit_of_means_excludes_their_variance():
    """For 4 runs whose noise is twice the uncertainty a naive misfit is too large by 1."""
    misfit, found = Misfit({"a": (0.0, 1.0)}), []
    for _ in range(4000):
        found.append(misfit.value(RNG.normal(1.5, 2.0, size=(4, 1))))
    assert np.mean(found) == pytest.approx(1.5**2, abs=4 * np.std(found) / np.sqrt(4000))


@pytest.mark.parametrize(
    ("statistic", "variance"),
    [
        (Expectation(), 1 / 40),
        (Quantile(0.5), np.pi / 2 / 40),
        (Quantile(0.9), 0.09 / norm.pdf(norm.ppf(0.9)) ** 2 / 40),
        (Misfit({"a": (3.0, 1.0)}), 4 * 9 / 40),
    ],
    ids=str,
)
def test_standard_errors_are_right(statistic, variance):
    """The mean of pseudo-values, compared with the variance of large samples."""
    errors = []
    for _ in range(400):
        sample = RNG.normal(size=(40, 1) if statistic.quantities else 40)
        errors.append(np.var(statistic.pseudo_values(sample), ddof=1) / 40)
    assert np.mean(errors) == pytest.approx(variance, rel=0.2)


def covered(statistic, draw, truth, repeats, shape):
    ends = [statistic.interval(draw(size=shape)) for _ in range(repeats)]
    return np.mean([low <= truth <= high for low, high in ends])


def intervals():
    rng = np.random.default_rng(7)
    for share in (0.5, 0.9):
        fresh = max(16, Quantile(share).fewest_fresh)
        yield f"quantile {share}, normal", Quantile(share), rng.normal, norm.ppf(share), fresh
        yield f"quantile {share}, exponential", Quantile(share), rng.exponential, -np.log(1 - share), fresh
    top = beta(4, 1)  # distribution of the largest of four uniform numbers
    yield "worst of 4, uniform", WorstOf(4), rng.uniform, top.mean(), 16
    yield "worst of 4, exponential", WorstOf(4), rng.exponential, 1 + 1 / 2 + 1 / 3 + 1 / 4, 16
    for distance in (0.0, 0.3, 2.0):
        yield f"misfit {distance}", Misfit({"a": (distance, 1.0)}), rng.normal, distance**2, (16, 1)


@pytest.mark.parametrize(
    ("name", "statistic", "draw", "truth", "shape"), [*intervals()], ids=lambda x: str(x)[:30]
)
def test_intervals_contain_the_truth(name, statistic, draw, truth, shape):
    inside = covered(statistic, draw, truth, 400, shape)
    print(f"{name}: {inside:.3f}")
    assert 0.915 < inside < 0.99


def test_a_misfit_of_several_quantities_is_within_its_interval():
    rng, scale = np.random.default_rng(8), np.array([0.5, 1.0, 2.0])
    misfit = Misfit({"a": (0.5, 1.0), "b": (0.5, 1.0), "c": (0.5, 1.0)})
    inside = covered(misfit, lambda size: scale * rng.normal(size=size), 0.25, 300, (16, 3))
    assert 0.92 < inside < 0.995


def test_interval_ends_need_enough_values():
    low, high = Quantile(0.9).interval(VALUES)
    assert np.isfinite(low)
    assert np.isnan(high)
    assert Quantile(0.9).fewest_fresh == 36


def noisy(design, seed):
    """The mean is least at 0.2; the noise is smaller at 1."""
    x = design["x"]
    return (x - 0.2) ** 2 + (1.0 - x) * np.random.default_rng(seed).normal()


WORST = norm.expect(lambda z: 4 * z * norm.cdf(z) ** 3)
"""The expected maximum of four normal numbers, 1.03."""


def searched_problem(statistic):
    return Problem.of_function(noisy, [Gene("x", "m", 0, 1)], [objective(statistic)], "noisy", code="noisy")


@pytest.mark.parametrize(
    ("statistic", "noise", "other"),
    [(Expectation(), 0.0, WORST), (WorstOf(4), WORST, 0.0)],
    ids=["mean", "worst"],
)
def test_a_search_finds_the_best_of_its_statistic(statistic, noise, other):
    """The result is closer in value to its own best design than to the best design of the other statistic."""

    def truth(x):
        return (x - 0.2) ** 2 + noise * (1.0 - x)

    outcome = optimize.run(searched_problem(statistic), seed=1, max_evaluations=400, generations=1000)
    found = truth(outcome.designs[0].genes["x"])
    assert found < (truth(0.2 + noise / 2) + truth(0.2 + other / 2)) / 2
    assert all(len(values) >= statistic.fewest_starts for values in outcome.quantities.values())


def test_a_statistic_is_reported_only_from_enough_starts():
    """The worst of four runs, estimated from two or four starts, would be too optimistic."""
    outcome = optimize.run(searched_problem(WorstOf(4)), seed=1, max_evaluations=24, generations=100)
    assert all(len(values) >= 5 for values in outcome.quantities.values())
    assert all(not one.confirmed or one.confirmed[0].starts >= 5 for one in outcome.hall)
    worst = [objective(WorstOf(4)), Objective("x", lambda result: result.design["x"])]
    problem = Problem.of_function(noisy, [Gene("x", "m", 0, 1)], worst, "two", code="two")
    front = optimize.run(problem, seed=1, max_evaluations=120, generations=100)
    assert front.hall
    assert all(not one.confirmed or one.confirmed[0].starts >= 5 for one in front.hall)


def test_the_same_runs_serve_every_statistic(tmp_path):
    """The values of runs are stored, so another statistic of them needs no new runs."""
    counts = []
    settings = Settings(seed=1, method="random", options={"population": 6}, generations=0)
    for statistic in (Quantile(0.5), Expectation()):
        problem = searched_problem(statistic)
        with Cache(tmp_path / "all.h5") as cache:
            outcome = search(problem, evaluator_for(problem, "batch"), cache, settings)
        counts.append(outcome.evaluations)
    assert counts[0] > 20
    assert counts[1] == 0


def test_impossible_values_are_refused():
    for make, words in (
        (lambda: Quantile(1.0), "share of a quantile must be between 0 and 1; received 1"),
        (lambda: WorstOf(1), "starts of WorstOf must be a whole number above 1; received 1"),
        (lambda: Misfit({}), "measured of a Misfit must be a dictionary"),
        (
            lambda: Misfit({"a": (1.0, 0.0)}),
            r"measured a must be \(value, uncertainty above 0\), both finite",
        ),
        (lambda: objective("mean"), "statistic of value must be Expectation"),
        (lambda: objective(Misfit(TARGET), maximise=True), "maximise of value must be False"),
    ):
        with pytest.raises(InputError, match=words):
            make()
    problem = Problem.of_function(noisy, [Gene("x", "m", 0, 1)], [objective(Quantile(0.99))])
    with pytest.raises(
        InputError, match=r"max_starts must be 100 or more for the 0.99 quantile of value; rec"
    ):
        optimize.run(problem)


def test_a_measured_quantity_must_be_returned():
    problem = Problem.of_function(
        lambda design: {"angle": 21.0}, [Gene("x", "m", 0, 1)], [objective(Misfit(TARGET))], "short", code="s"
    )
    with pytest.raises(InputError, match="objective value must return a dictionary of angle, rate; received"):
        optimize.run(problem)
