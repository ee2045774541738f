import csv
import io

import numpy as np
import pytest
from matplotlib.image import imread
from rich.console import Console

from tests.optimize.fake_runs import FakeEvaluator, bowl, fake_problem
from tisim import RunError, optimize
from tisim.cases.agglomeration.problem import problem as agglomeration
from tisim.optimize import Gene, Problem
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.individual import Individual
from tisim.optimize.outcome import Outcome, Progress
from tisim.optimize.problem.objective import Objective
from tisim.optimize.report import convergence, report
from tisim.optimize.report.display import Display
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.optimize.tables import best_columns

N = 1000
DERIVED = {
    "b_f/b_0": lambda fitness: N ** (1 / 3) * (1 - fitness),
    "n_f": lambda fitness: N * (1 - fitness) ** 3,
}


def outcome_of(tmp_path, function=bowl, **settings):
    problem = fake_problem(symbol="Pi", title="Bowl", derived=DERIVED)
    with Cache(tmp_path / "cache.h5") as cache:
        return search(
            problem,
            FakeEvaluator(function),
            cache,
            Settings(**{"method": "zohdi", "generations": 9, "seed": 1, **settings}),
        )


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    return outcome_of(tmp_path_factory.mktemp("search"))


def test_csv_holds_all_digits(outcome, tmp_path):
    paths = report.write(outcome, tmp_path / "out")
    with paths["best.csv"].open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == (
        [
            "rank",
            "x0 (m)",
            "x1 (m)",
            "x2 (m)",
            "x3 (m)",
            "Pi",
            "std. error",
            "b_f/b_0",
            "n_f",
            "starts",
            "converged",
            "Pi, fresh starts",
            "95 % low, fresh starts",
            "95 % high, fresh starts",
            "b_f/b_0, fresh starts",
            "n_f, fresh starts",
            "starts, fresh starts",
        ]
    )
    assert [int(row["rank"]) for row in rows] == [1, 2, 3, 4, 5, 6]
    for row, individual in zip(rows, outcome.hall, strict=True):
        assert [float(row[f"x{i} (m)"]) for i in range(4)] == list(individual)
        assert float(row["Pi"]) == individual.estimates[0].mean
        assert float(row["std. error"]) == individual.estimates[0].standard_error
        assert float(row["Pi, fresh starts"]) == individual.confirmed[0].mean
        assert float(row["95 % low, fresh starts"]) == individual.confirmed[0].low
        assert float(row["95 % high, fresh starts"]) == individual.confirmed[0].high
        assert float(row["n_f"]) == pytest.approx(float(row["b_f/b_0"]) ** 3)


