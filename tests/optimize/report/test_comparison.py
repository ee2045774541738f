"""Comparison of methods: equal numbers of runs, held-out seeds that no search has used, and a ranking
table."""

import csv
import io

import numpy as np
import pytest
from rich.console import Console

from tests.optimize.drift_case import CASE
from tests.optimize.fake_runs import FakeCache, FakeEvaluator, bowl, fake_problem
from tisim import InputError
from tisim.cases import case as catalogue
from tisim.cli.main import main
from tisim.files import output_folder
from tisim.optimize import Gene, Problem, ResultConstraint
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.problem.objective import Objective
from tisim.optimize.report import comparison
from tisim.optimize.report.comparison import FRESH, MethodResult, compare, plan, settings_of
from tisim.optimize.storage.cache import Cache

BASE = {
    "method": "zohdi", "options": {"population": 10, "parents": 4}, "target": 0.1, "patience": 1,
    "ensemble": {"min_starts": 2, "block": 2, "max_starts": 4, "tolerance": 0.05, "confirm": 9},
}  # fmt: skip


def noisy(design, seed):
    return bowl(design, seed + int(1e9 * design["x0"]), noise=0.1)


def compared(methods, evaluations=120, repeats=3, fresh=8, evaluator=None, cache=None, problem=None):
    searches = plan(problem or fake_problem(6), BASE, methods, evaluations, repeats, fresh)
    cache = FakeCache() if cache is None else cache
    return list(compare(searches, evaluator or FakeEvaluator(noisy), cache))


def test_methods_get_equal_runs_and_held_out_seeds():
    evaluator, cache = FakeEvaluator(noisy), FakeCache()
    results = compared(["random", "zohdi", "cma-es"], evaluator=evaluator, cache=cache)
    assert [(f.method, f.repeat) for f in results] == [
        (method, repeat) for repeat in range(3) for method in ("random", "zohdi", "cma-es")
    ]
    assert {f.evaluations for f in results} <= {119, 120}
    fresh = [start_seed(FRESH, k) for k in range(8)]
    searched = {start_seed(seed, k) for seed in range(3) for k in range(13)}
    assert not searched & set(fresh)
    assert (
        len(evaluator.digests) == len(set(evaluator.digests)) == sum(f.evaluations for f in results) + 9 * 8
    )
    by_design = {}
    for record in cache.records_by_key.values():
        if record.seed in fresh:
            by_design.setdefault(tuple(record.design.values()), []).append(record.values["fitness"])
    assert sorted(np.mean(values) for values in by_design.values()) == pytest.approx(
        sorted(f.fresh.mean for f in results), rel=1e-12
    )
    again = FakeEvaluator(noisy)
    assert compared(["random", "zohdi", "cma-es"], evaluator=again, cache=cache) == results
    assert again.digests == []


def rows(problem, results):
    console = Console(width=120, record=True, file=io.StringIO())
    console.print(comparison.table(problem, results))
    return [line.split() for line in console.export_text().splitlines()]


def test_table_ranks_by_the_median_from_fresh_starts():
    results = compared(["random", "zohdi"], repeats=5)
    lines_of_table = rows(fake_problem(6), results)
    heading = next(line for line in lines_of_table if line[0] == "method")
    lines = [line for line in lines_of_table if line[0] in ("random", "zohdi")]
    medians = {}
    for name, searches, _, *numbers in lines:
        mine = [f for f in results if f.method == name]
        assert int(searches) == len(mine) == 5
        values = [f.fresh.mean for f in mine]
        claimed = np.median([f.claimed.mean for f in mine])
        expected = [np.median(values), min(values), max(values), claimed]
        assert [float(number) for number in numbers[:4]] == pytest.approx(expected, rel=1e-3)
        medians[name] = np.median(values)
    assert medians["zohdi"] < medians["random"]
    assert [line[0] for line in lines] == ["zohdi", "random"]
    assert "median" in heading
    assert lines_of_table[0] == ["fitness"], "the objective, above"
    large = fake_problem(6, objective=(Objective("height", lambda r: -r.value, "m", maximise=True),))
    turned = compared(["random", "zohdi"], repeats=5, problem=large)
    assert [line[0] for line in rows(large, turned) if line[0] in medians] == ["zohdi", "random"]
    numbers = list(csv.reader(comparison.as_csv(large, turned).decode().splitlines()))
    assert [float(row[3]) for row in numbers[1:]] == [-f.fresh.mean for f in results]


