"""User designs: run first with every method, or given with measured values and learnt without a run."""

import math

import numpy as np
import pytest

from tests.optimize.fake_runs import FakeEvaluator, bowl, fake_problem
from tests.optimize.methods.test_methods import method_named, quiet, worth
from tisim import InputError, optimize
from tisim.optimize.beginning import Beginning
from tisim.optimize.designs_csv import designs
from tisim.optimize.experiments import combined, experiments, restored, table_of
from tisim.optimize.methods.base import every
from tisim.optimize.methods.cma_es import CmaEs
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.constraint import ResultConstraint
from tisim.optimize.problem.genes import Choice, Gene
from tisim.optimize.problem.given_genes import DependentGene, FixedGene
from tisim.optimize.problem.objective import Objective
from tisim.optimize.problem.problem import Problem
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache

GENES = [
    Gene("speed", "m/s", 1.0, 10.0),
    Gene("blades", "", 2, 8, integer=True),
    Choice("wall", ("smooth", "rough")),
    FixedGene("length", 0.2, "m"),
    DependentGene("turns", "", lambda design: design["length"] * design["speed"]),
]
MIXED = Problem.of_function(
    lambda design: design["speed"] * design["blades"] + (design["wall"] == "rough"), GENES, ["cost"]
)
BEST = {"x0": 0.3, "x1": 0.3, "x2": 0.31}
SETTINGS = {"seed": 1, "generations": 1, "ensemble": {"min_starts": 2}}


def run(path, evaluator=None, beginning=None, problem=None, **settings):
    with Cache(path) as cache:
        return search(
            problem or fake_problem(3), evaluator or FakeEvaluator(), cache, Settings(**SETTINGS | settings),
            beginning or Beginning(),
        )  # fmt: skip


@pytest.mark.parametrize("method", sorted(every()))
def test_every_method_runs_user_designs_first(path, method):
    evaluator = FakeEvaluator()
    outcome = run(path, evaluator, Beginning((BEST,)), method=method)
    assert {tuple(scene.design.values()) for scene in evaluator.calls[0]} == {(0.3, 0.3, 0.31)}
    assert sum(outcome.logbook.select("designs")) == len(outcome.estimates)
    assert sum(outcome.logbook.select("starts")) == len(evaluator.digests) - 4 * 6 - 16 * 6
    assert outcome.designs[0].genes == BEST, "nothing else is as good by chance"
    assert outcome.name != run(path.with_name("alone.h5"), method=method, generations=0).name


def test_a_method_gets_results_of_its_own_designs_only(path, monkeypatch):
    asked, told, tell = [], [], CmaEs.tell

    def noted(method, population, hall):
        told.append([tuple(individual) for individual in population])
        tell(method, population, hall)

    ask = CmaEs.ask
    monkeypatch.setattr(CmaEs, "ask", lambda method: asked.append(ask(method)) or asked[-1])
    monkeypatch.setattr(CmaEs, "tell", noted)
    outcome = run(path, beginning=Beginning((BEST,)), method="cma-es")
    assert told == [[tuple(individual) for individual in population] for population in asked]
    assert outcome.designs[0].genes == BEST


def learned(method, points):
    """The method for five genes after it has learnt from these points, and the designs it asks for."""
    made = method_named(method)
    individuals = [Individual(point) for point in points]
    worth(individuals)
    made.learn(individuals)
    return made, [tuple(individual) for individual in made.ask()]


def test_methods_learn_from_user_designs(rng):
    points = [tuple(point) for point in rng.random((30, 5))]
    best = min(points, key=lambda point: quiet(dict(enumerate(point)), 0))
    cma, asked = learned("cma-es", points)
    assert tuple(cma.strategy.centroid) == best
    for method in ("zohdi", "restart"):
        _, asked = learned(method, points)
        assert len(asked) == 20
        assert asked[0] == best
        assert len(set(asked) & set(points)) == 6, "the parents"
    for method in ("genetic", "gaussian-process", "nsga2"):
        made, asked = learned(method, points)
        assert not set(asked) & set(points)
        assert len(asked) == (20 if method == "nsga2" else 8), "no random ones first"
        assert {tuple(individual) for individual in made.individuals} <= set(points)
        _, asked = learned(method, points[:4])
        assert len(asked) == (16 if method == "nsga2" else 6), "so many fewer random ones"


