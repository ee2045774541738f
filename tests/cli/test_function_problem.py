"""tisim optimize on a plain function in the user's file, with one gene fixed at a value."""

import csv

import pytest

from tisim.cli.main import main

TEXT = """
from tisim.optimize import Choice, Gene, Problem


def worth(design):
    return (design["x"] - 0.3) ** 2 + (design["wall"] == "flat")


PROBLEM = Problem.of_function(worth, [Gene("x", "m", 0.0, 1.0), Choice("wall", ("flat", "round"))])
SEARCH = {"generations": 3, "options": {"population": 8}}
"""


def run(*arguments):
    with pytest.raises(SystemExit) as end:
        main(["optimize", *arguments])
    return end.value.code


def best(folder):
    with (folder / "best.csv").open(encoding="utf-8") as file:
        return next(csv.DictReader(file))


def test_a_gene_is_kept_at_a_value(own_file, tmp_path, capsys):
    file = own_file("own_function.py", TEXT)
    assert run(str(file), "--out", str(tmp_path / "a")) == 0
    assert best(tmp_path / "a")["wall"] == "round"
    assert run(str(file), "--out", str(tmp_path / "b"), "--fix", "wall=flat", "--fix", "x=0.5") == 2
    assert "genome must be one gene or more that is searched" in capsys.readouterr().err.replace("\n", " ")
    assert run(str(file), "--out", str(tmp_path / "b"), "--fix", "wall=flat") == 0
    row = best(tmp_path / "b")
    assert row["wall"] == "flat"
    assert float(row["value"]) >= 1.0
    assert not (tmp_path / "b/best_scene.toml").exists()
    assert run(str(file), "--out", str(tmp_path / "b"), "--resume") == 2
    assert "genes.wall is" in capsys.readouterr().err.replace("\n", " ")
    assert run(str(file), "--out", str(tmp_path / "b")) == 0, "another search of the folder"
    assert best(tmp_path / "b") == best(tmp_path / "a")


def test_invalid_fixed_genes_are_refused(own_file, tmp_path, capsys):
    file = own_file("own_function.py", TEXT)
    for assignment, message in (
        ("walls=flat", "gene to fix must be one of x, wall; received 'walls'"),
        ("x=2", "gene x must be a number within 0..1 m; received 2"),
        ("x", "--fix must be key=value; received 'x'"),
    ):
        assert run(str(file), "--out", str(tmp_path / "c"), "--fix", assignment) == 2
        assert message in " ".join(capsys.readouterr().err.split())
