"""Intervals of calibrated genes have their nominal coverage and the right width."""

import csv

import numpy as np
import pytest

from tests.optimize.analysis.granular_experiment import (
    coverage,
    crowded,
    interval_of,
    intervals,
    measured_objective,
    right_widths,
    searched,
    searched_coverage,
)
from tisim import InputError, optimize
from tisim.optimize import Choice, Gene, Problem
from tisim.optimize.analysis.evidence import Evidence, coefficients
from tisim.optimize.analysis.likelihood import Likelihood
from tisim.optimize.analysis.response import Response
from tisim.optimize.report.analysis import Analysis

SETS, RUNS = 24, 60
"""Data sets of the quick tests, and runs of each; the slow tests have 200 sets of 150 runs."""


def holds(inside, sets):
    """Whether the coverages of the three genes agree with 0.95 within three deviations, and their mean
    too."""
    deviation = np.sqrt(0.95 * 0.05 / sets)
    return np.all(np.abs(inside - 0.95) < 3 * deviation) and abs(inside.mean() - 0.95) < 1.75 * deviation


@pytest.mark.parametrize(
    ("number", "sets", "runs"),
    [(4, SETS, RUNS), *(pytest.param(n, 200, 150, marks=pytest.mark.slow) for n in (3, 4))],
)
def test_intervals_contain_the_truth_and_have_the_right_width(number, sets, runs):
    inside, width = coverage(sets, number=number, runs=runs)
    assert holds(inside, sets)
    assert width == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    ("common", "grown"), [(True, 1.118), pytest.param(False, 1.0, marks=pytest.mark.slow)]
)
def test_noise_of_random_starts_widens_and_does_not_bias(common, grown):
    """The spread of four starts equals the uncertainty.

    If all designs share the starts, the means shift with a variance of 1/4, and the interval is sqrt(1.25) =
    1.118 times as wide. If each design has its own starts, the noise averages out.
    """
    inside, width = coverage(SETS, tau=1.0, starts=4, common=common, runs=RUNS)
    assert holds(inside, SETS)
    assert width == pytest.approx(grown, abs=0.06)


def test_near_an_end_of_the_range_intervals_are_one_sided():
    found = [interval_of(k, inside=(0.0, 0.05), runs=RUNS) for k in range(SETS)]
    truths, intervals = np.array([one[0] for one in found]), np.array([one[1] for one in found])
    assert np.mean(intervals[:, 1, 0] == 0.0) > 0.9
    inside = (np.maximum(intervals[..., 0], 0) <= truths) & (truths <= intervals[..., 1])
    assert inside.mean() > 0.92


@pytest.mark.parametrize(("sets", "close"), [(20, 80), pytest.param(200, 170, marks=pytest.mark.slow)])
def test_designs_that_crowd_around_the_best_do_not_narrow_intervals(sets, close):
    """The slopes of heap and rate are lost in the noise of the crowd, and are known from the other designs.

    A quadratic form fitted to chi^2 of the crowd had intervals at a corner of the ranges, and contained half
    of the true values.
    """
    inside, width = coverage(sets, crowded, close=close)
    assert holds(inside, sets)
    assert width == pytest.approx(1.0, abs=0.1)


def test_a_crowd_alone_does_not_determine_the_genes():
    """Designs within 0.004 of each other do not tell how heap and rate depend on the genes."""
    inside, width = coverage(12, crowded, spread=0, width=0.004)
    assert inside.min() > 0.8
    assert width[1] > 2.5
    assert all(1.1 < one < 2.0 for one in width[[0, 2]])


def exact_evidence(points, off):
    """Evidence of runs without noise; off in uncertainties."""
    return Evidence.of_quantities(points, off[:, None], False)


def test_linear_quantities_give_exact_results():
    slopes = np.array([[12.0, 4.0], [-3.0, 13.0], [5.0, 5.0]])
    at = np.array([0.4, 0.6])
    points = np.random.default_rng(1).uniform(0, 1, (200, 2))
    likelihood = Likelihood(exact_evidence(points, (points - at) @ slopes.T))
    assert likelihood.best == pytest.approx(at, abs=1e-4)
    assert likelihood.chi2 == pytest.approx(0.0, abs=1e-6)
    assert likelihood.information == pytest.approx(slopes.T @ slopes, rel=1e-3)
    half = np.sqrt(3.841 * np.diag(np.linalg.inv(slopes.T @ slopes)))
    for k in range(2):
        low, high = (end[k] for end in likelihood.interval(k))
        assert (low, high) == pytest.approx((at[k] - half[k], at[k] + half[k]), abs=2e-3 * half[k])


