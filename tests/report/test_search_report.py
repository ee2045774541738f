"""The page of a search: its data, its size, and the command that writes it."""

import html
import json
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from tests.cli.conftest import tisim  # noqa: F401
from tests.optimize.shared_case import skip_pictures
from tests.report.searches import GENES, HOSTILE, HOSTILE_CHOICE, HOSTILE_NAME, made_up, problem, searched
from tests.report.test_run_report import facts_of
from tisim import InputError, Scene, optimize, run
from tisim.cli.search import problem_of
from tisim.optimize import Choice, Gene, Objective, Problem, Quantile, Settings
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.report.recorded_designs import best_designs, check_problem, record
from tisim.optimize.report.search_data import read_search, search_names
from tisim.optimize.report.search_page import SearchPageOptions, search_html, search_report
from tisim.optimize.search import search
from tisim.optimize.storage.cache import Cache
from tisim.optimize.tables import LOW


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    """A search for the largest gain: the outcome and the folder."""
    folder = tmp_path_factory.mktemp("one")
    return searched(folder, "gain"), folder


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """A search for gain and mass."""
    folder = tmp_path_factory.mktemp("two")
    return searched(folder, "gain", "mass", method="nsga2"), folder


def page_of(data, **options):
    """The data in a page, and its text without scripts."""
    text = search_html(data, SearchPageOptions(**options))
    facts = json.loads(re.search(r'id="facts">(.*?)</script>', text, re.S)[1])
    body = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.S)
    return facts, html.unescape(re.sub(r"<[^>]*>", "\n", body)), text


@pytest.mark.parametrize("which", ["one", "two"])
def test_the_page_has_all_designs_as_the_search_knows_them(which, request):
    outcome, folder = request.getfixturevalue(which)
    facts, _, _ = page_of(read_search(folder))
    designs = facts["designs"]
    points = list(outcome.generations)
    known = {**outcome.estimates, **outcome.failures}
    assert set(points) == set(known)
    new = np.bincount(designs["gen"], minlength=len(outcome.logbook))
    assert new.tolist() == outcome.logbook.select("designs")
    assert designs["gen"] == sorted(designs["gen"])
    hall = {tuple(individual): individual for individual in outcome.hall}
    decoded = [outcome.problem.genome.decode(point) for point in points]
    assert [one["name"] for one in designs["genes"]] == [gene.name for gene in GENES]
    for gene in designs["genes"]:
        assert gene["values"] == [design[gene["name"]] for design in decoded]
        assert gene["varied"] == (gene["name"] != HOSTILE_NAME)
    assert any(designs["failed"]) == (which == "one")
    assert set(hall) <= set(outcome.held_out)
    for k, point in enumerate(points):
        assert designs["failed"][k] == known[point][0].reason
        assert designs["starts"][k] == known[point][0].starts
    assert [point for k, point in enumerate(points) if designs["best"][k]] == [tuple(outcome.best)]
    ranked = sorted((rank, k) for k, rank in enumerate(designs["rank"]) if rank)
    assert [points[k] for _, k in ranked] == list(hall)
    pairs = zip(outcome.problem.objectives, designs["objectives"], strict=True)
    for m, (objective, shown) in enumerate(pairs):
        assert shown["largest"] == objective.maximise
        for k, point in enumerate(points):
            estimate = known[point][m]
            if not estimate.ok:
                assert shown["values"][k] is None
                continue
            assert shown["values"][k] == pytest.approx(objective.sign * estimate.mean, rel=1e-6)
            assert shown["errors"][k] == pytest.approx(estimate.standard_error, rel=1e-6)
            again = outcome.held_out[point][0][m] if point in outcome.held_out else None
            assert (shown["fresh"][k] is None) == (again is None)
            if again is not None:
                ends = sorted((objective.sign * again.low, objective.sign * again.high))
                assert [shown["low"][k], shown["high"][k]] == pytest.approx(ends, rel=1e-6)
                assert shown["fresh"][k] == pytest.approx(objective.sign * again.mean, rel=1e-6)
                assert designs["freshStarts"][k] == again.starts == 4
    (heat,) = designs["constraints"]
    for value, reason, design in zip(heat["values"], designs["failed"], decoded, strict=True):
        assert value == (None if reason else pytest.approx(300 + 10 * design["speed"], rel=1e-6))


