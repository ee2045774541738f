"""Inequality constraints: the values they allow, the size of a violation, and the time of their
evaluation."""

import functools
import math

import pytest

from tests.optimize.fake_runs import FakeCache, FakeEvaluator, FakeScene, fake_problem
from tisim import InputError, optimize
from tisim.optimize import DesignConstraint, Gene, Problem, ResultConstraint
from tisim.optimize.evaluation.runs import Runs, Sample
from tisim.optimize.problem.calls import constraint_value, make_scene
from tisim.optimize.problem.function import FunctionCall
from tisim.optimize.tables import best_columns

FIRST = DesignConstraint("first", lambda design: design["x0"], "m", at_most=0.5)


@pytest.mark.parametrize(
    ("bounds", "value", "violation"),
    [
        ({"at_most": 3.0}, 3.0, 0.0),
        ({"at_most": 3.0}, 4.5, 0.5),
        ({"at_most": -3.0}, 0.0, 1.0),
        ({"at_most": 0.0}, 0.25, 0.25),
        ({"at_most": 3.0, "scale": 0.5}, 4.5, 3.0),
        ({"at_least": 2.0}, 2.0, 0.0),
        ({"at_least": 2.0}, 1.0, 0.5),
        ({"at_least": 2.0, "at_most": 3.0}, 2.5, 0.0),
        ({"at_least": 2.0, "at_most": 3.0}, 1.0, 0.5),
        ({"at_least": 2.0, "at_most": 3.0}, 6.0, 1.0),
        ({"at_most": 3.0}, math.inf, math.inf),
        ({"at_most": 3.0}, -math.inf, 0.0),
        ({"at_most": 3.0}, math.nan, math.inf),
    ],
)
def test_a_violation_is_the_excess_relative_to_the_bound(bounds, value, violation):
    assert ResultConstraint("mass", len, "kg", **bounds).violation(value) == pytest.approx(violation)


def test_a_constraint_is_described_in_words():
    assert ResultConstraint("mass", len, "kg", at_most=3.0).rule == "at most 3 kg"
    assert ResultConstraint("mass", len, at_least=1, at_most=2.5).label == "mass, at least 1 and at most 2.5"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ResultConstraint("", len, at_most=1), "constraint name must be a non-empty string"),
        (lambda: ResultConstraint("m", 1.0, at_most=1), "function 'of' of constraint m must be a function"),
        (lambda: ResultConstraint("m", len), "constraint m must be at_most or at_least a number, or both"),
        (
            lambda: ResultConstraint("m", len, at_most=math.inf),
            "bound of constraint m must be a finite number",
        ),
        (lambda: ResultConstraint("m", len, at_most="1"), "bound of constraint m must be a finite number"),
        (
            lambda: ResultConstraint("m", len, at_most=1, at_least=1),
            "at_least of constraint m must be below at_most",
        ),
        (
            lambda: ResultConstraint("m", len, at_most=1, scale=0.0),
            "scale of constraint m must be a finite number",
        ),
        (
            lambda: fake_problem(constraints=["m"]),
            "constraint must be a ResultConstraint or a DesignConstraint; received 'm'",
        ),
        (
            lambda: fake_problem(constraints=[FIRST, FIRST]),
            "names of constraints, and of quantities, must be different from each other",
        ),
        (
            lambda: fake_problem(constraints=[ResultConstraint("x1", len, at_most=1)]),
            "names of constraints, and of quantities, must be",
        ),
        (
            lambda: fake_problem(constraints=[ResultConstraint("fitness", len, at_most=1)]),
            "names of constraints",
        ),
    ],
)
def test_impossible_values_are_refused(make, message):
    with pytest.raises(InputError, match=f"^{message}"):
        make()


def test_an_infeasible_design_makes_no_scene():
    made = []

    def scene(design, seed):
        made.append(design)
        return FakeScene(design, seed)

    problem = fake_problem(genes=1, scene=scene, constraints=[FIRST])
    assert make_scene(problem, {"x0": 0.5}, 1).seed == 1
    with pytest.raises(InputError, match=r"^first must be at most 0.5 m; received 0.75 m$"):
        make_scene(problem, {"x0": 0.75}, 1)
    assert made == [{"x0": 0.5}]


