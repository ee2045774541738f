"""A folder belongs to one search: another one is refused before it runs, and nothing is overwritten."""

import pytest
from fake_runs import FakeEvaluator, fake_problem

from cases import case as catalogue
from cases.case import Case, Size
from tisim.cli import main

BOWL = Case(
    "bowl", "A bowl", "none", {"default": Size("", {}, {"population": 8, "parents": 2})},
    scene=lambda size, seed: None, check=lambda: iter(()), problem=lambda size, variant: fake_problem(2),
    variants=("only",),
)  # fmt: skip
SEARCH = ["optimize", "bowl", "--out", "s", "--generations", "1"]


@pytest.fixture
def optimize(tmp_path, monkeypatch, capsys):
    """Runs a search in a fresh folder with more arguments: (exit code, standard error)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(catalogue, "every", lambda: {BOWL.name: BOWL})
    monkeypatch.setattr("optimize.session.Evaluator", FakeEvaluator)

    def command(*arguments):
        with pytest.raises(SystemExit) as exit_:
            main([*SEARCH, *map(str, arguments)])
        return exit_.value.code, capsys.readouterr().err

    return command


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_another_search_is_refused_and_the_same_goes_on(optimize, tmp_path):
    folder = tmp_path / "s"
    assert optimize("--seed", 1)[0] == 0
    first = contents(folder)
    rule = (
        "output folder must be without another search (or give --out, or --fresh --overwrite); received 's'"
    )
    for other, differ in {
        ("--seed", 2): "search.seed = 1 and not 2",
        ("--seed", 1, "--population", 9, "--set", "search.ensemble.block=2"): (
            "search.ensemble.block = 6 and not 2, search.population = 8 and not 9"
        ),
    }.items():
        code, err = optimize(*other)
        assert (code, err.strip()) == (2, f"{rule}, where one has {differ}")
        assert contents(folder) == first
    assert optimize("--seed", 1, "--generations", 2)[0] == 0
    assert contents(folder)["best.csv"] != first["best.csv"]
    code, err = optimize("--seed", 2, "--overwrite")
    assert (code, err.strip()) == (2, "--overwrite must be given with --fresh; received '--overwrite'")
    code, err = optimize("--seed", 2, "--fresh", "--overwrite", "--target", 1e9, "--generations", 0)
    assert code == 0
    assert contents(folder)["best.csv"] != first["best.csv"]
    assert optimize("--seed", 1)[0] == 2