def test_the_runs_of_a_design_are_those_of_its_mean(two):
    outcome, folder = two
    facts, _, _ = page_of(read_search(folder))
    names = facts["quantities"]
    assert names == ["gain", "mass", "heat"]
    designs = facts["designs"]
    assert sum(map(len, designs["runs"])) == len(Cache(folder / "search.h5")) == outcome.evaluations
    for k, runs in enumerate(designs["runs"]):
        for which, key, fresh in (("values", "starts", False), ("fresh", "freshStarts", True)):
            mine = [run for run in runs if run["fresh"] == fresh]
            if designs["failed"][k]:
                continue
            assert len(mine) == designs[key][k]
            if mine:
                mean = np.mean([run["values"][0] for run in mine])
                assert designs["objectives"][0][which][k] == pytest.approx(mean, rel=1e-6)


def test_runs_of_other_searches_are_not_counted(tmp_path):
    first = searched(tmp_path, "gain", generations=0, seed=1)
    again = searched(tmp_path, "gain", generations=0, seed=2, start_from=first.designs[0].genes)
    data = read_search(tmp_path)
    assert data.name == again.name.removeprefix("searches/")
    assert search_names(tmp_path) == sorted(one.name.removeprefix("searches/") for one in (first, again))
    k = next(k for k in range(len(data)) if data.design(k) == first.designs[0].genes)
    for name, outcome in ((None, again), (first.name.removeprefix("searches/"), first)):
        of_it = read_search(tmp_path, name)
        own = next(k for k in range(len(of_it)) if of_it.design(k) == first.designs[0].genes)
        starts = [run.seed for run in of_it.runs[own] if not run.held_out]
        point = list(outcome.generations)[own]
        assert len(starts) == outcome.estimates[point][0].starts
    assert len(data.runs[k]) < len(Cache(tmp_path / "search.h5"))
    with pytest.raises(InputError, match=r"search must be one of demo-.*; received 'none'"):
        read_search(tmp_path, "none")


def test_designs_with_starts_of_their_own_have_their_runs(tmp_path):
    outcome = searched(tmp_path, "gain", ensemble={"common_starts": False, "confirm": 0, "select": 0})
    data = read_search(tmp_path)
    good = [k for k, reason in enumerate(data.facts["failed"]) if not reason]
    assert [len(data.runs[k]) for k in good] == [data.facts["starts"][k] for k in good]
    assert sum(map(len, data.runs)) == outcome.evaluations


def test_choices_of_numbers_and_texts_come_back(tmp_path):
    """A column of both is stored as text."""
    genes = [Choice("kind", ("auto", 3, 4.5)), Gene("x", "", 0.0, 1.0), Choice("wet", (True, False))]
    names = ("best", "best of all")
    asked = Problem.of_function(
        lambda design, seed: [design["x"] + seed % 7, design["x"]], genes, names, name="mixed", code="1"
    )
    settings = Settings(
        method="nsga2",
        generations=1,
        options={"population": 8},
        ensemble={"common_starts": False, "confirm": 0},
    )
    with Cache(tmp_path / "search.h5") as cache:
        outcome = search(asked, FunctionEvaluator(), cache, settings)
    data = read_search(tmp_path)
    decoded = [asked.genome.decode(point) for point in outcome.generations]
    for k, design in enumerate(decoded):
        assert data.design(k) == design
        assert [type(value) for value in data.design(k).values()] == [
            type(value) for value in design.values()
        ]
        assert len(data.runs[k]) == data.facts["starts"][k]
    facts, _, _ = page_of(data)
    assert [panel["title"] for panel in facts["convergence"]] == ["best best", "best best of all"]
    assert facts["convergence"][1]["curves"][0]["values"] == pytest.approx(
        outcome.logbook.select("best best of all"), rel=1e-6
    )


def test_a_statistic_is_as_the_search_has_it(tmp_path):
    """A mean over the runs would be another value."""

    def value(design, seed):
        return design["x"] + np.random.default_rng(seed).exponential()

    objective = Objective("value", lambda result: result.value, statistic=Quantile(0.75))
    asked = Problem.of_function(value, [Gene("x", "", 0.0, 1.0)], [objective], name="quantile")
    outcome = optimize.run(asked, out=tmp_path, generations=1, options={"population": 6})
    facts, text, _ = page_of(read_search(tmp_path))
    known = [outcome.estimates[point][0].mean for point in outcome.generations]
    assert facts["designs"]["objectives"][0]["values"] == pytest.approx(known, rel=1e-6)
    assert "Quantile" in text


