"""Intervals of calibrated genes have their nominal coverage and the right width."""

import csv

import numpy as np
import pytest

from tests.optimize.analysis.granular_experiment import (
    coverage,
    interval_of,
    measured_objective,
    right_widths,
    searched,
    searched_coverage,
)
from tisim import InputError, optimize
from tisim.optimize import Choice, Gene, Problem
from tisim.optimize.analysis.misfit_shape import Evidence, coefficients, fit
from tisim.optimize.report.analysis import Analysis

SETS = 200


def holds(inside, sets=SETS):
    """Whether the coverages of the three genes agree with 0.95 within three deviations, and their mean
    too."""
    deviation = np.sqrt(0.95 * 0.05 / sets)
    return np.all(np.abs(inside - 0.95) < 3 * deviation) and abs(inside.mean() - 0.95) < 1.75 * deviation


@pytest.mark.parametrize("number", [4, pytest.param(3, marks=pytest.mark.slow)])
def test_intervals_contain_the_truth_and_have_the_right_width(number):
    inside, width = coverage(SETS, number=number)
    assert holds(inside)
    assert width == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("common", "grown"), [(True, 1.118), (False, 1.0)])
def test_noise_of_random_starts_widens_and_does_not_bias(common, grown):
    """The spread of four starts equals the uncertainty.

    If all designs share the starts, the means shift with a variance of 1/4, and the interval is sqrt(1.25) =
    1.118 times as wide. If each design has its own starts, the noise averages out.
    """
    inside, width = coverage(SETS, tau=1.0, starts=4, common=common)
    assert holds(inside)
    assert width == pytest.approx(grown, abs=0.06)


def test_near_an_end_of_the_range_intervals_are_one_sided():
    found = [interval_of(k, inside=(0.0, 0.05)) for k in range(60)]
    truths, intervals = np.array([one[0] for one in found]), np.array([one[1] for one in found])
    assert np.mean(intervals[:, 1, 0] == 0.0) > 0.9
    inside = (np.maximum(intervals[..., 0], 0) <= truths) & (truths <= intervals[..., 1])
    assert inside.mean() > 0.92


def test_a_quadratic_gives_exact_results():
    hessian = np.array([[200.0, 120.0], [120.0, 300.0]])
    at = np.array([0.4, 0.6])
    points = np.random.default_rng(1).uniform(0, 1, (200, 2))
    off = points - at
    chi2 = 1.5 + 0.5 * np.einsum("ij,jk,ik->i", off, hessian, off)
    shape = fit(Evidence(points, chi2, np.zeros(200)))
    covariance = 2 * np.linalg.inv(hessian)
    assert shape.best == pytest.approx(at, abs=1e-8)
    assert shape.least == pytest.approx(1.5, abs=1e-6)
    assert shape.covariance == pytest.approx(covariance, rel=1e-4)
    for k in range(2):
        half = np.sqrt(3.841 * covariance[k, k])
        assert shape.interval(k) == pytest.approx((at[k] - half, at[k] + half), rel=1e-3)


def test_an_interval_that_reaches_an_end_is_the_profile_within_the_range():
    """chi^2 = ((x + y - 0.1) / 0.02)^2 + ((x - y) / 0.1)^2, along x; y cannot be below 0."""
    points = np.random.default_rng(2).uniform(0, 0.4, (400, 2))
    total, difference = points.sum(axis=1) - 0.1, points[:, 0] - points[:, 1]
    chi2 = (total / 0.02) ** 2 + (difference / 0.1) ** 2
    shape = fit(Evidence(points, chi2, np.zeros(len(points))))
    grid = np.stack(np.meshgrid(*[np.linspace(0, 0.3, 1501)] * 2, indexing="ij"), axis=-1)
    exact = ((grid.sum(axis=-1) - 0.1) / 0.02) ** 2 + ((grid[..., 0] - grid[..., 1]) / 0.1) ** 2
    inside = np.linspace(0, 0.3, 1501)[exact.min(axis=1) < exact.min() + 3.841]
    low, high = shape.interval(0)
    assert low == pytest.approx(inside.min(), abs=1e-3)
    assert high == pytest.approx(inside.max(), abs=1e-3)


def outcome_of(function, genes, wanted, runs=200):
    problem = Problem.of_function(function, genes, (measured_objective(wanted),), "made", code="made")
    return optimize.run(problem, method="cma-es", seed=1, max_evaluations=runs, generations=10**6)