def test_cma_es_ignores_user_designs_after_its_start(rng):
    method, _ = learned("cma-es", rng.random((2, 5)))
    before = tuple(method.strategy.centroid)
    better = [Individual(np.full(5, 0.3))]
    worth(better)
    method.learn(better)
    assert tuple(method.strategy.centroid) == before


def test_best_csv_can_be_given(tmp_path):
    first = optimize.run(MIXED, out=tmp_path, generations=1)
    assert designs(tmp_path / "best.csv", MIXED) == tuple(
        {name: one.genes[name] for name in ("speed", "blades", "wall")} for one in first.designs
    )
    again = optimize.run(MIXED, starting_designs=tmp_path / "best.csv", generations=0, seed=5)
    assert again.designs[0].values["cost"] <= first.designs[0].values["cost"]
    bowls = fake_problem(2, met_at=0.6)
    with Cache(tmp_path / "met.h5") as cache:
        outcome = search(bowls, FakeEvaluator(), cache, Settings(generations=2))
    from tisim.optimize.report.report import met_csv

    (tmp_path / "met.csv").write_bytes(met_csv(outcome))
    assert len(designs(tmp_path / "met.csv", bowls)) > 0
    frame = [dict(zip(columns := outcome.to_dict()["designs"][0]["genes"], columns.values(), strict=True))]
    assert designs(frame, bowls) == (outcome.designs[0].genes,)


