"""Statistics of the user in the logbook, which DEAP computes."""

import functools
import math
import operator

import numpy as np
import pytest
from deap import tools

from tests.optimize.fake_runs import FakeCache, FakeEvaluator, bowl, fake_problem
from tisim import InputError, optimize
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.generation_log import statistics
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.objective import Objective
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache

ONE = EnsembleSettings(min_starts=1, select=0, confirm=0)
TWO = (Objective("low", lambda r: r.value), Objective("high", lambda r: 2 * r.value, "m", maximise=True))
first_cost = operator.itemgetter(0)


def costs_of(**functions):
    """Statistics of the costs of the first objective."""
    of_costs = tools.Statistics(lambda individual: individual.fitness.values[0])
    for name, function in functions.items():
        of_costs.register(name, function)
    return of_costs


def run(given, evaluator=None, cache=None, problem=None, **settings):
    settings = Settings(
        **{"method": "zohdi", "generations": 2, "ensemble": ONE, "statistics": given, **settings}
    )
    return search(
        problem or fake_problem(),
        evaluator or FakeEvaluator(),
        FakeCache() if cache is None else cache,
        settings,
    )


def test_statistics_are_columns_and_change_nothing_else(tmp_path):
    plain = run(None)
    with Cache(tmp_path / "search.h5") as cache:
        found = run(costs_of(avg=np.mean, spread=np.std, worst=max), cache=cache)
    log = found.logbook
    assert log.select("avg") == log.select("mean")
    assert log.select("spread") == log.select("std")
    assert all(worst > mean for worst, mean in zip(*log.select("worst", "mean"), strict=True))
    own = ("avg", "spread", "worst")
    assert [{k: v for k, v in row.items() if k not in own} for row in log] == list(plain.logbook)
    assert (found.name, list(found.hall)) == (plain.name, list(plain.hall))
    assert found.to_dict()["logbook"]["worst"] == log.select("worst")
    assert all(type(value) is float for value in log.select("avg"))
    table = Cache(tmp_path / "search.h5").table(f"{found.name}/logbook").columns
    assert list(table["worst"]) == log.select("worst")


def test_several_statistics_are_chapters(tmp_path):
    given = tools.MultiStatistics(cost=costs_of(), gene=tools.Statistics(first_cost))
    given.register("mean", np.mean)
    with Cache(tmp_path / "search.h5") as cache:
        found = run(given, cache=cache)
    chapters = found.logbook.chapters
    assert sorted(chapters) == ["cost", "gene"]
    assert chapters["cost"].select("gen", "mean") == found.logbook.select("gen", "mean")
    assert chapters["gene"].select("mean") != found.logbook.select("mean")
    table = Cache(tmp_path / "search.h5").table(f"{found.name}/logbook").columns
    assert list(table["gene mean"]) == chapters["gene"].select("mean")
    assert "cost gen" not in table


def test_statistics_of_several_objectives_are_a_column_for_each():
    given = tools.Statistics(lambda individual: individual.fitness.values)
    given.register("avg", np.mean, axis=0)
    given.register("all", np.min)
    log = run(given, problem=fake_problem(objective=TWO), method="nsga2", options={"population": 8}).logbook
    assert list(log[0])[-3:] == ["avg low", "avg high (m)", "all"]
    assert np.allclose(log.select("avg high (m)"), -2 * np.array(log.select("avg low")), rtol=1e-12)


def test_a_generation_of_failed_designs_has_no_statistics():
    def function(design, seed):
        return "lost" if design["x0"] < 2 else bowl(design, seed)

    for given in (costs_of(worst=max), tools.MultiStatistics(cost=costs_of(worst=max))):
        found = run(given, FakeEvaluator(function), generations=0)
        log = found.logbook.chapters["cost"] if isinstance(given, dict) else found.logbook
        assert [math.isnan(value) for value in log.select("worst")] == [True]


def test_the_columns_of_the_program_are_the_same_as_by_numpy():
    population = [Individual([0.1 * k]) for k in range(3)]
    problem = fake_problem(objective=(Objective("high", lambda r: r.value, maximise=True),))
    assert statistics(problem, population, [])["best"] == -math.inf
    assert math.isnan(statistics(problem, population, [])["mean"])
    found = run(None)
    first = [one[0].mean for one in list(found.estimates.values())[:20]]
    row = found.logbook[0]
    assert (row["mean"], row["std"], row["best"]) == (np.mean(first), np.std(first), min(first))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (len, "search.statistics must be a deap.tools.Statistics or MultiStatistics; received <built-in"),
        (costs_of(std=np.std), r"of names that no other column has .*; received \['std'\]"),
        (tools.MultiStatistics(best=costs_of(of=min)), r"received \['best'\]"),
        (tools.MultiStatistics(cost=costs_of(gen=min)), r"received \['gen'\]"),
        (tools.MultiStatistics(cost=tools.MultiStatistics()), "a MultiStatistics of deap.tools.Statistics"),
        (costs_of(all=list), r"statistic all must return a number; received \[1.0, 2.0, "),
        (costs_of(word=lambda costs: "low"), "statistic word must return a number; received 'low'"),
        (
            costs_of(bad=lambda costs: costs[0].x),
            "received AttributeError: 'float' object has no attribute 'x'",
        ),
    ],
)
def test_unfit_statistics_are_refused_before_anything_runs(given, message):
    problem = optimize.Problem.of_function(_not_called, [optimize.Gene("x", "", 0.0, 1.0)], name="f")
    with pytest.raises(InputError, match=message) as refused:
        optimize.run(problem, statistics=given)
    assert "\n" not in str(refused.value)


def _not_called(design):
    raise AssertionError


def test_a_statistic_that_fails_later_ends_the_search_in_one_line():
    calls = []

    def later(costs, at):
        calls.append(costs)
        return costs[99] if len(calls) > at else 0.0

    with pytest.raises(InputError, match=r"search.statistics must be functions of .*; received IndexError"):
        run(costs_of(late=functools.partial(later, at=3)))
