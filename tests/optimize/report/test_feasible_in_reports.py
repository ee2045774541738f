"""Reports, pictures and analyses say which designs violate a constraint of the result, or may do so."""

import io

import numpy as np
import pytest
from rich.console import Console

from tisim import optimize
from tisim.optimize import Choice, Gene, Misfit, Objective, Problem, ResultConstraint
from tisim.optimize.hall_of_fame import compromise
from tisim.optimize.report import report
from tisim.optimize.report.analysis import sensitivity_table
from tisim.optimize.report.analysis_figures import sensitivity_figure
from tisim.optimize.report.convergence import convergence_figure
from tisim.optimize.report.front import front_figure, others, violating
from tisim.optimize.tables import met_points

GENES = (Gene("x", "m", 0.0, 1.0), Gene("y", "m", 0.0, 1.0))


def value_of(name):
    return Objective(name, lambda result: result.value[name])


def load(**bounds):
    return ResultConstraint("load", lambda result: result.value["load"], "N", **bounds)


def searched(function, objectives, bounds, code, **settings):
    problem = Problem.of_function(function, GENES, objectives, constraints=(load(**bounds),), code=code)
    usual = {"method": "random", "generations": 0, "options": {"population": 60}}
    return optimize.run(problem, **{**usual, **settings})


def exact(design):
    return {"value": design["x"] + (design["y"] - 0.5) ** 2, "load": design["x"]}


def noisy(design, seed):
    noise = np.random.default_rng(seed).normal(size=3)
    x, y = design["x"], design["y"]
    return {
        "value": x + 0.02 * noise[0], "other": (1 - x) ** 2 + (y - 0.5) ** 2 + 0.02 * noise[1],
        "load": x + 0.3 * noise[2],
    }  # fmt: skip


def shown(renderable):
    console = Console(width=200, file=io.StringIO())
    console.print(renderable)
    return " ".join(console.file.getvalue().split())


def labels(figure):
    return [
        text.get_text() for legend in (figure.legends or [figure.axes[0].legend_]) for text in legend.texts
    ]


def test_designs_that_violate_a_constraint_meet_no_requirement():
    problem = Problem.of_function(
        exact, GENES, (value_of("value"),), constraints=(load(at_least=0.3),), met_at=0.6
    )
    outcome = optimize.run(problem, method="random", generations=0, options={"population": 60})
    points = met_points(problem, outcome.estimates, outcome.limits)
    expected = {
        point for point in outcome.estimates if point[0] >= 0.3 and point[0] + (point[1] - 0.5) ** 2 <= 0.6
    }
    assert set(points) == expected
    assert any(of_all[0].mean <= 0.6 and point[0] < 0.3 for point, of_all in outcome.estimates.items())
    words = f"{len(points)} of {len(outcome.estimates)} designs have value of at most 0.6 and satisfy the"
    assert words in shown(report.met_table(outcome))
    heading, *lines = report.met_csv(outcome).decode().splitlines()
    assert heading.endswith(',"load, at least 0.3 N"')
    assert len(lines) == len(points)
    assert min(float(line.split(",")[-1]) for line in lines) >= 0.3


@pytest.fixture
def front():
    return searched(noisy, (value_of("value"), value_of("other")), {"at_least": 0.5}, "front", seed=1)


def test_the_picture_of_a_front_marks_designs_that_violate_a_constraint(front):
    answers = [design.feasible for design in front.designs]
    assert {None, True} <= set(answers)
    out = violating(front)
    assert out
    assert all(
        front.limits[point][0].mean < 0.5 for point, of_all in front.estimates.items() if of_all in out
    )
    assert not [of_all for of_all in (*others(front)[0], *others(front)[1]) if of_all in out]
    words = labels(front_figure(front))
    assert any(line.startswith("designs that violate a constraint") for line in words)
    assert "of the front, may violate a constraint" in words
    assert not any("none satisfies all" in line for line in words)


def test_the_compromise_of_a_front_is_a_design_that_satisfies_the_constraints(front):
    at_best = next(k for k, one in enumerate(front.hall) if one is front.best)
    assert front.designs[at_best].feasible is True
    assert front.doubt == ""
    front.hall.fill(one for one in front.hall if one is not front.best)
    proven = {id(one) for one, design in zip(front.hall, front.designs, strict=True) if design.feasible}
    while proven:
        assert id(front.best) in proven
        proven.remove(id(front.best))
        front.hall.fill(one for one in front.hall if one is not front.best)
    assert front.best is compromise(front.hall)
    assert front.doubt.startswith("may violate a constraint")


def test_a_front_without_a_feasible_design_says_so():
    outcome = searched(noisy, (value_of("value"), value_of("other")), {"at_least": 3.0}, "none")
    assert "of the front, violates a constraint; none satisfies all" in labels(front_figure(outcome))


def test_an_unproven_best_design_is_marked_in_pictures_and_tables():
    outcome = searched(noisy, (value_of("value"),), {"at_least": 0.3}, "doubt", ensemble={"confirm": 2})
    assert outcome.doubt.startswith("may violate a constraint")
    assert f"the first design {outcome.doubt}" in shown(report.notes(outcome))
    figure = convergence_figure(outcome)
    assert "best, fresh starts, 95 % interval; may violate a constraint" in labels(figure)
    (found,) = optimize.sensitivity(outcome)
    assert f"the best design {outcome.doubt}" in shown(sensitivity_table(found))
    assert "may violate a constraint" in sensitivity_figure([found]).axes[0].get_title("left")


def test_a_feasible_best_design_has_no_such_words():
    outcome = searched(exact, (value_of("value"),), {"at_least": 0.3}, "sure")
    assert outcome.doubt == ""
    assert not any("violate" in words for words in labels(convergence_figure(outcome)))
    assert "violate" not in shown(sensitivity_table(optimize.sensitivity(outcome)[0]))


def test_a_calibration_says_that_designs_near_the_least_misfit_violate_a_constraint():
    """The measured x = 0.4 lies below the bound of the load, and so do half of the designs near it."""
    genes = (*GENES, Choice("law", ("one", "two")))

    def measured(design):
        off = 0.0 if design["law"] == "one" else 0.05
        load = design["x"] + (0.0 if design["law"] == "one" else 1.0)
        return {"u": design["x"] + off, "v": design["y"], "load": load}

    def quantities(result):
        return {name: result.value[name] for name in ("u", "v")}

    misfit = Objective("misfit", quantities, statistic=Misfit({"u": (0.4, 0.05), "v": (0.5, 0.05)}))
    found = {}
    for least in (-1.0, 0.9):
        problem = Problem.of_function(measured, genes, (misfit,), constraints=(load(at_least=least),))
        outcome = optimize.run(problem, method="random", generations=0, options={"population": 300})
        found[least] = optimize.calibration(outcome)
    assert not any("violate a constraint" in remark for remark in found[-1.0].remarks)
    assert set(found[-1.0].choices["law"]) == {"one", "two"}
    assert any("violate a constraint" in remark for remark in found[0.9].remarks)
    assert found[0.9].choices["law"] == ("two",)
    at = {one.name: one.estimate for one in found[0.9].genes}
    assert at["x"] == pytest.approx(0.35, abs=0.01), "the estimate for the allowed law"
