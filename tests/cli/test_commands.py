"""The commands that tell something: cases, explain, check, doctor."""

from cases import case as catalogue
from cases.case import Case, Check


def test_cases_explain_and_version(tisim):
    code, out, _ = tisim("cases")
    assert code == 0
    assert "agglomeration" in out
    assert "--size paper" in out
    assert "surface energy 100 to 100000 J/m^2" in out
    code, out, _ = tisim("explain", "agglomeration", "--size", "small")
    assert code == 0
    assert "60 particles" in out
    assert "hardness = 265480 Pa" in out
    assert tisim("--version")[1].startswith("tisim 0.")


def test_check_tells_right_from_wrong(tisim, monkeypatch):
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


def test_doctor(tisim, monkeypatch):
    monkeypatch.setattr("tisim.backend.diagnostics.rate_of", lambda backend: {"taichi": 1e8}.get(backend))
    code, out, _ = tisim("doctor")
    assert code == 0
    for word in ("backend", "LLVM", "processor", "cores", "memory", "cuda", "numpy", "'tisim[quadrants]'"):
        assert word in out
