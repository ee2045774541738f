"""The public interface of optimize: a search in a few lines, with results by name and in units."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from tests.optimize.drift_case import distance, problem
from tests.optimize.fake_runs import FakeEvaluator, fake_problem
from tests.optimize.shared_case import skip_pictures
from tisim import InputError, optimize
from tisim.backend import runtime

SMALL = {
    "method": "zohdi",
    "generations": 1,
    "options": {"population": 6, "parents": 2},
    "ensemble": {"max_starts": 4},
}


@pytest.fixture(scope="module")
def drift():
    """One search on the drift of free grains, without a folder."""
    return optimize.run(problem("default", ""), seed=4, **SMALL)


@pytest.mark.long
def test_designs_have_their_genes_by_name_and_in_units(drift):
    assert drift.stopped == "generations"
    for design in drift.designs:
        assert list(design.genes) == ["speed", "rise"]
        assert all(1 <= value <= 20 for value in design.genes.values())
        low, high = design.intervals["R"]
        assert low < design.values["R"] < high
        assert design.starts == 16
    assert drift.designs[0].genes == drift.problem.genome.decode(drift.best)


@pytest.mark.long
def test_plain_data_go_through_json(drift):
    data = json.loads(json.dumps(drift.to_dict()))
    assert data["units"] == {"speed": "m/s", "rise": "m/s", "R": ""}
    assert data["designs"][0]["genes"] == drift.designs[0].genes
    assert data["logbook"]["best"] == drift.logbook.select("best")
    assert data["designs"][0]["intervals"]["R"] == list(drift.designs[0].intervals["R"])
    assert data["settings"]["options"]["population"] == 6


@pytest.mark.long
def test_a_frame_has_the_columns_of_the_table(drift):
    pytest.importorskip("pandas")
    frame = drift.to_frame(hall=True)
    assert list(frame["rank"]) == list(range(1, len(drift.designs) + 1))
    assert frame["speed (m/s)"][0] == drift.designs[0].genes["speed"]


@pytest.mark.long
def test_pandas_is_optional(drift, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pandas must be installed for a data frame"):
        drift.to_frame()


@pytest.mark.long
def test_a_search_in_a_folder_can_be_continued(drift, tmp_path, capsys, monkeypatch):
    """A search without a folder has the same designs; a repetition runs and prints nothing."""
    skip_pictures(monkeypatch.setattr)
    first = optimize.run(problem("default", ""), out=tmp_path / "s", seed=4, **SMALL)
    again = optimize.run(problem("default", ""), out=tmp_path / "s", seed=4, **SMALL)
    assert first.designs == again.designs == drift.designs
    assert (again.evaluations, again.hits) == (0, first.evaluations)
    assert (tmp_path / "s/best.csv").exists()
    assert capsys.readouterr() == ("", "")


@pytest.mark.long
def test_a_search_may_run_in_a_thread_of_its_own(drift):
    """Python cannot handle Ctrl-C in such a thread."""
    with ThreadPoolExecutor(1) as pool:
        again = pool.submit(optimize.run, problem("default", ""), seed=4, **SMALL).result()
    assert again.designs == drift.designs


def test_other_threads_wait_until_a_search_is_over(monkeypatch):
    """They must wait between its evaluations too, because they would start Taichi with other settings."""

    def free():
        acquired = runtime.turn.acquire(blocking=False)
        if acquired:
            runtime.turn.release()
        return acquired

    def look(*arguments):
        outcomes.append(other.submit(free).result())
        return fake.scene(*arguments)

    outcomes, fake = [], fake_problem()
    with ThreadPoolExecutor(1) as other:
        monkeypatch.setattr("tisim.optimize.evaluation.executors.BatchEvaluator", FakeEvaluator)
        optimize.run(replace(fake, scene=look), **SMALL)
        assert outcomes
        assert not any(outcomes)
        assert other.submit(free).result()


@pytest.mark.slow
def test_several_objectives_give_a_front(tmp_path):
    two = (
        optimize.Objective("R", distance, "m"),
        optimize.Objective(
            "height", lambda r: float(np.abs(r.state["position"][:, 2]).mean()), "m", maximise=True
        ),
    )
    front = optimize.run(
        replace(problem("default", ""), objective=two), generations=1, options={"population": 8}
    )
    assert front.settings.method == "genetic"
    heights = [design.values["height"] for design in front.designs]
    assert [design.values["R"] for design in front.designs] == sorted(d.values["R"] for d in front.designs)
    assert heights == sorted(heights)
    assert min(heights) > 0


def test_wrong_settings_are_refused_before_anything_runs():
    with pytest.raises(InputError, match=r"search.generation must be a known key: .*; received 3"):
        optimize.run(problem("default", ""), generation=3)
    with pytest.raises(InputError, match="executor must be batch"):
        optimize.run(problem("default", ""), executor="threads:2")


def test_another_objective_has_another_identity():
    one = problem("default", "")
    assert one.identity == problem("default", "").identity
    assert replace(one, objective=lambda result: 0.0).identity != one.identity
    assert replace(one, scene=lambda design, seed: one.scene(design, seed)).identity != one.identity
    assert replace(one, scene=lambda design, seed: None).objective_identity == one.objective_identity
    assert replace(one, code="mine").identity == replace(one, code="mine", objective=len).identity


def test_the_import_loads_nothing_heavy():
    heavy = ("taichi", "quadrants", "numpy", "deap", "h5py", "pydantic", "pandas")
    code = f"import tisim.optimize, sys; print([m for m in {heavy} if m in sys.modules])"
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert completed.stdout == "[]\n"


def test_every_name_is_there():
    assert set(optimize.__all__) >= {
        "Design",
        "Gene",
        "Genome",
        "Objective",
        "Outcome",
        "Problem",
        "Settings",
        "run",
    }
    assert all(getattr(optimize, name) is not None for name in optimize.__all__)
