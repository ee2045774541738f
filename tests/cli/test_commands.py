"""Commands that print information: cases, explain, check, doctor."""

import csv
import datetime

import pytest

from tisim.analysis import Mean
from tisim.cases import case as catalogue
from tisim.cases.case import Case, Check, Claim, Shown
from tisim.errors import RunError
from tisim.scene.scene import PHYSICS_VERSION


def test_cases_explain_and_version(tisim):
    code, out, _ = tisim("cases")
    assert code == 0
    assert "agglomeration" in out
    assert "--size paper" in out
    assert "surface energy 100 to 100000 J/m^2" in out
    assert "--variant NAME of tisim run: spheres, rods, " in " ".join(out.split())
    code, out, _ = tisim("explain", "agglomeration", "--size", "small")
    assert code == 0
    assert "60 particles" in out
    assert "hardness = 265480 Pa" in out
    assert tisim("--version")[1].startswith("tisim 0.")


@pytest.mark.slow
def test_explain_describes_a_variant(tisim):
    code, out, _ = tisim("explain", "agglomeration", "--size", "small", "--variant", "fields")
    assert code == 0
    assert "near_field" in out
    assert "constant = (0.5, 0, 0) T" in out


def test_check_detects_failures(tisim, monkeypatch):
    checks = [
        Check("one", 1.0, 1.0, 0.0),
        Check("two", 2.1, 2.0, 0.01),
        Check("three", float("nan"), 0.0, 1.0),
    ]
    case = Case("toy", "A toy", "", {}, lambda size, seed: None, lambda: iter(checks))
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": case})
    code, out, err = tisim("check", "toy")
    assert code == 1
    assert [line.split()[-1] for line in out.splitlines()[1:]] == ["pass", "FAIL", "FAIL"]
    assert err.strip().endswith("2 of 3 checks failed")
    checks[1:] = []
    assert tisim("check", "toy")[0] == 0


def test_checks_before_a_failed_run_are_printed(tisim, monkeypatch):
    def check():
        yield Check("one", 1.0, 1.0, 0.0)
        raise RunError("a run failed")

    case = Case("toy", "A toy", "", {}, lambda size, seed: None, check)
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": case})
    code, out, err = tisim("check", "toy")
    assert (code, out.splitlines()[1].split()) == (1, ["one", "1", "1", "0.0e+00", "0.0e+00", "pass"])
    assert err.splitlines() == ["checked: one", "a run failed"]


def test_check_writes_what_it_prints(tisim, monkeypatch, tmp_path):
    """Numbers keep all digits, means their intervals; failed checks are written too."""
    items = [
        Check("one, m", 0.1 + 0.2, 0.3, 1e-3),
        Claim("two", Mean(0.5, 0.125), least=0.4),
        Shown("three", 7.0, "L21: 6"),
        Check("four", 2.0, 1.0, 0.5),
    ]
    case = Case("toy", "A toy", "", {}, lambda size, seed: None, lambda: iter(items))
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": case})
    assert tisim("check", "toy", "--out", "toy.csv")[0] == 1
    with (tmp_path / "toy.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["check"] for line in lines] == ["one, m", "two", "three", "four"]
    assert [float(line["measured"]) for line in lines] == [0.1 + 0.2, 0.5, 7.0, 2.0]
    assert [line["half_interval"] for line in lines] == ["", "0.125", "", ""]
    assert [line["expected"] for line in lines] == ["0.3", "above 0.4", "L21: 6", "1"]
    assert [line["verdict"] for line in lines] == ["pass", "FAIL", "", "FAIL"]
    assert {line["case"] for line in lines} == {"toy"}
    assert {line["physics"] for line in lines} == {str(PHYSICS_VERSION)}
    assert {line["date"] for line in lines} == {datetime.datetime.now(tz=datetime.UTC).date().isoformat()}
    items[1:] = []
    assert tisim("check", "toy", "--out", "toy.csv")[0] == 0
    (tmp_path / "mine.csv").write_text("mine")
    code, _, err = tisim("check", "toy", "--out", "mine.csv")
    assert code == 2
    assert "would replace (or give --overwrite)" in err
    assert (tmp_path / "mine.csv").read_text() == "mine"
    code, _, err = tisim("check", "toy", "--out", "toy.txt")
    assert (code, err) == (2, "--out must be a file NAME.csv; received 'toy.txt'\n")


def doctor(tisim, monkeypatch, taichi, quadrants):
    """The output of ``tisim doctor`` for given step times in ms with each backend; an empty time means that
    the backend is absent."""
    times = {"taichi": taichi, "quadrants": quadrants}
    there = [name for name, measured in times.items() if measured]
    monkeypatch.setattr("tisim.backend.choice.installed", lambda: there)
    measured = {
        name: {scene: 1e-3 * ms for scene, ms in zip(("charges", "grains in contact"), each, strict=False)}
        for name, each in times.items()
    }
    monkeypatch.setattr("tisim.describe.diagnostics.step_times_of", measured.get)
    code, out, _ = tisim("doctor")
    assert code == 0
    return " ".join(out.split())


def test_doctor(tisim, monkeypatch):
    monkeypatch.setattr("tisim.describe.diagnostics.BACKEND", "taichi")
    monkeypatch.setenv("TISIM_BACKEND", "taichi")
    zen_3 = {"vendor_id": "AuthenticAMD", "cpu family": "25", "model": "1"}
    zen_4 = {**zen_3, "model": "17"}
    monkeypatch.setattr("tisim.describe.diagnostics.processor", lambda: zen_4)
    monkeypatch.setattr("tisim.backend.processor.processor", lambda: zen_4)
    out = doctor(tisim, monkeypatch, (3.0, 0.2), (1.0, 0.1))
    for word in ("backend", "LLVM", "processor", "cores", "memory", "cuda", "numpy"):
        assert word in out
    assert "steps timed 1000 charges and 1000 grains in contact" in out
    assert "taichi, one core, f64 3 ms and 0.2 ms in use" in out
    assert "znver4 is known from LLVM 16 on, not to LLVM 15" in out
    assert "3.00 and 2.00 times as fast faster here: leave TISIM_BACKEND out" in out
    out = doctor(tisim, monkeypatch, (1.0, 0.1), (1.0, 0.1))
    assert "1.00 and 1.00 times as fast no gain here from changing" in out
    out = doctor(tisim, monkeypatch, (1.0, 0.1), ())
    assert "not compared quadrants is not installed" in out
    assert "python -m pip install 'quadrants>=" in out
    monkeypatch.setattr("tisim.describe.diagnostics.processor", lambda: zen_3)
    monkeypatch.delenv("TISIM_BACKEND")
    out = doctor(tisim, monkeypatch, (3.0, 0.2), (1.0, 0.1))
    assert "faster here: set TISIM_BACKEND=quadrants" in out
    out = doctor(tisim, monkeypatch, (1.0, 0.1), ())
    assert "not compared python -m pip install 'quadrants>=" in out
