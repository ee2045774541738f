"""tisim hard: its list, its verdicts, its files, its errors, and the table of its page."""

import csv
import json
import re
import runpy
from pathlib import Path

import h5py
import pytest

from tisim.cases.hard import hard_case as registry
from tisim.cases.hard.hard_case import Criterion, HardCase, hard_cases, title

DOCS = Path(__file__).parents[2] / "docs"
CASES = [case for cases in hard_cases().values() for case in cases]


def test_the_list_has_every_case_with_its_bounds(tisim):
    code, out, _ = tisim("hard")
    assert code == 0
    words = " ".join(out.split())
    for case in CASES:
        assert f"{case.name} {case.difficulty}" in words
        for bound in case.bounds:
            assert bound.quantity in words
    assert len(CASES) > 35
    assert all(len(cases) > 1 for cases in hard_cases().values())


@pytest.fixture
def toy(monkeypatch):
    """Replace the measurement of a case; returns a function that takes the numbers."""

    def replace(*numbers):
        case = HardCase(
            "toy", "springs", "It is soft.", (Criterion("a", 1.0), Criterion("b", 3, 3)), lambda: numbers
        )
        monkeypatch.setattr(registry, "selected", lambda names: [case])

    return replace


@pytest.mark.parametrize(
    ("numbers", "verdicts", "code"),
    [((1.0, 3), "pass pass", 0), ((1.1, 3), "FAIL pass", 1), ((0.0, 4), "pass FAIL", 1),
     ((float("nan"), 3), "FAIL pass", 1)],
)  # fmt: skip
def test_a_number_out_of_bounds_gives_exit_code_1(tisim, toy, numbers, verdicts, code):
    toy(*numbers)
    found, out, err = tisim("hard", "toy")
    assert found == code
    assert [line.split()[-1] for line in out.splitlines()[1:]] == verdicts.split()
    assert ("1 of 2 numbers are out of bounds" in err) == (code == 1)


def test_files_hold_the_numbers_and_where_they_come_from(tisim, tmp_path, toy):
    toy(0.5, 3)
    code, out, _ = tisim("hard", "toy", "--out", "here")
    assert code == 0
    assert [Path(line).name for line in out.splitlines()[-3:]] == [
        "hard_cases.csv", "hard_cases.h5", "hard_cases.md"
    ]  # fmt: skip
    with (tmp_path / "here/hard_cases.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["case"], row["quantity"], float(row["number"]), row["ok"]) for row in rows] == [
        ("toy", "a", 0.5, "True"), ("toy", "b", 3.0, "True")
    ]  # fmt: skip
    with h5py.File(tmp_path / "here/hard_cases.h5") as file:
        assert file["number"][:].tolist() == [0.5, 3.0]
        assert json.loads(file.attrs["settings"])["precision"] == "f64"
        assert "tisim" in json.loads(file.attrs["versions"])
        assert file.attrs["machine"]
    assert "| a | 0.5 | at most 1 |" in (tmp_path / "here/hard_cases.md").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["sprongs"], "hard case must be a family (springs, "),
        (["springs", "--all"], "--all must be given without names; received"),
        (["--out", "x"], "--out must be given with names or --all; received"),
        (["springs", "--device", "abacus"], "device must be one of cpu, cuda, vulkan"),
    ],
)
def test_wrong_input_runs_and_writes_nothing(tisim, tmp_path, words, message):
    code, out, err = tisim("hard", *words)
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    assert list(tmp_path.iterdir()) == []


def test_a_case_is_measured(tisim):
    code, out, _ = tisim("hard", "time_of_a_million_steps")
    assert code == 0
    assert out.count(" pass") == 3


def test_the_table_of_the_page_is_of_these_cases_and_bounds():
    page = (DOCS / "hard_cases.md").read_text(encoding="utf-8")
    _, table, _ = runpy.run_path(str(DOCS / "hard_table.py"))["parts"](page)
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if line[:1] == "|"
    ]
    found = [(row[0], row[2]) for row in rows if row[0] not in ("case and number", "---")]
    expected = []
    for case in CASES:
        expected.append((f"**{case.name}** {case.difficulty}", ""))
        expected += [(bound.quantity, bound.allowed) for bound in case.bounds]
    assert found == expected
    assert re.findall(r"^### (.+)$", table, re.M) == [title(family) for family in hard_cases()]
    assert "FAIL" not in table
    assert re.search(r"\d cases, \d+ numbers, \d+ s of processor time .* \d{4}-\d\d-\d\d, \w", table)


def test_pictures_of_the_page_are_of_cases_with_one():
    page = (DOCS / "hard_cases.md").read_text(encoding="utf-8")
    drawn = {f"hard_{case.figure.name}.png" for case in CASES if case.figure}
    assert set(re.findall(r"\((\w+\.png)\)", page)) == drawn