def test_hostile_text_stays_text(one):
    _, folder = one
    facts, text, page = page_of(read_search(folder))
    assert len(re.findall("<script", page)) == len(re.findall("</script", page)) == 3
    assert "<img" not in page
    assert HOSTILE in text
    assert HOSTILE_NAME in text
    kind = next(gene for gene in facts["designs"]["genes"] if gene["name"] == "kind")
    assert kind["choices"] == ["steel", HOSTILE_CHOICE]


def test_curves_are_those_of_the_logbook(one):
    outcome, folder = one
    facts, _, _ = page_of(read_search(folder))
    assert facts["generations"] == outcome.logbook.select("gen")
    (panel,) = facts["convergence"]
    best, mean = panel["curves"]
    assert best["values"] == pytest.approx(outcome.logbook.select("best"), rel=1e-6)
    ends = np.array(outcome.logbook.select("mean")) + np.array(outcome.logbook.select("std"))
    assert mean["high"] == pytest.approx(ends, rel=1e-6)
    (mark,) = panel["marks"]
    assert mark["value"] == pytest.approx(outcome.designs[0].values["gain"], rel=1e-6)
    assert [mark["low"], mark["high"]] == pytest.approx(outcome.designs[0].intervals["gain"], rel=1e-6)


def test_an_axis_is_logarithmic_if_all_that_it_shows_is_positive(rng):
    data = made_up(50, rng, ("loss",))
    positive = {name: np.geomspace(1e-3, 1.0, 50).tolist() for name in data.values}
    data = replace(data, values=positive)
    assert page_of(data)[0]["designs"]["objectives"][0]["logarithmic"]
    low = next(name for name in positive if LOW in name)
    data = replace(data, values=positive | {low: [-0.1] * 50})
    assert not page_of(data)[0]["designs"]["objectives"][0]["logarithmic"]


def test_the_worst_designs_are_left_out_to_keep_the_limit(rng, tmp_path):
    data = made_up(3000, rng)
    facts, text, page = page_of(data, limit=0.9)
    kept = facts["designs"]
    count = len(kept["gen"])
    assert len(page.encode()) <= 0.9e6
    assert 500 < count < 3000
    assert f"it has the best {count} of 3000 designs" in text
    assert sum(rank > 0 for rank in kept["rank"]) == 20, "the front stays"
    losses = np.array(data.values["loss"])
    left = np.isin(losses.round(9), np.round(kept["objectives"][0]["values"], 9), invert=True)
    assert np.sort(losses)[:50].tolist() == pytest.approx(
        np.sort(kept["objectives"][0]["values"])[:50], rel=1e-6
    )
    assert np.median(losses[left]) > np.median(kept["objectives"][0]["values"])
    with pytest.raises(InputError, match=r"limit must be at least 0\.5 MB"):
        SearchPageOptions(limit=0.1)
    assert len(page_of(data)[2].encode()) < 3e6


def test_a_search_that_goes_on_is_shown(tmp_path):
    outcome = searched(tmp_path, "gain", max_evaluations=60)
    with Cache(tmp_path / "search.h5") as cache:
        attributes = dict(cache.attributes()[outcome.name])
        cache.put_table(outcome.name, {}, attributes | {"stopped": ""})
        for below in ("designs", "designs/genes", "designs/values", "logbook", "hall_of_fame"):
            table = cache.table(f"{outcome.name}/{below}")
            cache.put_table(f"{outcome.name}/{below}", {head: [] for head in table.columns})
    facts, text, _ = page_of(read_search(tmp_path))
    assert facts["designs"]["gen"] == facts["convergence"] == []
    assert "No generation has finished yet." in text
    assert "not ended" in text


def test_what_cannot_be_recorded_is_refused(one):
    _, folder = one
    data = read_search(folder)
    assert best_designs(data, 2) == [data.facts["best"].index(1), data.facts["rank"].index(2)]
    front = made_up(300, np.random.default_rng(1))
    ranks = [front.facts["rank"][k] for k in best_designs(front, 5)]
    assert ranks == [1, 2, 8, 14, 20], "spread along the front"
    check_problem(data, problem("gain"))
    with pytest.raises(InputError, match=r"problem must be the one of the search demo-.*objectives"):
        check_problem(data, problem("gain", "mass"))
    with pytest.raises(InputError, match="problem must be one with particles"):
        record(data, problem("gain"), [0], 15.0)