HEAD = "speed (m/s),blades,wall\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + "3,4\n", "line 2 must be 3 cells; received"),
        (HEAD + "3,4,rough,1\n", "line 2 must be 3 cells; received"),
        (HEAD + "3,4,rough\n11,4,rough\n", "line 3: gene speed must be a number within 1..10 m/s; "),
        (HEAD + "3,4.5,rough\n", "line 2: gene blades must be a whole number within 2..8; received 4.5"),
        (HEAD + "fast,4,rough\n", "line 2: gene speed must be a number; received 'fast'"),
        (HEAD + ",4,rough\n", "line 2: gene speed must be a number; received ''"),
        (HEAD + "nan,4,rough\n", "line 2: gene speed must be a number; received 'nan'"),
        (HEAD + "inf,4,rough\n", "line 2: gene speed must be a number; received 'inf'"),
        (HEAD + "3,4,oily\n", "gene wall must be one of 'smooth', 'rough'; received 'oily'"),
        (HEAD, "must be a CSV file of a heading and one design or more"),
        ("", "must be a CSV file of a heading and one design or more"),
        ("speed (m/s),blades\n3,4\n", "columns must be of all genes, wall among them; received"),
        ("speed (km/h),blades,wall\n3,4,rough\n", r"column speed \(km/h\) must be a gene \(speed \(m/s"),
        ("speed,speed,blades,wall\n3,3,4,rough\n", "headings of .* must be all different"),
        ("speed,blades,wall,length\n3,4,rough,0.3\n", "gene length must be 0.2 m, fixed; received '0.3'"),
        ('speed,blades,wall\n3,4,"rough\n', "must be a CSV file that can be read; received"),
    ],
)  # fmt: skip
def test_invalid_designs_are_refused(tmp_path, text, message):
    (tmp_path / "d.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        designs(tmp_path / "d.csv", MIXED)


def test_files_are_read_as_spreadsheets_write_them(tmp_path):
    """With a byte order mark, Windows line ends, empty lines, columns in any order, and a repeated design."""
    lines = (
        "wall,blades,length (m),speed,turns",
        "rough,4,0.2,2.5,7",
        "",
        "rough,4,.2,2.5,",
        "smooth,2,0.2,1,",
    )
    (tmp_path / "d.csv").write_bytes(b"\xef\xbb\xbf" + "\r\n".join(lines).encode())
    assert designs(tmp_path / "d.csv", MIXED) == (
        {"speed": 2.5, "blades": 4, "wall": "rough"},
        {"speed": 1.0, "blades": 2, "wall": "smooth"},
    )
    with pytest.raises(InputError, match="must be a CSV file that can be read; received"):
        designs(tmp_path / "none.csv", MIXED)
    (tmp_path / "d.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="must be a CSV file that can be read; received"):
        designs(tmp_path / "d.csv", MIXED)
    with pytest.raises(
        InputError, match="starting designs must be a CSV file, or a list of dictionaries; received 3"
    ):
        designs(3, MIXED)
    with pytest.raises(InputError, match="one design or more, and 10000 at most; received 10001"):
        designs([{"speed": 2, "blades": 3, "wall": "rough"}] * 10_001, MIXED)
    with pytest.raises(InputError, match="number of starting designs must be at most max_evaluations = 1"):
        optimize.run(
            MIXED,
            max_evaluations=1,
            starting_designs=[{"speed": k, "blades": 3, "wall": "rough"} for k in (2, 3)],
        )


def test_user_designs_are_part_of_the_search_and_its_file(path):
    one = run(path, beginning=Beginning((BEST,)))
    assert Cache(path).table(f"{one.name}/starting_designs").columns == {k: [v] for k, v in BEST.items()}
    evaluator = FakeEvaluator()
    again = run(path, evaluator, Beginning((BEST,)))
    assert (again.name, again.designs, len(evaluator.digests)) == (one.name, one.designs, 0)
    assert run(path, beginning=Beginning(({**BEST, "x0": 0.2},))).name != one.name


@pytest.mark.parametrize("after", [1, 3, 9, 30])
def test_a_search_interrupted_in_the_user_designs_continues_unchanged(path, tmp_path, after):
    beginning = Beginning(tuple({**BEST, "x0": 0.1 * k} for k in range(4)))
    whole = run(tmp_path / "whole.h5", beginning=beginning, generations=2)
    assert run(path, FakeEvaluator(interrupt_after=after), beginning, generations=2).interrupted
    again = run(path, beginning=beginning, generations=2)
    assert again.designs == whole.designs
    assert repr(list(again.logbook)) == repr(list(whole.logbook))
    assert again.evaluations == whole.evaluations - after


def test_user_designs_beyond_the_budget_are_not_run(path):
    beginning = Beginning(tuple({**BEST, "x0": 0.01 * k} for k in range(30)))
    outcome = run(path, beginning=beginning, max_evaluations=40)
    assert outcome.stopped == "evaluations"
    assert outcome.evaluations <= 40
    assert outcome.logbook[0]["designs"] == len(outcome.estimates) > 10


def measured(count, seed=0, noise=0.0):
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(count):
        design = dict(zip(BEST, rng.random(3).round(6), strict=True))
        rows.append({**design, "fitness": bowl(design, 0, noise=0.0) + noise * rng.normal()})
    return rows


@pytest.mark.parametrize("method", ["genetic", "gaussian-process", "nsga2", "cma-es"])
def test_measured_designs_are_learnt_from_and_not_run(path, method):
    rows = [*measured(40), {**BEST, "fitness": 0.5001}]
    known = experiments(rows, fake_problem(3))
    evaluator = FakeEvaluator()
    outcome = run(path, evaluator, Beginning(experiments=known), method=method, generations=0)
    ran = {tuple(scene.design.values()) for call in evaluator.calls for scene in call}
    assert not ran & {tuple(row[name] for name in BEST) for row in rows}
    if method in ("genetic", "gaussian-process"):
        assert np.linalg.norm(np.array(list(ran)) - 0.3, axis=1).min() < 0.1, (
            "near the best that was measured"
        )
        assert outcome.logbook[0]["designs"] == 8, "no designs spread over the range first"
    assert tuple(BEST.values()) not in [tuple(one.genes.values()) for one in outcome.designs]
    assert len(Cache(path).table(f"{outcome.name}/experiments")) == 41
    again = run(path, FakeEvaluator(), Beginning(experiments=known), method=method, generations=0)
    assert (again.evaluations, again.designs) == (0, outcome.designs)


def test_methods_that_cannot_learn_refuse_measured_designs(path):
    known = experiments(measured(3), fake_problem(3))
    with pytest.raises(
        InputError, match="method must be for experiments: cma-es, gaussian-process, genetic, nsga2"
    ):
        run(path, beginning=Beginning(experiments=known), method="zohdi")


def test_values_of_one_design_are_combined():
    one = combined([1.0, 2.0, 4.0], [math.nan] * 3)
    assert (one.mean, one.std, one.starts) == (7 / 3, np.std([1, 2, 4], ddof=1), 3)
    one = combined([1.0, 2.0], [0.1, 0.2])
    assert one.mean == pytest.approx((100 + 50) / 125)
    assert one.standard_error == pytest.approx(125**-0.5)
    assert combined([1.0, 3.0, 5.0], [0.0, 0.0, 1.0]).mean == 2.0
    assert combined([1.0, 3.0], [0.0, 1.0]).standard_error == 0.0
    with pytest.raises(
        InputError, match="standard error must be given for all values of a design or for none"
    ):
        combined([1.0, 2.0], [0.1, math.nan])


def test_rows_of_experiments(tmp_path):
    two = fake_problem(
        2,
        objective=(Objective("gain", len, "J", maximise=True), Objective("price", len)),
        constraints=[ResultConstraint("load", len, "N", at_most=2.0)],
    )
    (tmp_path / "m.csv").write_text(
        "x0,x1 (m),gain (J),gain std. error,price,load\n"
        "0.25,0.5,3,0.5,1,1\n0.5,0.5,,,1,5\n0.75,0.5,4,,1,3\n0.75,0.5,6,,2,4\n"
    )
    first, failed, twice = experiments(tmp_path / "m.csv", two)
    assert list(first) == [0.25, 0.5]
    assert first.fitness.values == (-3.0, 1.0)
    assert first.estimates[0].standard_error == 0.5
    assert (first.limited, first.violation, first.failed) == ((1.0,), 0.0, False)
    assert failed.failed
    assert twice.fitness.values == (-5.0, 1.5)
    assert twice.estimates[0].standard_error == pytest.approx(1.0)
    assert twice.violation == pytest.approx(0.75)
    individuals = (first, failed, twice)
    again = restored(two, table_of(two, individuals))
    assert [repr((list(one), one.estimates, one.limited, one.violation)) for one in again] == [
        repr((list(one), one.estimates, one.limited, one.violation)) for one in individuals
    ]
    for head, cells, message in (
        ("x0,x1,gain,price", "0,0,1,1", "columns must be of all objectives and constraints, load among them"),
        ("x0,x1,gain,load", "0,0,1,1", "columns must be of all objectives and constraints, price among them"),
        (
            "x0,x1,gain,price,load",
            "0,0,x,1,1",
            "gain must be a number, or empty if there is none; received 'x'",
        ),
        (
            "x0,x1,gain,price,load,price std. error",
            "0,0,1,1,1,-1",
            "price std. error must be 0 or more, or empty",
        ),
        ("x0,x1,gain,price,load,prize", "0,0,1,1,1,1", "column prize must be a gene"),
    ):
        (tmp_path / "m.csv").write_text(f"{head}\n{cells}\n")
        with pytest.raises(InputError, match=f"m.csv, line 2: {message}"):
            experiments(tmp_path / "m.csv", two)


def test_the_noise_of_measured_designs_counts(path):
    """A lucky value with a large standard error does not mislead the search."""
    rows = [{**row, "std. error": 0.001} for row in measured(60)]
    lucky = {"x0": 0.95, "x1": 0.95, "x2": 0.95, "fitness": 0.2, "std. error": 1.0}
    ran = []
    for error in (1.0, 0.001):
        known = experiments([*rows, {**lucky, "std. error": error}], fake_problem(3))
        evaluator = FakeEvaluator()
        file = path.with_name(f"{error}.h5")
        run(file, evaluator, Beginning(experiments=known), method="gaussian-process", generations=0)
        ran.append(np.array([list(scene.design.values()) for scene in evaluator.calls[0]]))
    far = [np.mean(np.linalg.norm(designs - 0.95, axis=1) < 0.3) for designs in ran]
    assert far[0] < 0.2 < far[1]