def test_a_full_disk_is_reported_and_keeps_the_old_files(outcome, tmp_path, monkeypatch):
    old = {name: path.read_bytes() for name, path in report.write(outcome, tmp_path).items()}

    def full(handle, data, offset):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tisim.files.atomic.os.pwrite", full)
    with pytest.raises(RunError, match=r"best\.csv could not be written: No space left on device"):
        report.write(outcome, tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == old


def test_derived_columns_reproduce_z04_table_3():
    assert DERIVED["b_f/b_0"](0.67708) == pytest.approx(3.2292, abs=1e-4)
    assert DERIVED["n_f"](0.67708) == pytest.approx(33.6732, abs=2e-3)


def printed_lines(outcome, width=80):
    """Lines of the table of the best designs, from the headings to the last row."""
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(report.best_table(outcome))
    lines = console.export_text().splitlines()
    assert max(map(len, lines)) <= width
    return lines[lines.index("") + 1 :]


def test_terminal_table_shows_the_best_designs(outcome):
    rows = printed_lines(outcome)
    assert [row[:6].split(" ")[0] for row in rows] == [
        *("rank", "x0", "x1", "x2", "x3", "Pi", "std.", "b_f/b_", "n_f", "starts"), "conver",
        *("Pi,", "95", "95", "b_f/b_", "n_f,", "starts"),
    ]  # fmt: skip
    assert rows[0].split() == ["rank", *"123456"]
    assert rows[5].split() == ["Pi", *(f"{individual.estimates[0].mean:.4g}" for individual in outcome.hall)]


def agglomerations(number):
    """Designs of Z04's ten genes, with values such as 1.234e15."""
    outcome = Outcome(agglomeration("paper"), Settings(), {"problem": "agglomeration"})
    individuals = []
    for k in range(number):
        individual = Individual([0.851234 + k / 200] * 10)
        individual.estimates = (FitnessEstimate(0.712345 + k / 1e3, 0.1, 0.70123, 0.72345, 48, k % 2 == 0),)
        individual.confirmed = individual.estimates
        individuals.append(individual)
    outcome.hall.fill(individuals)
    return outcome


@pytest.mark.parametrize("number", [1, 6, 20])
def test_no_row_wraps_on_80_columns(number):
    outcome = agglomerations(number)
    headings = list(best_columns(outcome.problem, outcome.hall))
    rows = [line for line in printed_lines(outcome) if line]
    blocks = -(-number // 6)
    assert len(rows) == blocks * len(headings)
    for k, row in enumerate(rows):
        heading = headings[k % len(headings)]
        assert row.startswith(heading)
        places = min(6, number - 6 * (k // len(headings)))
        assert len(row.removeprefix(heading).split()) == places, "the name and all values on one line"


def test_symbols_of_the_table_are_explained_under_it(outcome):
    def headings(outcome):
        console = Console(width=80, record=True, file=io.StringIO())
        console.print(report.notes(outcome))
        return [line.split(": ")[0] for line in console.export_text().splitlines() if ": " in line]

    words = ["starts", "std. error", "converged", "fresh starts", "95 % low, 95 % high"]
    assert headings(outcome) == words
    words.remove("converged")  # no tolerance was asked for
    assert headings(agglomerations(2)) == [
        "Pi",
        "b_f / b_0",
        "n_f",
        *words,
    ]
    assert headings(agglomerations(0)) == []
    headings = best_columns(agglomerations(2).problem, agglomerations(2).hall)
    assert set(agglomeration("paper").meanings) <= set(headings)


def moves(figure):
    """Generations that a picture marks because the search box moved after them."""
    return [line.get_xdata()[0] for line in figure.axes[0].get_lines() if line.get_linestyle() == ":"]


def test_a_move_of_the_search_box_after_the_end_is_not_marked(tmp_path):
    outcome = outcome_of(tmp_path, generations=4)
    assert outcome.logbook.select("recentred")[-1]
    assert moves(convergence.convergence_figure(outcome)) == []


def test_convergence_figure_shows_the_logbook(outcome, tmp_path):
    figure = convergence.convergence_figure(outcome)
    top, bottom = figure.axes
    curves = {line.get_label(): list(line.get_ydata()) for line in top.get_lines()}
    assert curves["best"] == outcome.logbook.select("best")
    assert curves["mean of the population"] == outcome.logbook.select("mean")
    assert list(bottom.get_lines()[0].get_ydata()) == [DERIVED["b_f/b_0"](x) for x in curves["best"]]
    assert moves(figure) == [4, 8]
    assert (top.get_ylabel(), bottom.get_ylabel()) == ("Π", "$b_{f}$/$b_{0}$ of the best")
    paths = report.write(outcome, tmp_path / "out")
    assert imread(paths["convergence.png"]).std() > 0.01
    assert paths["convergence.pdf"].read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("settings", [{"generations": 0}, {"wall_clock_s": 1e-9}])
def test_report_of_failures_and_of_nothing(tmp_path, settings):
    outcome = outcome_of(tmp_path, lambda design, seed: "broken", **settings)
    paths = report.write(outcome, tmp_path / "out")
    assert len(paths["best.csv"].read_text().splitlines()) == 1
    assert printed_lines(outcome)[0].strip() == "rank"


def spread(table):
    """Rows of the table of designs that meet the target, by their first word."""
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(table)
    title, *rows = [line for line in console.export_text().splitlines() if line]
    return title, {row.split()[0]: row.split()[-4:] for row in rows}


@pytest.mark.parametrize("maximise", [False, True])
def test_designs_that_meet_the_target_are_reported_with_their_spread(tmp_path, maximise):
    """Designs of a bowl below 0.6, or of the inverted bowl above -0.6; a gene without effect spreads over its
    whole range."""
    sign = -1 if maximise else 1

    def flat_in_x0(design, seed):
        return bowl({name: value for name, value in design.items() if name != "x0"}, 0, noise=0.0)

    objective = Objective("depth", lambda result: sign * result.value, maximise=maximise)
    problem = fake_problem(genes=3, objective=(objective,), met_at=sign * 0.6)
    with Cache(tmp_path / "cache.h5") as cache:
        found = search(
            problem, FakeEvaluator(flat_in_x0), cache, Settings(seed=1, method="random", generations=9)
        )
    met = [one for one in found.estimates if sum((x - 0.3) ** 2 for x in one[1:]) <= 0.1]
    assert 4 < len(met) < 0.7 * len(found.estimates)
    title, rows = spread(report.met_table(found))
    bound = "at least -0.6" if maximise else "at most 0.6"
    assert title == f"{len(met)} of {len(found.estimates)} designs have depth of {bound}"
    for k, name in enumerate(("x0", "x1", "x2")):
        values = [one[k] for one in met]
        low, high, part, _ = rows[name]
        assert (float(low), float(high)) == pytest.approx((min(values), max(values)), rel=1e-3)
        assert float(part) == pytest.approx(100 * (max(values) - min(values)), abs=0.6)
    assert float(rows["x0"][2]) > 80 > 70 > float(rows["x1"][2])
    lines = list(csv.reader(report.met_csv(found).decode().splitlines()))
    assert lines[0] == ["x0 (m)", "x1 (m)", "x2 (m)", "depth"]
    assert sorted(tuple(map(float, line[:3])) for line in lines[1:]) == sorted(met)
    depths = [sign * float(line[3]) for line in lines[1:]]
    assert depths == sorted(depths)


def test_a_target_met_by_no_design_is_reported(tmp_path):
    problem = fake_problem(met_at=0.1)
    with Cache(tmp_path / "cache.h5") as cache:
        found = search(problem, FakeEvaluator(), cache, Settings(seed=1, generations=1))
    title, rows = spread(report.met_table(found))
    assert title == f"0 of {len(found.estimates)} designs have fitness of at most 0.1"
    assert rows == {}
    assert {path.name for path in report.write(found, tmp_path / "out").values()} >= {"best.csv", "met.csv"}


def rare(design, seed):
    """One start in 40 gives a different result."""
    return design["x"] + (np.random.default_rng(seed).random() < 1 / 40)


def test_starts_with_equal_results_count_separately():
    problem = Problem.of_function(rare, [Gene("x", "m", 0, 1)])
    kept = {"select": 0, "confirm": 0}
    outcome = optimize.run(problem, method="random", options={"population": 20}, generations=0, ensemble=kept)
    assert outcome.best.estimates[0].std == 0
    assert outcome.designs[0].intervals["value"] is None
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(report.notes(outcome))
    assert "starts: number of random starts in the mean" in console.export_text()


@pytest.mark.parametrize(
    ("budget", "part", "reached"),
    [(None, 0.25, "2 of 9"), (40, 0.5, "2, 20 of 40 runs"), (1000, 0.25, "2 of 9")],
)
def test_the_bar_goes_to_its_end_by_generations_or_by_the_budget(budget, part, reached):
    settings = Settings(generations=9, max_evaluations=budget)
    display = Display(fake_problem(), settings, Console(file=io.StringIO()))
    display.step(Progress(2, 9, 0.5, (1.0,), 1, None, 14, 6, 1.0))
    assert display.bar.tasks[0].percentage == pytest.approx(100 * part)
    assert display.bar.tasks[0].fields["reached"] == f"generation {reached}"
