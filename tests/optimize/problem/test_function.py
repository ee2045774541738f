"""Plain functions instead of scenes, through the public API: nothing is simulated or reused by mistake."""

import csv
import functools
import json
import math
import subprocess
import sys

import pytest

from tests.optimize.function_case import noisy, rosenbrock
from tisim import InputError, RunError, optimize
from tisim.optimize import Choice, FitnessRecord, Gene, Objective, Problem
from tisim.optimize.problem.function import PlainFunction
from tisim.optimize.storage.cache import existing

TWO = (Gene("x", "", -2.0, 2.0), Gene("y", "", -1.0, 3.0))
ONE = (Gene("x", "", 0.0, 1.0),)


def test_a_method_finds_the_minimum_of_an_analytic_function():
    """Rosenbrock's valley in two dimensions, with its minimum, 0, at (1, 1)."""
    outcome = optimize.run(
        Problem.of_function(rosenbrock, TWO), max_evaluations=600, generations=600, method="cma-es", seed=3
    )
    best = outcome.designs[0]
    assert best.values["value"] < 1e-6
    assert best.genes == pytest.approx({"x": 1.0, "y": 1.0}, abs=1e-2)
    assert outcome.problem.name == "rosenbrock"


def test_a_function_is_called_once_for_each_design():
    """The budget counts calls."""
    calls = []
    problem = Problem.of_function(lambda design: len(calls.append(design) or ()) + design["x"], ONE, code="c")
    outcome = optimize.run(problem, max_evaluations=37, generations=50, seed=1)
    assert outcome.evaluations == len(calls) == 37
    assert outcome.hits == 0
    assert problem.deterministic


def test_a_function_that_takes_a_seed_is_called_from_several_starts():
    problem = Problem.of_function(noisy, ONE)
    assert not problem.deterministic
    outcome = optimize.run(problem, generations=2, seed=1, ensemble={"min_starts": 5, "max_starts": 5})
    assert all(individual.estimates[0].starts >= 5 for individual in outcome.hall)
    low, high = outcome.designs[0].intervals["value"]
    assert low < outcome.designs[0].values["value"] < high


@pytest.mark.parametrize(
    ("of", "takes_seed"),
    [
        (lambda design: 0, False), (lambda design, seed: 0, True), (lambda design, other: 0, True),
        (lambda design, scale=2.0: 0, False), (lambda design, seed=0: 0, True),
        (functools.partial(lambda scale, design: 0, 2.0), False),
        (functools.partial(lambda scale, design, seed: 0, 2.0), True), (max, False),
    ],
)  # fmt: skip
def test_a_seed_argument_is_detected(of, takes_seed):
    assert PlainFunction(of).takes_seed == takes_seed


def test_several_objectives_by_place_or_by_name_give_a_front():
    """Schaffer's problem: the front is 0 <= x <= 2."""
    genes = [Gene("x", "", -10.0, 10.0)]
    by_place = Problem.of_function(lambda d: (d["x"] ** 2, (d["x"] - 2) ** 2), genes, ["near", "far"], "s")
    by_name = Problem.of_function(
        lambda d: {"far": (d["x"] - 2) ** 2, "near": d["x"] ** 2, "more": 1}, genes, ["near", "far"], "s"
    )
    front = optimize.run(by_place, generations=12, seed=2)
    assert len(front.designs) > 20
    assert all(-0.1 < design.genes["x"] < 2.1 for design in front.designs)
    again = optimize.run(by_name, generations=12, seed=2)
    assert [design.values for design in again.designs] == [design.values for design in front.designs]


def test_an_objective_reads_the_values_of_the_function():
    height = Objective("height", lambda result: result.value["top"], "m", maximise=True)
    problem = Problem.of_function(lambda d: {"top": 1 - d["x"] ** 2}, ONE, [height], name="hill")
    best = optimize.run(problem, generations=8, seed=1).designs[0]
    assert best.values["height"] == pytest.approx(1.0, abs=1e-4)


def test_runs_of_the_same_function_are_reused(tmp_path):
    def of(target):
        return Problem.of_function(lambda design: abs(design["x"] - target), ONE, name="p")

    first = optimize.run(of(0.25), out=tmp_path, generations=3, seed=1)
    assert first.evaluations > 0
    again = optimize.run(of(0.25), out=tmp_path, generations=3, seed=1)
    assert (again.evaluations, again.hits) == (0, first.evaluations)
    assert again.designs == first.designs
    with pytest.raises(InputError, match="the problem file, or a value that its functions use, has changed"):
        optimize.run(of(0.75), out=tmp_path, generations=3, seed=1)
    assert of(0.25).objective_identity != of(0.75).objective_identity


def test_a_folder_of_a_function_has_no_scene(tmp_path):
    genes = (Gene("x", "m", 0.0, 1.0), Gene("n", "", 1, 3, integer=True), Choice("wall", ("flat", "round")))
    problem = Problem.of_function(lambda d: d["x"] + d["n"] + (d["wall"] == "flat"), genes, name="mixed")
    outcome = optimize.run(problem, out=tmp_path, generations=6, seed=1)
    assert not (tmp_path / "best_scene.toml").exists()
    with (tmp_path / "best.csv").open(encoding="utf-8") as file:
        row = next(csv.DictReader(file))
    design = outcome.designs[0].genes
    assert problem.genome.parse(row) == design
    assert (row["n"], row["wall"]) == ("1", "round")
    assert [type(value) for value in design.values()] == [float, int, str]
    assert json.loads(json.dumps(outcome.to_dict()))["designs"][0]["genes"] == design
    stored = [dict(record.design) for record in existing(tmp_path / "search.h5").records()]
    assert len(stored) == outcome.evaluations
    assert design in stored
    table = existing(tmp_path / "search.h5").table(f"{outcome.name}/hall_of_fame").columns
    assert (table["n"][0], table["wall"][0]) == (1, "round")


