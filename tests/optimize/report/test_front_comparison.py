"""Comparison of methods for several objectives, by hypervolumes that are known or computed again."""

import csv
import io

import numpy as np
import pytest
from rich.console import Console

from tests.optimize.fake_runs import FakeCache, FakeEvaluator, fake_problem
from tests.optimize.test_several import OBJECTIVES, zdt1
from tisim.optimize import Gene, Problem, ResultConstraint
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.report import comparison
from tisim.optimize.report.comparison import FRESH, compare, plan
from tisim.optimize.report.front_comparison import MOST_DESIGNS, FrontResult, hypervolumes

BASE = {"method": "random", "ensemble": {"min_starts": 1, "max_starts": 1}}
PROBLEM = fake_problem(3, objective=OBJECTIVES)


def front(fresh, claimed=None, excesses=None, method="random", repeat=0):
    fresh = np.array(fresh, float)
    return FrontResult(
        method, repeat, 60, fresh if claimed is None else np.array(claimed, float), fresh,
        np.zeros(len(fresh)) if excesses is None else np.array(excesses, float),
    )  # fmt: skip


def test_hypervolumes_of_known_fronts():
    """The box is 0 to 1 in both objectives, and 1.1 with its margin."""
    corner, two, worst = front([[0, 0]]), front([[0, 1], [0.5, 0.5], [1.0, 0.0], [0.6, 0.6]]), front([[1, 1]])
    volumes = np.array(hypervolumes([corner, two, worst])) * 1.1**2
    # Of the second: strips from 0, 0.5 and 1 to 1.1, of heights 0.1, 0.6 and 1.1.
    staircase = 0.5 * 0.1 + 0.5 * 0.6 + 0.1 * 1.1
    np.testing.assert_allclose(volumes[:, 0], [1.21, staircase, 0.01], rtol=1e-12)
    np.testing.assert_allclose(volumes[:, 1], volumes[:, 0])
    scaled = [front(one.fresh * [1e-3, 1e5] + [7.0, -3e5]) for one in (corner, two, worst)]
    np.testing.assert_allclose(hypervolumes(scaled), np.array(volumes) / 1.21, rtol=1e-9)


def test_claims_failures_and_violations():
    """A claimed value beyond the box counts to its edge; a failed or infeasible design does not count."""
    results = [
        front([[0, 1], [1, 0]], claimed=[[-5.0, 0.0], [0.0, 3.0]]),
        front([[0, 0], [1, 1], [np.nan, 0]], excesses=[0.2, 0.0, 0.0]),
        front([[0, 0]], excesses=[1.0]),
    ]
    (_, claimed), (fresh, _), none = hypervolumes(results)
    assert claimed * 1.21 == pytest.approx(1.1 * 1.1)
    assert fresh * 1.21 == pytest.approx(0.01)
    assert none[0] == 0.0
    assert [one.violated for one in results] == [0, 1, 1]
    assert hypervolumes(results[2:]) == [(0.0, 0.0)]


def test_three_objectives_by_counting():
    rng = np.random.default_rng(1)
    some = rng.random((12, 3))
    every = np.vstack([some, np.zeros((1, 3)), np.ones((1, 3))])
    results = [front(some), front(every[12:])]
    samples = 1.1 * rng.random((200_000, 3))
    part = (some[:, None] <= samples[None]).all(axis=2).any(axis=0).mean()
    assert hypervolumes(results)[0][0] == pytest.approx(part, abs=5e-3)


def noisy(design, seed):
    return zdt1(design, seed, noise=0.05)


@pytest.fixture(scope="module")
def results():
    searches = plan(PROBLEM, BASE, ["random", "nsga2"], 120, 3, 4)
    return list(compare(searches, FakeEvaluator(noisy), FakeCache()))


def test_fronts_are_run_again_from_the_held_out_starts(results):
    assert [(one.method, one.repeat, one.evaluations) for one in results] == [
        (method, repeat, 120) for repeat in range(3) for method in ("random", "nsga2")
    ]
    seeds = [start_seed(FRESH, k) for k in range(4)]
    shift = np.mean(
        [0.05 * np.random.default_rng(seed).normal(size=2) * [-1.0, 1.0] for seed in seeds], axis=0
    )
    for one in results:
        assert 1 <= len(one.fresh) <= MOST_DESIGNS
        # The costs of ZDT1 without noise are on or above its front.
        gain, price = (one.fresh * [-1.0, 1.0] - shift).T
        assert (price >= 1 - np.sqrt(np.maximum(-gain, 0.0)) - 1e-9).all()
        assert np.abs(one.claimed - one.fresh).max() > 1e-3


def test_the_table_ranks_by_the_median_hypervolume(results):
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(comparison.table(PROBLEM, results))
    lines = [line.split() for line in console.export_text().splitlines()]
    rows = {line[0]: line[1:] for line in lines if line and line[0] in ("random", "nsga2")}
    assert list(rows) == ["nsga2", "random"]
    volumes = np.array(hypervolumes(results))
    for method, cells in rows.items():
        mine = [one.method == method for one in results]
        fresh, claimed = volumes[mine].T
        expected = [np.median(fresh), fresh.min(), fresh.max(), np.median(claimed)]
        assert [float(cell) for cell in cells[-4:]] == pytest.approx(expected, abs=1e-4)
        assert cells[0] == "3"
        assert cells[2] == str(sum(len(one.fresh) for one in results if one.method == method))
    assert np.median(volumes[[one.method == "nsga2" for one in results], 0]) > np.median(
        volumes[[one.method == "random" for one in results], 0]
    )


def test_the_file_has_a_line_for_each_design(results):
    lines = list(csv.DictReader(comparison.as_csv(PROBLEM, results).decode().splitlines()))
    assert len(lines) == sum(len(one.fresh) for one in results)
    first = lines[: len(results[0].fresh)]
    assert [float(line["gain (1/s), fresh starts"]) for line in first] == (-results[0].fresh[:, 0]).tolist()
    assert [float(line["price, claimed"]) for line in first] == results[0].claimed[:, 1].tolist()
    assert {float(line["hypervolume"]) for line in first} == {hypervolumes(results)[0][0]}


def bounded(design, seed):
    return {"gain": -design["x"], "price": design["x"], "load": design["x"]}


def test_designs_that_violate_a_constraint_are_counted():
    problem = Problem.of_function(
        bounded,
        (Gene("x", "m", 0.0, 1.0),),
        tuple(OBJECTIVES[0].__class__(name, lambda r, k=name: r.value[k]) for name in ("gain", "price")),
        constraints=(ResultConstraint("load", lambda r: r.value["load"], "N", at_least=0.5),),
    )
    (one,) = compare(
        plan(problem, {"method": "random"}, ["random"], 40, 1, 2), FunctionEvaluator(), FakeCache()
    )
    assert one.violated == 0
    assert one.fresh[:, 0].max() <= -0.5
    assert comparison.summary(problem, one).endswith("of the front, 0 of them infeasible")
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(comparison.table(problem, [one]))
    assert "violated" in console.export_text()