def test_an_infeasible_design_costs_no_run():
    evaluator = FakeEvaluator()
    runs = Runs(fake_problem(genes=1, constraints=[FIRST]), evaluator, FakeCache(), seed=1)
    inside, outside = Sample({"x0": 0.25}), Sample({"x0": 0.75})
    runs.add([(inside, range(3)), (outside, range(3))])
    assert (len(inside.values), len(outside.values)) == (3, 0)
    assert outside.reason == "infeasible: first must be at most 0.5 m; received 0.75 m"
    assert (len(evaluator.digests), runs.requested) == (3, 3)


def test_a_search_satisfies_and_reports_a_constraint():
    """The minimum of the bowl, 0.3, is not allowed."""
    below = DesignConstraint("first", lambda design: design["x0"], at_most=0.1)
    problem = Problem.of_function(
        lambda design: (design["x0"] - 0.3) ** 2, [Gene("x0", "m", 0.0, 1.0)], constraints=[below]
    )
    outcome = optimize.run(problem, seed=1, generations=20)
    assert 0.09 < outcome.designs[0].genes["x0"] <= 0.1
    assert best_columns(problem, outcome.hall)["first, at most 0.1"] == [
        design.genes["x0"] for design in outcome.designs
    ]


def test_a_faulty_constraint_is_reported_in_a_line():
    for of, received in (
        (lambda design: design["y"], r"KeyError: 'y' \(test_constraint.py, line \d+\)"),
        (lambda design: None, "None"),
        (lambda design: design["x0"] > 1, "False"),
    ):
        problem = fake_problem(genes=1, constraints=[DesignConstraint("c", of, at_most=1)])
        with pytest.raises(InputError, match=rf"^constraint c must return a number; received {received}"):
            make_scene(problem, {"x0": 0.5}, 1)


def test_a_constraint_that_reads_a_file_must_declare_it(tmp_path):
    limit = tmp_path / "limit.txt"
    limit.write_text("0.5")
    constraint = ResultConstraint("c", lambda result: float(limit.read_text()), at_most=1)
    with pytest.raises(InputError, match=r"^constraint c must read no file but those in Problem"):
        constraint_value(constraint, None, fake_problem(constraints=[constraint]))
    declared = fake_problem(constraints=[constraint], files=[limit])
    assert constraint_value(constraint, None, declared) == 0.5


def far(result, limit):
    return result.value - limit


def test_constraints_identify_runs_and_bounds_identify_searches():
    """Constraint values of a run are stored with its objectives; design values and bounds are not."""

    def of(kind, limit, **bounds):
        constraint = kind("c", functools.partial(far, limit=limit), **(bounds or {"at_most": 1}))
        return fake_problem(constraints=[constraint])

    assert of(ResultConstraint, 0.5).objective_identity == of(ResultConstraint, 0.5).objective_identity
    assert of(ResultConstraint, 0.5).objective_identity != of(ResultConstraint, 1.5).objective_identity
    assert of(ResultConstraint, 0.5).objective_identity != fake_problem().objective_identity
    assert of(DesignConstraint, 0.5).objective_identity == of(DesignConstraint, 1.5).objective_identity
    assert of(DesignConstraint, 0.5).identity != of(DesignConstraint, 1.5).identity
    described = [of(ResultConstraint, 0.5, **bounds).constraints[0].described for bounds in (
        {"at_most": 1}, {"at_most": 2}, {"at_least": 1}, {"at_most": 1, "scale": 2}
    )]  # fmt: skip
    assert len(set(described)) == 4


def test_a_bound_is_part_of_the_identity_of_a_search():
    def identity(bound):
        problem = fake_problem(constraints=[ResultConstraint("c", len, at_most=bound)])
        return optimize.settings.identity(problem, optimize.Settings(), {})

    assert identity(1.0) == identity(1.0) != identity(2.0)


def test_calls_of_a_function_are_refused_too():
    problem = Problem.of_function(
        lambda design: 0.0, [Gene("x0", "", 0.0, 1.0)], constraints=[FIRST], name="p"
    )
    assert isinstance(make_scene(problem, {"x0": 0.2}, 1), FunctionCall)
    with pytest.raises(InputError, match=r"^first must be at most 0.5 m"):
        make_scene(problem, {"x0": 0.7}, 1)
