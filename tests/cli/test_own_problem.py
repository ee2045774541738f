"""tisim optimize and compare on a user's Python file; a user's case in all commands."""

import csv
from pathlib import Path

import pytest

from tests.optimize.shared_case import skip_pictures
from tests.own_files import LAW, PROBLEM
from tisim.optimize.storage.cache import Cache

SEARCH = ["optimize", "my_drift.py", "--out", "s"]


@pytest.fixture(autouse=True)
def without_pictures(monkeypatch):
    skip_pictures(monkeypatch.setattr)


def runs(path="s/search.h5"):
    return {record.key for record in Cache(path).records()}


@pytest.mark.long
def test_a_search_of_a_problem_and_its_continuation(tisim, own_file):
    own_file("my_drift.py", PROBLEM)
    more = ["--set", "search.ensemble.block=2", "--population", "8", "--seed", "3"]
    code, out, err = tisim(*SEARCH, *more)
    assert code == 0, err
    assert "R" in out
    heading, *rows = csv.reader(Path("s/best.csv").read_text().splitlines())
    assert heading[:3] == ["rank", "speed (m/s)", "R"]
    assert all(1 <= float(row[1]) <= 20 for row in rows)
    stored_runs = runs()
    assert tisim(*SEARCH, *more, "--generations", "2")[0] == 0
    assert stored_runs < runs()


@pytest.mark.long
@pytest.mark.slow
def test_another_objective_in_the_file_is_another_search(tisim, own_file):
    """Evaluations of the old objective are not used for the new one."""
    own_file("my_drift.py", PROBLEM)
    begun = [*SEARCH, "--generations", "0"]
    assert tisim(*begun)[0] == 0
    stored_runs = runs()
    own_file("my_drift.py", PROBLEM.replace(".mean()", ".max()"))
    code, _, err = tisim(*begun)
    assert code == 2
    assert "(the problem file, or a value that its functions use, has changed)" in " ".join(err.split())
    assert tisim(*begun, "--out", "t")[0] == 0
    assert not stored_runs & runs("t/search.h5")


@pytest.mark.long
@pytest.mark.slow
def test_another_law_in_the_file_is_other_physics(tisim, own_file):
    text = LAW + PROBLEM.replace("duration=2e-3", "duration=2e-3,\n        effects=(Pull(strength=1e-9),)")
    own_file("my_drift.py", text)
    assert tisim(*SEARCH, "--generations", "0")[0] == 0
    digest = _digest()
    own_file("my_drift.py", text.replace("-self.strength(w)", "-2.0 * self.strength(w)"))
    assert tisim(*SEARCH, "--generations", "0", "--out", "t")[0] == 0
    assert _digest() != digest


def _digest():
    import my_drift

    return my_drift.scene({"speed": 2.0}, 1).digest()


@pytest.mark.long
def test_methods_are_compared_on_a_problem(tisim, own_file):
    own_file("my_drift.py", PROBLEM)
    options = ["--methods", "random,zohdi", "--evaluations", "12", "--repeats", "2", "--fresh-starts", "2"]
    code, out, err = tisim("compare", "my_drift.py", *options)
    assert code == 0, err
    assert "zohdi" in out


CASE = """
from tisim.cases.case import Case, Check, Size


def check():
    yield Check("two and two", 2.0 + 2.0, 4.0, 0.0)


CASE = Case(
    "drift", "Free grains", "none", {"default": Size("5 grains", {}, SEARCH)},
    scene=lambda size, seed: scene({"speed": 5.0}, seed), check=check, problem=lambda size, variant: PROBLEM,
)
"""


def test_shown_values_are_not_checked(tisim, own_file):
    more = "Shown('three', 3.0, 'more')", "Check('one', 1.0, 2.0, 0.0)"
    wrong = CASE.replace("4.0, 0.0)", "\n    yield ".join(("4.0, 0.0)", *more)))
    own_file("my_case.py", PROBLEM + "from tisim.cases.case import Shown\n" + wrong)
    code, out, err = tisim("check", "my_case.py")
    assert code == 1
    assert "1 of 2 checks failed" in err
    verdicts = {line.split()[0]: line.split()[-1] for line in out.splitlines() if line.strip()}
    assert (verdicts["two"], verdicts["three"], verdicts["one"]) == ("pass", "more", "FAIL")


@pytest.mark.long
def test_a_case_is_run_checked_and_searched(tisim, own_file):
    own_file("my_case.py", PROBLEM + CASE)
    code, out, err = tisim("run", "my_case.py", "--seed", "2", "--set", "duration=1e-3")
    assert code == 0, err
    assert "out/drift/result.h5" in out
    assert tisim("check", "my_case.py")[:1] == (0,)
    own_file(
        "my_other_case.py",
        (PROBLEM + CASE).replace("PROBLEM =", "_PROBLEM =").replace(": PROBLEM", ": _PROBLEM"),
    )
    assert tisim("optimize", "my_other_case.py", "--generations", "0")[0] == 0


WRONG = {
    "x = 1": "my_drift.py must be a file with a PROBLEM or a CASE; received ['x']",
    "PROBLEM = 1": "PROBLEM of my_drift.py must be an optimize.Problem; received 1",
    "CASE = 1": "CASE of my_drift.py must be a cases.case.Case; received 1",
    PROBLEM + "SEARCH = 3": "SEARCH of my_drift.py must be settings of the search, by name; received 3",
    PROBLEM + "SEARCH = {'seeds': 3}": "search.seeds must be a known key: seed, method, ",
    "1 / 0": "line 1: ZeroDivisionError: division by zero",
}


@pytest.mark.parametrize("text", WRONG)
def test_an_invalid_file_gives_one_line(tisim, own_file, text):
    own_file("my_drift.py", text)
    code, out, err = tisim(*SEARCH)
    assert (code, out) == (2, "")
    assert WRONG[text] in err
    assert err.count("\n") == 1


def test_size_and_variant_are_of_cases(tisim, own_file):
    own_file("my_drift.py", PROBLEM)
    for option in ("--size", "--variant"):
        code, _, err = tisim(*SEARCH, option, "small")
        assert (code, err) == (2, f"{option} must be given for a case only; received 'small'\n")
    code, _, err = tisim("run", "my_drift.py")
    assert code == 2
    assert "my_drift.py must be a file with a CASE; received [" in err