def test_neither_taichi_nor_a_device_is_started():
    code = (
        "from tisim import optimize; from tests.optimize.function_case import rosenbrock; "
        "from tisim.backend import runtime; "
        "problem = optimize.Problem.of_function(rosenbrock, [optimize.Gene(n, '', -2, 2) for n in 'xy']); "
        "optimize.run(problem, generations=2); print(runtime.generation())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "0\n"


@pytest.mark.long
def test_worker_processes_call_functions_too():
    problem = Problem.of_function(noisy, ONE)
    settings = {"generations": 2, "seed": 5, "options": {"population": 6}}
    here = optimize.run(problem, **settings)
    there = optimize.run(problem, executor="processes:1", **settings)
    assert there.designs == here.designs
    with pytest.raises(InputError, match=r"^function must be one that a worker can import; received"):
        optimize.run(Problem.of_function(lambda d: 0.0, ONE), executor="processes:2", **settings)


FAULTS = {
    "an error": (lambda d: d["y"], r"function lambda must return .*; received KeyError: 'y' \(test_fun"),
    "nothing": (lambda d: None, r"objective value must return a number; received None"),
    "a complex number": (lambda d: 1j, r"objective value must return a number; received 1j"),
    "too many": (lambda d: (1, 2), r"function lambda must return 1 values \(value\); received \(1, 2\)"),
    "no such name": (lambda d: {"a": 1}, r"function lambda must return a dictionary with 'value'; rec"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_function_ends_the_search_with_a_line(name):
    function, message = FAULTS[name]
    with pytest.raises(InputError, match=f"^{message}"):
        optimize.run(Problem.of_function(function, ONE), generations=2)


def test_non_functions_are_refused():
    with pytest.raises(InputError, match=r"^function must be one of the design; received 3"):
        Problem.of_function(3, ONE)
    with pytest.raises(InputError, match=r"^objectives must be a list of names or Objectives; received 'f'"):
        Problem.of_function(rosenbrock, TWO, "f")


def test_designs_that_fail_or_give_no_number_are_excluded():
    def partly(design):
        if design["x"] < 0.5:
            raise InputError("x must be large; received little")
        return math.nan if design["x"] < 0.75 else design["x"]

    outcome = optimize.run(Problem.of_function(partly, ONE), generations=15, seed=1)
    assert 0.75 <= outcome.designs[0].genes["x"] < 0.76


def test_a_function_without_successful_designs_ends_the_search():
    def refuse(design):
        raise InputError("x must be large; received little")

    with pytest.raises(
        RunError, match=r"^search must find a design .* infeasible: x must be large; received little\."
    ):
        optimize.run(Problem.of_function(refuse, ONE), generations=2)


def test_a_file_read_by_a_function_must_be_declared(tmp_path):
    target = tmp_path / "target.txt"
    target.write_text("0.5")

    def miss(design):
        return abs(design["x"] - float(target.read_text()))

    with pytest.raises(InputError, match=r"^objective value must read no file but those in Problem\(files"):
        optimize.run(Problem.of_function(miss, ONE), generations=1)
    before = Problem.of_function(miss, ONE, files=[target])
    assert optimize.run(before, generations=8).designs[0].genes["x"] == pytest.approx(0.5, abs=0.01)
    identity = before.objective_identity
    target.write_text("0.25")
    assert before.objective_identity != identity


def test_a_function_cannot_change_the_design():
    def meddle(design):
        design["x"] = 0.0
        return 1.0

    call = Problem.of_function(meddle, ONE).scene({"x": 0.5}, 0)
    before = call.digest()
    assert call.run().value == 1.0
    assert (call.design, call.digest()) == ({"x": 0.5}, before)


def test_a_fitness_record_of_a_function(tmp_path):
    problem = Problem.of_function(noisy, [*ONE, optimize.FixedGene("k", 2)])
    record = FitnessRecord.measure(problem, {"low": {"x": 0.1}}, starts=3)
    record.save(tmp_path / "fitness.json")
    assert record.values["low"]["value"] == [noisy({"x": 0.1}, seed) for seed in range(3)]
    assert FitnessRecord.load(tmp_path / "fitness.json").again(problem).values == record.values


def test_a_gene_is_fixed_in_a_problem():
    problem = Problem.of_function(rosenbrock, TWO).fix(y=0.25)
    best = optimize.run(problem, generations=25, seed=1).designs[0]
    assert best.genes == {"x": pytest.approx(0.5, abs=0.03), "y": 0.25}
    assert problem.genome.decode([0.5])["y"] == 0.25
    assert problem.objective_identity == Problem.of_function(rosenbrock, TWO).objective_identity


def test_the_error_explains_that_no_design_is_feasible():
    far = optimize.DesignConstraint("far", lambda design: design["x"], "m", at_most=-1)
    problem = Problem.of_function(lambda design: 0.0, ONE, name="p", constraints=[far])
    with pytest.raises(RunError, match=r"infeasible: far must be at most -1 m; received 0\.\d+ m\. "):
        optimize.run(problem, generations=2)