def test_the_command_finds_what_it_has_been_given(tisim, one, tmp_path):  # noqa: F811
    _, folder = one
    assert tisim("report", folder, "--to", "p/page.html") == (0, "p/page.html\n", "")
    assert facts_of(tmp_path / "p/page.html")[0]["name"].startswith("demo-genetic-0-")
    assert tisim("report", folder / "search.h5", "--to", "p/page.html")[0] == 0, "its own page is replaced"
    (tmp_path / "mine.html").write_text("the user's own")
    for arguments, message in (
        (
            ("--checks", "a.csv"),
            f"options must be for the page of a search, as {folder} holds one; received '--checks'",
        ),
        (("--world", 0, "--field", "x"), "received '--world, --field'"),
        (("--to", "a.txt"), "--to must be a file NAME.html; received 'a.txt'"),
        (("--limit", 0.1), "limit must be at least 0.5 MB, and finite; received 0.1"),
        (("--search", "x"), "search must be one of demo-genetic-0-"),
        (("--designs", 2), "--problem must be given for a search that was begun in Python; received None"),
        (("--designs", 2, "--problem", "none"), "case must be one of agglomeration"),
        (("--designs", 2, "--problem", "agglomeration"), "problem must be the one of the search demo-"),
        (("--to", "mine.html"), "output folder must be without files that tisim has not written"),
    ):
        code, out, err = tisim("report", folder, *arguments)
        assert (code, out) == (2, ""), (arguments, err)
        assert message in err, err
    assert (tmp_path / "mine.html").read_text() == "the user's own"
    (tmp_path / "none").mkdir()
    code, _, err = tisim("report", "none")
    assert code == 2
    assert "folder must be the folder of a run, a search or 'tisim cost'; received 'none', without" in err
    assert "FILE must be an existing folder or file; received 'gone'" in tisim("report", "gone")[2]


def test_the_command_of_a_search_is_kept(tisim, own_file):  # noqa: F811
    file = own_file(
        "case.py",
        "from tisim.optimize import Gene, Problem\n"
        "def value(design):\n    return design['x'] + design['y']\n"
        "PROBLEM = Problem.of_function(value, [Gene('x', 'm', 0.0, 1.0), Gene('y', '', 0.0, 1.0)])\n",
    )
    words = ["optimize", str(file), "--generations", "1", "--population", "4", "--fix", "y=0.5"]
    assert tisim(*words, "--out", "s")[0] == 0
    assert list(read_search("s").command) == words
    assert problem_of(words[1:]).genome.names == ("x", "y")
    assert tisim("report", "s")[0] == 0
    facts, text = facts_of(search_report("s", "t.html"))
    assert facts["command"] == f"tisim optimize {file} --generations 1 --population 4 --fix y=0.5"
    assert facts["command"] in text


@pytest.mark.long
def test_the_best_designs_of_a_case_are_run_for_their_clouds(tisim, tmp_path, monkeypatch):  # noqa: F811
    # The page of a search does not show them.
    skip_pictures(monkeypatch.setattr)
    words = ("agglomeration", "--size", "small", "--generations", 0, "--population", 3, "--out", "s")
    assert tisim("optimize", *words, "--set", "search.ensemble.confirm=2")[0] == 0
    assert tisim("report", "s", "--designs", 2)[0] == 0
    facts, text = facts_of(tmp_path / "s/report.html")
    data = read_search("s")
    chosen = best_designs(data, 2)
    assert [one["design"] for one in facts["recordings"]] == chosen
    assert facts["command"].startswith("tisim optimize agglomeration --size small --generations 0")
    assert "Start and end" in text
    asked = Scene.from_toml("s/best_scene.toml")
    for one in facts["recordings"]:
        scene = Scene.from_dict(tomllib.loads(facts["scenes"][str(one["design"])]))
        assert scene.seed == data.runs[one["design"]][0].seed
        frames = one["trajectory"]
        assert frames["times"][0] == 0
        assert frames["times"][-1] == pytest.approx(scene.duration)
        assert frames["counts"][0] == scene.particles.number
    best = Scene.from_dict(tomllib.loads(facts["scenes"][str(chosen[0])]))
    assert best.digest() == asked.digest()
    # Its particles at the end are those of an own run.
    result = run(best)
    assert facts["recordings"][0]["trajectory"]["counts"][-1] == len(result.state["id"])
    assert tisim("report", "s")[0] == 0
    assert facts_of(tmp_path / "s/report.html")[0]["recordings"] == []
