import csv
import io

import pytest
from fake_runs import FakeEvaluator, bowl, fake_problem
from matplotlib.image import imread
from rich.console import Console

from optimize import report
from optimize.cache import Cache
from optimize.search import search
from optimize.settings import Settings

N = 1000
DERIVED = {
    "b_f/b_0": lambda fitness: N ** (1 / 3) * (1 - fitness),
    "n_f": lambda fitness: N * (1 - fitness) ** 3,
}


def outcome_of(tmp_path, function=bowl, **settings):
    problem = fake_problem(symbol="Pi", title="Bowl", derived=DERIVED)
    with Cache(tmp_path / "cache.h5") as cache:
        return search(
            problem, FakeEvaluator(function), cache, Settings(**{"generations": 9, "seed": 1, **settings})
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
            "95 % +-",
            "b_f/b_0",
            "n_f",
            "starts",
            "status",
        ]
    )
    assert [int(row["rank"]) for row in rows] == [1, 2, 3, 4, 5, 6]
    for row, string in zip(rows, outcome.hall, strict=True):
        assert [float(row[f"x{i} (m)"]) for i in range(4)] == list(string)
        assert float(row["Pi"]) == string.estimate.mean
        assert float(row["95 % +-"]) == string.estimate.half_width
        assert float(row["n_f"]) == pytest.approx(float(row["b_f/b_0"]) ** 3)


def test_derived_columns_reproduce_z04_table_3():
    assert DERIVED["b_f/b_0"](0.67708) == pytest.approx(3.2292, abs=1e-4)
    assert DERIVED["n_f"](0.67708) == pytest.approx(33.6732, abs=2e-3)


def test_terminal_table_fits_80_columns(outcome):
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(report.best_table(outcome))
    text = console.export_text()
    assert max(len(line) for line in text.splitlines()) <= 80
    assert f"{outcome.best.estimate.mean:.4g}" in text
    for heading in ("rank", "x0 (m)", "Pi", "95 % +-", "n_f", "starts", "status"):
        assert heading in text


def test_convergence_figure_shows_the_logbook(outcome, tmp_path):
    figure = report.convergence_figure(outcome)
    top, bottom = figure.axes
    curves = {line.get_label(): list(line.get_ydata()) for line in top.get_lines()}
    assert curves["best"] == outcome.logbook.select("best")
    assert curves["mean of the population"] == outcome.logbook.select("mean")
    assert list(bottom.get_lines()[0].get_ydata()) == [DERIVED["b_f/b_0"](x) for x in curves["best"]]
    marked = [line.get_xdata()[0] for line in top.get_lines() if line.get_linestyle() == ":"]
    assert marked == [4, 8]
    assert (top.get_ylabel(), bottom.get_ylabel()) == ("Pi", "b_f/b_0 of the best")
    paths = report.write(outcome, tmp_path / "out")
    assert imread(paths["convergence.png"]).std() > 0.01
    assert paths["convergence.pdf"].read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("settings", [{"generations": 0}, {"wall_clock_s": 1e-9}])
def test_report_of_failures_and_of_nothing(tmp_path, settings):
    outcome = outcome_of(tmp_path, lambda design, seed: "broken", **settings)
    paths = report.write(outcome, tmp_path / "out")
    assert len(paths["best.csv"].read_text().splitlines()) == 1
    assert report.best_table(outcome).row_count > 0
