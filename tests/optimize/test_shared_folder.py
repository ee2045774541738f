"""Searches of one problem in one folder: in sequence, at once, and killed; and warm starts."""

import csv
import json
import random
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from tests.optimize.cache_files import PIPE, worker
from tests.optimize.shared_case import problem, searched, skip_pictures
from tisim import InputError, optimize
from tisim.optimize.problem.constraint import DesignConstraint
from tisim.optimize.storage.cache import Cache, existing
from tisim.optimize.storage.maintenance import verify

METHODS = ("zohdi", "cma-es", "random", "restart")


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Skip pictures, and fsync, as no file of these tests outlives them."""
    skip_pictures(monkeypatch.setattr)
    monkeypatch.setattr("os.fsync", lambda file: None)


def tables_of(folder, name):
    """The tables of a search in its file, except for dates."""
    cache = Cache(folder / "search.h5")
    return {
        table.removeprefix(name): repr(cache.table(table).columns)
        for table in cache.tables()
        if table.startswith(f"{name}/")
    }


def test_each_search_equals_the_same_search_alone(tmp_path):
    for method in ("zohdi", "cma-es"):
        alone = searched(tmp_path / method, method, 1)
        beside = searched(tmp_path / "both", method, 1)
        assert (beside.designs, beside.name) == (alone.designs, alone.name)
        assert tables_of(tmp_path / "both", beside.name) == tables_of(tmp_path / method, alone.name)
    file = optimize.read(tmp_path / "both")
    assert [name.rsplit("-", 1)[0] for name in file.searches] == ["noisy-cma-es-1", "noisy-zohdi-1"]
    pytest.importorskip("pandas")
    assert len(file.hall(file.searches[0])) == 6
    assert len(file.logbook(file.searches[1])) == 4


def test_a_search_reuses_the_runs_of_others(tmp_path):
    """Searches with more generations, with the same first generation, and with the same starting designs."""
    first = searched(tmp_path, "zohdi", 1)
    more = searched(tmp_path, "zohdi", 1, generations=5)
    assert first.name == more.name
    assert 0 < more.evaluations < more.hits
    restart = searched(tmp_path, "restart", 1, generations=0, ensemble={"confirm": 0, "select": 0})
    assert (restart.evaluations, restart.hits > 0) == (0, True)
    other = searched(tmp_path, "zohdi", 2)
    assert other.hits == 0, "other starts"
    designs = [{"x": 0.2, "y": 0.5}]
    searched(tmp_path, "cma-es", 1, starting_designs=designs)
    again = searched(tmp_path, "random", 1, starting_designs=designs, generations=0)
    assert again.hits >= 2


@pytest.mark.parametrize("methods", [METHODS[:2], pytest.param(METHODS, marks=pytest.mark.slow)])
def test_several_processes_with_different_methods(tmp_path, methods):
    folder = tmp_path / "both"
    at_work = [worker("shared", folder, method, 1, stderr=subprocess.PIPE) for method in methods]
    for process in at_work:
        _, err = process.communicate()
        assert process.returncode == 0, err
    report = verify(folder / "search.h5")
    assert report.ok
    assert report.duplicates == 0
    names = {}
    for method in methods:
        alone = searched(tmp_path / method, method, 1)
        names[alone.name.removeprefix("searches/")] = tmp_path / method
        assert tables_of(folder, alone.name) == tables_of(tmp_path / method, alone.name)
    shown = json.loads((folder / "shown.json").read_text())["search"]
    assert (folder / "best.csv").read_bytes() == (names[shown] / "best.csv").read_bytes()


def test_a_warm_start_learns_and_runs_the_best_first(tmp_path):
    first = searched(tmp_path, "zohdi", 1)
    by_design = {}
    for record in existing(tmp_path / "search.h5").records():
        by_design.setdefault(tuple(record.design.values()), []).append(record.values["value"])
    warm = searched(tmp_path, "gaussian-process", 2, warm_start=True)
    table = existing(tmp_path / "search.h5").table(f"{warm.name}/warm_start").columns
    assert {(x, y) for x, y in zip(table["x"], table["y"], strict=True)} == set(by_design)
    for x, y, value, count in zip(table["x"], table["y"], table["value"], table["starts"], strict=True):
        assert value == pytest.approx(np.mean(by_design[x, y]), rel=1e-12)
        assert count == len(by_design[x, y])
    assert warm.logbook[0]["designs"] == 6 + 8, "the best, and a batch by the surrogate"
    ran = [warm.problem.genome.decode(point) for point in warm.estimates][:6]
    assert first.designs[0].genes in ran
    cold = searched(tmp_path / "cold", "gaussian-process", 2)
    assert cold.logbook[0]["best"] > warm.logbook[0]["best"]


def test_a_resumed_warm_start_uses_its_original_data(tmp_path):
    """Neither its own runs nor later runs of others are part of its warm start."""
    searched(tmp_path, "zohdi", 1)
    warm = searched(tmp_path, "gaussian-process", 2, warm_start=True)
    assert searched(tmp_path, "gaussian-process", 2, generations=0).name != warm.name
    searched(tmp_path, "random", 5)
    again = searched(tmp_path, "gaussian-process", 2, warm_start=True)
    assert (again.name, again.evaluations, again.designs) == (warm.name, 0, warm.designs)
    more = searched(tmp_path, "gaussian-process", 2, warm_start=True, generations=4)
    assert (more.name, list(more.logbook)[:4]) == (warm.name, list(warm.logbook))
    other = searched(tmp_path, "gaussian-process", 3, warm_start=True, generations=0)
    assert other.name != warm.name


def test_a_warm_start_learns_only_from_designs_in_its_range(tmp_path):
    constraint = DesignConstraint("place", lambda design: design["x"], "m", at_most=0.9)
    whole = problem(constraints=[constraint])
    optimize.run(whole, out=tmp_path, method="random", seed=1, generations=0)
    all_x = {record.design["x"] for record in existing(tmp_path / "search.h5").records()}
    x, y = whole.genome.genes
    half = {k for k in all_x if k <= 0.5}
    assert 0 < len(half) < len(all_x)
    for narrow, learned in (
        (replace(whole, genome=optimize.Genome((replace(x, high=0.5), y))), half),
        (replace(whole, constraints=[replace(constraint, at_most=0.5)]), half),
        (whole.fix(y=0.25), set()),
    ):
        warm = optimize.run(narrow, out=tmp_path, method="genetic", seed=4, generations=0, warm_start=True)
        told = existing(tmp_path / "search.h5").table(f"{warm.name}/warm_start").columns["x"]
        assert set(told) & all_x == learned
        if learned:
            assert max(told) <= 0.5


def test_a_warm_start_needs_a_folder():
    with pytest.raises(InputError, match="warm_start must be given with a folder, out; received True"):
        optimize.run(problem(), warm_start=True)


@pytest.mark.slow
def test_a_killed_search_beside_another_ends_as_if_undisturbed(tmp_path):
    """A warm start is killed repeatedly while another search uses the folder."""
    for folder in ("whole", "cut"):
        searched(tmp_path / folder, "zohdi", 1)
    whole = searched(tmp_path / "whole", "gaussian-process", 2, warm_start=True)
    rng = random.Random(5)
    folder = tmp_path / "cut"
    kept = len(existing(folder / "search.h5"))
    with worker("shared", folder, "gaussian-process", 2, "warm", pipesize=PIPE) as process:
        assert process.stdout.readline().startswith("stored")
        process.kill()
    for _ in range(2):
        with (
            worker("shared", folder, "random", 3, pipesize=PIPE) as beside,
            worker("shared", folder, "gaussian-process", 2, "warm", pipesize=PIPE) as process,
        ):
            for _ in range(rng.randint(1, 15)):
                if not process.stdout.readline():
                    break
            process.kill()
            beside.kill()
        assert verify(folder / "search.h5").ok
    assert len(existing(folder / "search.h5")) > kept
    again = searched(folder, "gaussian-process", 2, warm_start=True)
    assert (again.name, again.designs) == (whole.name, whole.designs)
    assert tables_of(folder, again.name) == tables_of(tmp_path / "whole", whole.name)
    assert verify(folder / "search.h5").duplicates == 0
    with (folder / "best.csv").open() as file:
        assert float(next(csv.DictReader(file))["x (m)"]) == whole.designs[0].genes["x"]