def test_an_interval_that_reaches_an_end_is_the_profile_within_the_range():
    """chi^2 = ((x + y - 0.1) / 0.02)^2 + ((x - y) / 0.1)^2, along x; y cannot be below 0."""
    points = np.random.default_rng(2).uniform(0, 0.4, (400, 2))
    total, difference = (points.sum(axis=1) - 0.1) / 0.02, (points[:, 0] - points[:, 1]) / 0.1
    ((low, high), _) = intervals(exact_evidence(points, np.column_stack([total, difference])))
    grid = np.stack(np.meshgrid(*[np.linspace(0, 0.3, 1501)] * 2, indexing="ij"), axis=-1)
    exact = ((grid.sum(axis=-1) - 0.1) / 0.02) ** 2 + ((grid[..., 0] - grid[..., 1]) / 0.1) ** 2
    inside = np.linspace(0, 0.3, 1501)[exact.min(axis=1) < exact.min() + 3.841]
    assert low == pytest.approx(inside.min(), abs=1e-3)
    assert high == pytest.approx(inside.max(), abs=1e-3)


def test_a_response_knows_its_error():
    """Of curved functions with noise: the deviations agree with the variances, which grow where no design was
    run; the gradients are those of mean and variance."""
    rng = np.random.default_rng(5)
    deviations, grown = [], []
    for _ in range(60):
        points, elsewhere = rng.uniform(0, 1, (60, 2)), rng.uniform(0, 1, (50, 2))
        wave, phase = rng.uniform(1, 4, 2), rng.uniform(0, 6)

        def function(u, wave=wave, phase=phase):
            return 5.0 * np.sin(u @ wave + phase)

        response = Response(points, function(points) + 0.5 * rng.normal(size=60), np.full(60, 0.25))
        mean, variance = response.predict(elsewhere)
        deviations.append((mean - function(elsewhere)) / np.sqrt(variance))
        grown.append(response.predict(np.array([1.5, 1.5]))[1][0] / np.median(variance))
    assert np.min(grown) > 5.0
    assert np.mean(np.abs(deviations) < 1.96) == pytest.approx(0.95, abs=0.05)
    assert np.mean(np.square(deviations)) == pytest.approx(1.0, abs=0.4)
    here, steps = np.array([0.7, 0.3]), 1e-5 * np.eye(2)
    for k, gradient in enumerate(response.gradients(here)):
        differences = response.predict(here + steps)[k] - response.predict(here - steps)[k]
        assert gradient == pytest.approx(differences / 2e-5, rel=1e-5)


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


def _moved(design, rng):
    return {name: float(np.clip(value + 0.02 * rng.normal(), 0.0, 1.0)) for name, value in design.items()}


def test_runs_where_few_were_run_are_proposed_and_narrow_the_interval():
    """All first designs are within 0.01 of each other; then three are run near each proposed one."""
    rng = np.random.default_rng(3)
    near = 0.5 + 0.003 * rng.normal(size=(40, 2))
    designs = [{"a": a, "b": b} for a, b in near]

    def noisy(design, seed):
        return {
            "sum": design["a"] + design["b"] + 0.1 * np.random.default_rng(seed).normal(),
            "own": design["b"],
        }

    objective = measured_objective({"sum": (1.0, 0.1), "own": (0.5, 0.05)})
    genes = [Gene("a", "", 0, 1), Gene("b", "", 0, 1)]
    problem = Problem.of_function(noisy, genes, (objective,), code="made")
    found = []
    for _ in range(2):
        outcome = optimize.run(
            problem, method="random", generations=0, options={"population": 1}, starting_designs=designs,
            ensemble={"select": 0, "confirm": 0},
        )  # fmt: skip
        found.append(optimize.calibration(outcome))
        designs += [_moved(design, rng) for design in 3 * found[-1].wanted]
    first, second = found
    (remark,) = first.remarks
    assert (
        "Few designs were run near the ends of the intervals: the error of the simulated sum is up to"
        in remark
    )
    assert first.genes[0].part > 0.7
    assert (second.remarks, second.wanted) == ((), ())
    assert second.genes[0].part == pytest.approx(2 * 1.96 * np.sqrt(0.1**2 + 0.05**2), rel=0.2)


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
