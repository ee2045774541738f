"""Designs with whole numbers, texts and flags in all outputs of a search."""

import io
from dataclasses import replace

import pytest
from rich.console import Console

from tests.optimize.fake_runs import fake_record
from tisim import optimize
from tisim.optimize import Choice, DependentGene, DesignConstraint, FixedGene, Gene, Problem
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.outcome import Outcome
from tisim.optimize.report import report
from tisim.optimize.report.display import Display
from tisim.optimize.settings import Settings
from tisim.optimize.storage.record import Record

GENES = (
    Gene("speed", "m/s", 1.0, 9.0), Gene("blades", "", 2, 5, integer=True), Choice("wall", ("flat", "round")),
    Choice("open", (False, True)), FixedGene("gap", 2.5, "mm"),
    DependentGene("tip", "m/s", lambda d: 2 * d["speed"]),
)  # fmt: skip


def worth(design):
    return design["speed"] + design["blades"] + (design["wall"] == "flat") + design["open"]


PROBLEM = Problem.of_function(
    worth, GENES, met_at=6.0,
    constraints=[DesignConstraint("drag", lambda design: design["tip"] / 10, "N", at_most=1.5)],
)  # fmt: skip


@pytest.fixture(scope="module")
def outcome():
    return optimize.run(PROBLEM, generations=6, seed=1)


def printed(renderable):
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(renderable)
    return [line.split() for line in console.export_text().splitlines()]


def test_the_table_of_the_best_has_every_kind(outcome):
    rows = {line[0]: line[1:] for line in printed(report.best_table(outcome)) if line}
    best = outcome.designs[0].genes
    assert rows["blades"][0] == str(best["blades"])
    assert rows["wall"][0] == best["wall"]
    assert rows["open"][0] == str(best["open"])
    assert rows["gap"][:2] == ["(mm)", "2.5"]
    assert rows["tip"][1] == f"{2 * best['speed']:.4g}"
    assert rows["drag,"][4] == f"{best['speed'] / 5:.4g}"


def test_the_spread_of_designs_at_the_target_names_choices():
    """Three designs: blades 2 and 3 of 2 to 5 are in neighbouring cells; both walls; never open."""
    outcome = Outcome(PROBLEM, Settings(), {"problem": "p"})
    for design, cost in (
        ({"speed": 1.0, "blades": 2, "wall": "round", "open": False}, 3.0),
        ({"speed": 3.0, "blades": 3, "wall": "round", "open": False}, 6.0),
        ({"speed": 2.0, "blades": 2, "wall": "flat", "open": False}, 5.0),
        ({"speed": 9.0, "blades": 5, "wall": "flat", "open": True}, 16.0),
    ):
        point = tuple(PROBLEM.genome.encode(design))
        outcome.estimates[point] = (FitnessEstimate.certain(cost),)
    rows = {line[0]: line[1:] for line in printed(report.met_table(outcome)) if line}
    assert rows["speed"] == ["(m/s)", "1", "3", "25", "%"]
    assert rows["blades"] == ["2", "3", "25", "%"]
    assert rows["wall"] == ["flat,", "round", "2", "of", "2"]
    assert rows["open"] == ["False", "1", "of", "2"]
    assert "gap" not in rows
    lines = report.met_csv(outcome).decode().splitlines()
    assert lines[0] == "speed (m/s),blades,wall,open,gap (mm),tip (m/s),value"
    assert lines[1] == "1.0,2,round,False,2.5,2.0,3.0"


def test_the_bar_shows_the_best_design():
    text = Display(PROBLEM, Settings(generations=3), Console(file=io.StringIO()))._design(
        PROBLEM.genome.decode([0.5] * 4)
    )
    assert text == "speed 5 m/s, blades 4, wall round, open True, gap 2.5 mm, tip 10 m/s"


def test_runs_are_read_back_from_a_journal():
    record = replace(fake_record(1), design=PROBLEM.genome.decode([0.5] * 4))
    again = Record.parse(record.payload())
    assert again == record
    types = [type(again.design[name]) for name in PROBLEM.genome.names]
    assert types == [float, int, str, bool, float, float]


def test_a_folder_and_plain_data_have_every_kind(outcome, tmp_path):
    paths = report.write(outcome, tmp_path)
    assert {"best.csv", "met.csv", "convergence.png"} <= set(paths)
    data = outcome.to_dict()
    assert data["units"]["gap"] == "mm"
    assert data["designs"][0]["genes"] == outcome.designs[0].genes