def test_stopping_rules_and_options_of_the_case():
    settings = settings_of(fake_problem(), BASE, "zohdi", 50, 3)
    assert (settings.target, settings.patience, settings.max_evaluations, settings.seed) == (
        None,
        None,
        50,
        3,
    )
    assert (settings.options.population, settings.ensemble.confirm, settings.ensemble.block) == (10, 0, 2)
    assert settings_of(fake_problem(), BASE, "restart", 50, 3).options.parents == 4
    assert settings_of(fake_problem(), BASE, "cma-es", 50, 3).options.population is None


def test_incomparable_objects_are_refused():
    for arguments, message in (
        ({"methods": ["zohdi", "zohdi"]}, "methods must be one or more, all different"),
        ({"methods": []}, "methods must be one or more"),
        ({"repeats": 0}, "repeats must be within"),
        ({"fresh": 1}, "fresh starts must be at least 2; received 1"),
        ({"evaluations": 0}, "evaluations must be at least 1"),
        ({"methods": ["zohdi", "simplex"]}, "method must be one of .*; received 'simplex'"),
    ):
        usual = {"methods": ["random"], "evaluations": 9, "repeats": 1, "fresh": 4, "problem": fake_problem()}
        with pytest.raises(InputError, match=message):
            plan(**{**usual, "base": BASE, **arguments})


def constrained(design, seed):
    """Least value at the smallest x, whose load must be at least 0.5 N; every start has its own load."""
    load = design["x"] + 0.3 * np.random.default_rng(seed).normal()
    return {"value": design["x"], "load": load}


LOAD = ResultConstraint("load", lambda result: result.value["load"], "N", at_least=0.5)
LIMITED = Problem.of_function(
    constrained, (Gene("x", "m", 0.0, 1.0),), (Objective("value", lambda result: result.value["value"]),),
    constraints=(LOAD,),
)  # fmt: skip


def test_designs_that_violate_a_constraint_are_marked():
    """Two starts of a search make a design with x below 0.5 feasible by luck in some searches."""
    searches = plan(LIMITED, {"method": "random"}, ["random", "nsga2"], 60, 6, 16)
    results = list(compare(searches, FunctionEvaluator(), FakeCache()))
    seeds = [start_seed(FRESH, k) for k in range(16)]
    noise = np.mean([constrained({"x": 0.0}, seed)["load"] for seed in seeds])
    for f in results:
        (load,) = f.limits
        assert load.mean == pytest.approx(f.fresh.mean + noise)
        assert load.low < load.mean < load.high
        known = "no" if load.mean < 0.5 else "yes" if load.low >= 0.5 else "unproven"
        assert comparison.verdict(LIMITED, f) == known
    assert len({comparison.verdict(LIMITED, f) for f in results}) > 1
    lines = list(csv.DictReader(comparison.as_csv(LIMITED, results).decode().splitlines()))
    assert [line["feasible"] for line in lines] == [comparison.verdict(LIMITED, f) for f in results]
    label = "load, at least 0.5 N, fresh starts"
    assert [float(line[label]) for line in lines] == [f.limits[0].mean for f in results]
    assert [float(line["load 95 % low, fresh starts"]) for line in lines] == [
        f.limits[0].low for f in results
    ]
    for name, searches, _, *counts in (line[:6] for line in rows(LIMITED, results) if line[0] == "random"):
        mine = [comparison.verdict(LIMITED, f) for f in results if f.method == name]
        assert counts == [str(mine.count(answer)) for answer in ("yes", "unproven", "no")]
        assert int(searches) == len(mine) == 6


