"""The results of a search as data frames, from its outcome and from its file."""

import sys

import numpy as np
import pytest
from scipy import stats

from tests.optimize.fake_runs import FakeEvaluator, fake_problem
from tisim import InputError, optimize
from tisim.optimize.problem.genome import Gene, Genome
from tisim.optimize.problem.objective import Objective
from tisim.optimize.search import search
from tisim.optimize.search_folder import SEARCH_FILE
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache

pytest.importorskip("pandas")
GENOME = Genome((Gene("speed", "m/s", 1.0, 9.0), Gene("ratio", "", 1e-3, 1.0, "log")))
OBJECTIVE = (Objective("gain", lambda result: result.value, "1/s", maximise=True),)
STARTS = {"min_starts": 3, "select": 0, "confirm": 0}


def gain(design, seed):
    speed, ratio = design.values()
    return "too fast" if speed > 8 else speed * ratio + np.random.default_rng(seed).normal()


def searched(folder, **settings):
    problem = fake_problem(genome=GENOME, objective=OBJECTIVE)
    with Cache(folder / SEARCH_FILE) as cache:
        return search(
            problem,
            FakeEvaluator(gain),
            cache,
            Settings(**{"seed": 1, "generations": 3, "ensemble": STARTS, **settings}),
        )


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("search")
    return searched(folder), folder


def test_a_frame_has_every_design(found):
    outcome, folder = found
    frame = outcome.to_frame()
    assert list(frame) == ["speed", "ratio", "gain", "gain std. error", "starts", "converged", "failed"]
    assert frame.attrs["units"] == {"speed": "m/s", "gain": "1/s", "gain std. error": "1/s"}
    failed = frame["failed"] != ""
    assert (failed == (frame["speed"] > 8)).all()
    assert failed.any()
    assert frame["failed"][failed].str.contains("too fast").all()
    assert frame["gain"].isna().equals(failed)
    assert len(frame) == sum(outcome.logbook.select("designs"))
    genes, (leader,) = outcome.designs[0].genes, outcome.hall[0].estimates
    best = frame[(frame["speed"] == genes["speed"]) & (frame["ratio"] == genes["ratio"])].iloc[0]
    assert (best["gain"], best["gain std. error"]) == (-leader.mean, leader.standard_error)
    runs = {}
    for record in Cache(folder / SEARCH_FILE).records():
        runs.setdefault(tuple(record.design.values()), []).append(record.values["gain"])
    for _, row in frame[~failed].iterrows():
        assert row["gain"] == pytest.approx(np.mean(runs[row["speed"], row["ratio"]]), rel=1e-12)
        assert row["starts"] == 3


def test_a_frame_of_the_hall_has_the_columns_of_the_table(found):
    outcome, _ = found
    frame = outcome.to_frame(hall=True)
    assert list(frame["rank"]) == list(range(1, len(outcome.designs) + 1))
    assert list(frame["speed (m/s)"]) == [design.genes["speed"] for design in outcome.designs]
    assert frame.attrs["units"] == {"speed (m/s)": "m/s", "gain (1/s)": "1/s", "std. error": "1/s"}


def test_a_file_is_read_back(found):
    outcome, folder = found
    for place in (folder, folder / SEARCH_FILE, str(folder)):
        file = optimize.read(place)
    assert file.problems == ["bowl"]
    assert file.searches == [outcome.name.removeprefix("searches/")]
    assert repr(file) == f"<file of bowl: {outcome.evaluations} runs, 1 searches>"
    runs = file.runs()
    assert list(runs)[:3] == ["speed", "ratio", "gain"]
    assert list(runs)[3:] == ["start", "seed", "ok", "reason", "wall_s", "created", "key"]
    assert runs.attrs["units"] == {"speed": "m/s", "gain": "1/s", "wall_s": "s", "created": "s"}
    assert len(runs) == outcome.evaluations
    assert set(runs["start"]) == {0, 1, 2}
    assert (runs["ok"] == (runs["speed"] <= 8)).all()
    assert set(runs["reason"]) == {"", "too fast"}
    whole = outcome.to_frame().set_index(["speed", "ratio"]).sort_index()
    designs = file.designs().set_index(["speed", "ratio"]).sort_index()
    assert designs.index.equals(whole.index)
    assert designs.attrs["units"] == outcome.to_frame().attrs["units"]
    for heading in ("gain", "gain std. error"):
        assert np.allclose(designs[heading], whole[heading], rtol=1e-12, equal_nan=True)
    assert ((designs["failed"] != "") == (whole["failed"] != "")).all()
    assert list(file.logbook()["best"]) == outcome.logbook.select("best")
    assert file.hall().equals(outcome.to_frame(hall=True))
    assert file.hall().attrs == outcome.to_frame(hall=True).attrs
    assert file.settings() == outcome.settings.model_dump(mode="json")
    assert list(file.genes()["unit"]) == ["m/s", ""]
    assert list(file.objectives()["direction"]) == ["largest"]


def test_standard_errors_follow_from_the_runs(found):
    _, folder = found
    file = optimize.read(folder)
    runs, designs = file.runs(), file.designs()
    for _, row in designs[designs["failed"] == ""].iterrows():
        mine = runs["gain"][(runs["speed"] == row["speed"]) & (runs["ratio"] == row["ratio"])]
        assert row["gain std. error"] == pytest.approx(stats.sem(mine), rel=1e-9)


def test_a_running_search_is_read_up_to_now(tmp_path):
    counts = []

    class Watched(FakeEvaluator):
        def evaluate(self, scenes, progress):
            file = optimize.read(tmp_path)
            counts.append((sum(len(file.runs(problem)) for problem in file.problems), len(file.logbook())))
            return super().evaluate(scenes, progress)

    problem = fake_problem(genome=GENOME, objective=OBJECTIVE)
    settings = Settings(seed=1, generations=3, ensemble=STARTS)
    with Cache(tmp_path / SEARCH_FILE) as cache:
        outcome = search(problem, Watched(gain), cache, settings)
    starts = np.cumsum([0, *outcome.logbook.select("starts")])
    # The first generation evaluates two designs before the rest.
    assert counts == [(0, 0), (4, 0), *((count, k) for k, count in enumerate(starts[1:-1], start=1))]


def test_a_file_of_several_searches_needs_a_name(tmp_path):
    first, second = (searched(tmp_path, seed=seed) for seed in (1, 2))
    file = optimize.read(tmp_path)
    names = [outcome.name.removeprefix("searches/") for outcome in (first, second)]
    assert sorted(file.searches) == sorted(names)
    with pytest.raises(
        InputError, match=r"search must be one of bowl-genetic-1-\w+, bowl-genetic-2-\w+; received None"
    ):
        file.logbook()
    assert file.settings(names[1])["seed"] == 2
    assert len(file.runs()) == first.evaluations + second.evaluations
    with pytest.raises(InputError, match="problem must be one of bowl; received 'other'"):
        file.runs("other")


def test_only_data_frames_need_pandas(found, monkeypatch):
    outcome, folder = found
    monkeypatch.setitem(sys.modules, "pandas", None)
    file = optimize.read(folder)
    assert file.settings()["seed"] == 1
    for frame in (outcome.to_frame, file.runs, file.hall):
        with pytest.raises(InputError, match="pandas must be installed for a data frame"):
            frame()


def test_other_files_than_searches_are_refused(tmp_path):
    with pytest.raises(InputError, match="cache file must be an existing file; received"):
        optimize.read(tmp_path)
    (tmp_path / SEARCH_FILE).write_text("text")
    with pytest.raises(InputError, match="must be a whole HDF5 file written by a cache"):
        optimize.read(tmp_path)