def test_undetermined_genes_are_reported():
    truth, outcome = searched(1, "cma-es", 2, 200)
    found = optimize.calibration(outcome)
    friction, rolling, restitution = found.genes
    assert [one.told for one in (friction, rolling, restitution)] == [True, False, True]
    assert (rolling.low, rolling.high) == pytest.approx((0.0, 0.4))
    assert any("The measurements do not determine rolling_friction" in remark for remark in found.remarks)
    # Even with four quantities, the same two determine friction and restitution.
    assert [friction.part, restitution.part] == pytest.approx(right_widths(truth, 4)[[0, 2]], rel=0.06)
    assert np.isnan(found.correlation[1]).all()
    assert abs(found.correlation[0, 2]) < 0.1


def test_genes_with_only_their_sum_measured_are_not_separable():
    genes = [Gene("a", "", 0, 1), Gene("b", "", 0, 1), Gene("c", "", 0, 1)]
    outcome = outcome_of(
        lambda d: {"sum": d["a"] + d["b"], "own": d["c"]}, genes, {"sum": (1.0, 0.1), "own": (0.5, 0.1)}
    )
    found = optimize.calibration(outcome)
    assert [one.told for one in found.genes] == [False, False, True]
    (remark,) = found.remarks
    assert remark.startswith("a and b cannot be distinguished")
    assert "for more a with less b" in remark
    assert found.correlation[0, 1] < -0.85


def test_contradictory_measurements_are_reported():
    genes = [Gene("a", "", 0, 1)]
    outcome = outcome_of(
        lambda d: {"one": d["a"], "other": d["a"]}, genes, {"one": (0.2, 0.02), "other": (0.6, 0.02)}
    )
    assert any("does not meet all measurements" in remark for remark in optimize.calibration(outcome).remarks)


def test_too_few_designs_give_a_list_of_further_ones():
    genes, wanted = [Gene("a", "m", 0, 1), Gene("b", "m", 0, 1)], {"p": (0.5, 0.001), "q": (0.5, 0.001)}
    outcome = outcome_of(lambda d: {"p": d["a"], "q": d["b"]}, genes, wanted, runs=12)
    found = optimize.calibration(outcome)
    assert found.genes == ()
    assert 0 < found.missing <= 2 * coefficients(2)
    assert len(found.wanted) == found.missing
    assert all(0 <= design["a"] <= 1 and 0 <= design["b"] <= 1 for design in found.wanted)
    assert "more are needed" in found.remarks[0]


def test_a_choice_stays_at_its_best_and_equally_good_ones_are_listed():
    genes = [Gene("a", "", 1, 100, "log"), Choice("law", ("one", "two", "three"))]
    extra = {"one": 0.0, "two": 0.0, "three": 7.0}
    outcome = outcome_of(
        lambda d: {"log a": np.log(d["a"]), "extra": extra[d["law"]]}, genes,
        {"log a": (np.log(10), 0.1), "extra": (0.0, 1.0)},
    )  # fmt: skip
    found = optimize.calibration(outcome)
    (gene,) = found.genes
    assert (gene.low, gene.high) == pytest.approx((10 * np.exp(-0.196), 10 * np.exp(0.196)), rel=0.01)
    assert set(found.choices["law"]) <= {"one", "two"}


def test_a_problem_without_a_misfit_is_refused():
    problem = Problem.of_function(lambda d: d["a"], [Gene("a", "", 0, 1)], code="made")
    outcome = optimize.run(problem, max_evaluations=20)
    with pytest.raises(InputError, match="must be a Misfit in a problem that is calibrated"):
        optimize.calibration(outcome)


def test_table_and_pictures_are_written(tmp_path):
    _, outcome = searched(1, "cma-es", 2, 200)
    paths = {path.name for path in Analysis.of(outcome).write(tmp_path)}
    wanted = {f"{name}.{kind}" for name in ("calibration", "sensitivity") for kind in ("csv", "png", "pdf")}
    assert paths == wanted
    rows = list(csv.DictReader((tmp_path / "calibration.csv").read_text().splitlines()))
    assert [row["gene"] for row in rows] == ["friction", "rolling_friction", "restitution"]
    assert rows[1]["interval"] == "not told: its whole range"
    found = optimize.calibration(outcome)
    assert float(rows[0]["95 % low"]) == found.genes[0].low


@pytest.mark.slow
@pytest.mark.parametrize(("method", "sets"), [("cma-es", 100), ("gaussian-process", 30)])
def test_intervals_of_searches_contain_the_truth(method, sets):
    """Searches of 300 runs; with a Gaussian process each takes half a minute."""
    inside, width = searched_coverage(method, 4, 300, sets)
    print(f"{method}: truth inside {inside}, width over the right one {width}")
    assert holds(inside, sets)
    assert width == pytest.approx(1.0, abs=0.1)