def known(mean, half=0.01):
    return FitnessEstimate(mean, half, mean - half, mean + half, 16, False)


def test_a_method_whose_designs_violate_a_constraint_is_behind():
    results = [
        MethodResult(method, k, 60, known(value), known(value), (known(load),))
        for method, found in {
            "cma-es": [(0.1, 0.30), (0.2, 0.31), (0.9, 0.6)],
            "random": [(0.6, 0.60), (0.7, 0.55), (0.8, 0.505)],
            "zohdi": [(0.05, 0.1), (0.05, 0.2), (0.05, 0.3)],
        }.items()
        for k, (value, load) in enumerate(found)
    ]
    table = {line[0]: line[3:] for line in rows(LIMITED, results) if line[0] in {f.method for f in results}}
    assert list(table) == ["random", "cma-es", "zohdi"]
    assert table["random"] == ["2", "1", "0", "0.7", "0.6", "0.8", "0.7", "0.01"]
    assert table["cma-es"] == ["1", "0", "2", "-", "0.9", "0.9", "0.9", "0.01"]
    assert table["zohdi"] == ["0", "0", "3", "-", "-", "-", "-", "-"]


@pytest.mark.parametrize("wrong", [("--methods", "simplex"), ("--repeats", "0"), ("--executor", "nobody")])
def test_a_refused_comparison_keeps_earlier_files(tmp_path, monkeypatch, capsys, wrong):
    monkeypatch.setattr(catalogue, "every", lambda: {CASE.name: CASE})
    output_folder.claim(tmp_path, comparison.COMPARISON_FILES)
    with Cache(tmp_path / "compare.h5") as cache:
        cache.put_table("other", {})
    content = (tmp_path / "compare.h5").read_bytes()
    with pytest.raises(SystemExit) as exit_:
        main(["compare", "drift", "--out", str(tmp_path), "--overwrite", *wrong])
    assert (exit_.value.code, "must be" in capsys.readouterr().err) == (2, True)
    assert (tmp_path / "compare.h5").read_bytes() == content


@pytest.mark.slow
def test_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(catalogue, "every", lambda: {CASE.name: CASE})
    command = ["compare", "drift", "--methods", "random, cma-es", "--evaluations", "60", "--repeats", "2"]
    with pytest.raises(SystemExit) as exit_:
        main([*command, "--set", "search.ensemble.max_starts=4", "--fresh-starts", "4"])
    assert exit_.value.code == 0
    out, err = capsys.readouterr()
    first = {line.split()[0] for line in out.splitlines() if line}
    assert {"random", "cma-es"} <= first
    assert "cma-es, search 2 of 2: 60 runs" in err
    with (tmp_path / "out" / "compare-drift" / "compare.csv").open() as file:
        assert len(list(csv.reader(file))) == 5
    store = tmp_path / "out" / "compare-drift" / "compare.h5"
    runs = len(Cache(store))
    for more, code, message in (
        (["--evaluations", "61", "--repeats", "1"], 0, f"compare.h5, which has {runs} runs"),
        (["--precision", "f32"], 2, "free of a comparison of another problem; received"),
        (["--fresh"], 2, "without results of a comparison (or give --overwrite)"),
    ):
        with pytest.raises(SystemExit) as exit_:
            main([*command, "--set", "search.ensemble.max_starts=4", "--fresh-starts", "4", *more])
        assert exit_.value.code == code
        assert message in " ".join(capsys.readouterr().err.split())
    runs_after = len(Cache(store))
    with monkeypatch.context() as patch:
        patch.setattr(comparison, "compare", lambda *arguments: iter(()))
        patch.setattr(comparison, "table", lambda *arguments: "")
        with pytest.raises(SystemExit):
            main([*command, "--overwrite"])
    assert (runs_after >= runs, len(Cache(store))) == (True, 0)
    with pytest.raises(SystemExit) as exit_:
        main(["compare", "drift", "--methods", "simplex"])
    assert exit_.value.code == 2
    assert "received 'simplex'" in capsys.readouterr().err
