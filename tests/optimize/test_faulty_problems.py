"""A faulty function of a problem ends the search with a line that names the error and its place."""

import numpy as np
import pytest

from tests.optimize.fake_runs import FakeEvaluator, FakeScene, fake_problem
from tisim import InputError, RunError
from tisim.optimize import Gene, Problem
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache

SETTINGS = Settings(
    method="zohdi", generations=3, options={"population": 6, "parents": 2},
    ensemble=EnsembleSettings(max_starts=1, min_starts=1, block=1),
)  # fmt: skip


def run(tmp_path, **changes):
    with Cache(tmp_path / "search.h5") as cache:
        return search(fake_problem(**changes), FakeEvaluator(), cache, SETTINGS)


def fails(result):
    return result.value / 0


NO_NUMBERS = {
    "nothing": (lambda r: None, "None"),
    "a text": (lambda r: "0.3", "'0.3'"),
    "a flag": (lambda r: True, "True"),
    "a flag of NumPy": (lambda r: np.bool_(True), r"(np\.)?True"),
    "an array": (lambda r: np.array([1.0]), r"array\(\[1.\]\)"),
    "a complex number": (lambda r: 1j, "1j"),
    "a masked value": (lambda r: np.ma.masked, "masked"),
    "a number without end": (lambda r: 10**400, "a whole number of about 401 digits"),
    "an error of NumPy": (
        lambda r: np.linalg.inv(np.zeros((2, 2))),
        r"LinAlgError: .* \(test_faulty_problems.py, line \d+\)",
    ),
    "an error": (fails, r"ZeroDivisionError: .* \(test_faulty_problems.py, line \d+\)"),
}


@pytest.mark.parametrize("name", NO_NUMBERS)
def test_an_objective_that_gives_no_number_is_refused(tmp_path, name):
    objective, received = NO_NUMBERS[name]
    with pytest.raises(InputError, match=rf"^objective fitness must return a number.*; received {received}"):
        run(tmp_path, objective=objective)


@pytest.mark.parametrize("number", [np.float32(0.5), np.int64(3), np.array(0.5), 7])
def test_any_real_number_is_accepted(tmp_path, number):
    assert run(tmp_path, objective=lambda r: number).best is not None


def misspelt(design, seed):
    return design["y"]


SCENES = {
    "misspelt": (misspelt, r"KeyError: 'y' \(test_faulty_problems.py, line \d+\)"),
    "nothing": (lambda design, seed: None, "None"),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_function_at_fault_is_refused(tmp_path, name):
    function, received = SCENES[name]
    rule = "scene of problem bowl must return a Scene, or raise InputError to refuse a design"
    with pytest.raises(InputError, match=rf"^{rule}; received {received}"):
        run(tmp_path, scene=function)


def refused(design, seed):
    raise InputError("speed must be below 1 m/s; received 2.0")


HINT = r"Change the ranges of the genes, or start from a design that succeeds \(--start-from FILE, star.*\)$"
NO_SUCCESS = r"^search must find a design that succeeds; received {} that failed, the first as {}\. " + HINT


def test_a_search_without_valid_designs_ends_with_the_reason(tmp_path):
    message = NO_SUCCESS.format(18, r"infeasible: speed must be below 1 m/s; received 2\.0")
    with pytest.raises(RunError, match=message):
        run(tmp_path, scene=refused)


def test_a_function_that_refuses_every_design_ends_as_a_scene_does(tmp_path):
    message = NO_SUCCESS.format(18, r"infeasible: speed must be below 1 m/s; received 2\.0")
    problem = Problem.of_function(refused, [Gene("x", "", 0.0, 1.0)])
    with Cache(tmp_path / "search.h5") as cache, pytest.raises(RunError, match=message):
        search(problem, FunctionEvaluator(), cache, SETTINGS)


def speed_refused(design, seed):
    raise InputError(f"speed must be below 1 m/s; received {1 + design['x0']}")


def refused_in_turn(design, seed):
    raise InputError("speed must be low" if design["x0"] < 0.5 else "mass must be small")


LONG = Settings(method="random", generations=60, options={"population": 6}, ensemble=SETTINGS.ensemble)
HOPELESS = {
    "one reason, with other numbers": ({"scene": speed_refused}, FakeEvaluator(), 60, "infeasible: speed"),
    "several reasons": ({"scene": refused_in_turn}, FakeEvaluator(), 204, "infeasible: (speed|mass)"),
    "failed runs": ({}, FakeEvaluator(lambda design, seed: f"lost at {seed} s"), 60, r"lost at \d+ s"),
}


@pytest.mark.parametrize("name", HOPELESS)
def test_a_search_in_which_everything_fails_ends_early(tmp_path, name):
    changes, evaluator, designs, reason = HOPELESS[name]
    generations = []
    message = NO_SUCCESS.format(designs, f"{reason}.*")
    with Cache(tmp_path / "search.h5") as cache, pytest.raises(RunError, match=message):
        search(fake_problem(**changes), evaluator, cache, LONG, on_generation=generations.append)
    assert len(generations) == designs // 6


def test_a_search_with_a_late_success_continues(tmp_path):
    """The only valid design of the first 60 is the last one."""
    seen = []

    def last(design, seed):
        seen.extend([design] if design not in seen else [])
        return FakeScene(design, seed) if design in seen[59:60] else refused(design, seed)

    with Cache(tmp_path / "search.h5") as cache:
        outcome = search(fake_problem(scene=last), FakeEvaluator(), cache, LONG)
    assert outcome.stopped == "generations"
    assert outcome.best is not None


def test_a_search_with_some_refused_designs_continues(tmp_path):
    def some(design, seed):
        return FakeScene(design, seed) if design["x0"] > 0.3 else refused(design, seed)

    outcome = run(tmp_path, scene=some)
    assert outcome.best is not None
    assert outcome.stopped == "generations"


def test_an_objective_that_reads_a_file_must_declare_it(tmp_path):
    """Otherwise its values would be reused after the file has changed."""
    target = tmp_path / "target.csv"
    target.write_text("0.25")

    def miss(result):
        return abs(result.value - float(target.read_text()))

    with pytest.raises(
        InputError, match=r"^objective fitness must read no file but those .* received .*target"
    ):
        run(tmp_path, objective=miss)
    first = run(tmp_path, objective=miss, files=[target])
    assert first.evaluations > 0
    assert run(tmp_path, objective=miss, files=[target]).evaluations == 0
    target.write_text("0.75")
    assert run(tmp_path, objective=miss, files=[target]).evaluations > 0


def test_an_objective_may_read_files_that_it_writes(tmp_path):
    def scratch(result):
        (tmp_path / "scratch.txt").write_text(str(result.value))
        return float((tmp_path / "scratch.txt").read_text())

    assert run(tmp_path, objective=scratch).best is not None
