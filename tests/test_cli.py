"""The command line as a newcomer meets it: what it writes, what it says, and its exit codes."""

import os
import signal

import h5py
import numpy as np
import pytest

from cases import case as catalogue
from cases.case import Case, Check, Size
from optimize.cache import Cache
from optimize.genome import Gene, Genome
from optimize.problem import Problem
from tisim import Box, Cloud, Scene
from tisim.cli import main
from tisim.effects.impact import Impact
from tisim.interrupt import Interrupt
from tisim.picture import cloud
from tisim.steppers.controller import FixedStep
from tisim.steppers.verlet import Verlet


@pytest.fixture
def tisim(tmp_path, monkeypatch, capsys):
    """Runs a command in a fresh folder: (exit code, standard output, standard error)."""
    monkeypatch.chdir(tmp_path)

    def command(*arguments):
        with pytest.raises(SystemExit) as exit_:
            main([str(argument) for argument in arguments])
        return exit_.value.code, *capsys.readouterr()

    return command


@pytest.fixture
def toml(tmp_path):
    """A scene file that is quick to compile and run, in several looks at progress."""
    scene = Scene(
        particles=Cloud(number=80, radius=4e-4, density=3000.0, deviation=(60.0, 60.0, 60.0)),
        domain=Box(low=(-5e-3,) * 3, high=(5e-3,) * 3),
        stepper=Verlet(control=FixedStep(dt=1e-6)),
        duration=1e-3,
    )
    (tmp_path / "flow.toml").write_text(scene.to_toml())
    return "flow.toml"


@pytest.fixture
def impacts(tmp_path, toml):
    """The same with an effect, for what goes wrong before anything is compiled."""
    scene = Scene.from_toml(toml).model_copy(update={"effects": (Impact(hardness=2e5),)})
    (tmp_path / toml).write_text(scene.to_toml())
    return toml


def press_ctrl_c(monkeypatch, after, times=1):
    """Press Ctrl-C when progress is looked at for the ``after``-th time."""
    looked = []

    def check(self, original=Interrupt.check):
        looked.append(1)
        if len(looked) == after:
            for _ in range(times):
                os.kill(os.getpid(), signal.SIGINT)
        original(self)

    monkeypatch.setattr(Interrupt, "check", check)


def test_run_leaves_its_files_and_overwrites_nothing(tisim, toml, tmp_path):
    code, out, _ = tisim("run", toml, "--set", "particles.density=2e3", "--seed", 7)
    assert code == 0
    assert "ok" in out
    assert "80000 particle steps" in out
    folder = tmp_path / "out" / "flow"
    assert {path.name for path in folder.iterdir()} == {
        "result.h5",
        "scene.toml",
        "versions.json",
        "cloud.png",
    }
    written = Scene.from_toml(folder / "scene.toml")
    assert (written.seed, written.particles.density) == (7, 2e3)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    code, _, err = tisim("run", toml)
    assert (code, err.strip()) == (
        2, "output folder must be without a finished run (or give --overwrite); received 'out/flow'"
    )  # fmt: skip
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_ctrl_c_and_resume_end_as_if_never_stopped(tisim, toml, tmp_path, monkeypatch):
    (tmp_path / "whole").mkdir()
    (tmp_path / "whole" / "result.h5").write_text("of an earlier run")
    assert tisim("run", toml, "--out", "whole", "--overwrite")[0] == 0
    with monkeypatch.context() as patch:
        press_ctrl_c(patch, after=2)
        code, _, err = tisim("run", toml, "--out", "cut")
    assert code == 130
    assert "same command with --resume" in " ".join(err.split())
    assert [path.name for path in (tmp_path / "cut").iterdir()] == ["checkpoint.h5"]
    code, _, err = tisim("run", toml, "--out", "cut")
    assert code == 2
    assert "--resume" in err
    assert tisim("run", toml, "--out", "cut", "--resume")[0] == 0
    assert not (tmp_path / "cut" / "checkpoint.h5").exists()
    with h5py.File(tmp_path / "whole/result.h5") as whole, h5py.File(tmp_path / "cut/result.h5") as cut:
        assert dict(whole["work"].attrs) == dict(cut["work"].attrs)
        for name, values in whole["end"].items():
            np.testing.assert_array_equal(cut["end"][name], values)


def test_second_ctrl_c_stops_at_once(tisim, toml, tmp_path, monkeypatch):
    press_ctrl_c(monkeypatch, after=1, times=2)
    assert tisim("run", toml)[0] == 130
    assert list((tmp_path / "out" / "flow").iterdir()) == []


BEYOND_RANGE = [
    *("--set", "particles.deviation=[1e308, 1e308, 1e308]"),
    *("--set", "duration=1e9", "--set", "stepper.control.dt=1e9"),
]


def test_failed_run_says_where_and_keeps_the_last_good_state(tisim, toml, tmp_path):
    code, out, err = tisim("run", toml, *BEYOND_RANGE)
    assert code == 1
    assert "failed" in out
    assert "at t = " in err
    with h5py.File(tmp_path / "out/flow/result.h5") as file:
        assert not file.attrs["ok"]
        assert np.isfinite(file["end/velocity"]).all()


WRONG = [
    (["run", "nosuch"], "case must be one of agglomeration, or a scene file ending in .toml"),
    (["run", "none.toml"], "scene file must exist; received 'none.toml'"),
    (["run", "FLOW", "--size", "small"], "--size must be given for a case only; received 'small'"),
    (["run", "FLOW", "--set", "hardness"], "--set must be key=value; received 'hardness'"),
    (["run", "FLOW", "--set", "effects.warp.speed=9"], "effects.warp.speed must be a setting of this scene"),
    (["run", "FLOW", "--set", "effects.impact.hardnes=1"], "impact.hardnes must be a known key; received 1"),
    (["run", "FLOW", "--set", "effects.impact.hardness=nan"], "impact.hardness must be a finite number"),
    (["run", "FLOW", "--set", "particles.density=-1"], "cloud.density must be greater than 0"),
    (["run", "FLOW", "--set", "duration=0"], "scene.duration must be greater than 0"),
    (["run", "FLOW", "--without", "warp"], "effect to leave out must be one of impact; received 'warp'"),
    (["run", "agglomeration", "--without", "heating"], "must be used together with effects.heating"),
    (["explain", "agglomeration", "--without", "impact"], "must be used together with effects.impact"),
    (["run", "FLOW", "--without", "impact", "--set", "effects.impact.hardness=1"], "a setting of this scene"),
    (["run", "FLOW", "--device", "abacus"], "device must be one of cpu, cuda; received 'abacus'"),
    (["run", "FLOW", "--precision", "f16"], "precision must be one of f64, f32; received 'f16'"),
    (["run", "FLOW", "--resume"], "output folder must be one that an interrupted run has left"),
    (["run", "agglomeration", "--size", "huge"], "size must be one of small, default, paper; received"),
    (["explain", "nosuch"], "case must be one of"),
    (["check", "nosuch"], "case must be one of agglomeration; received 'nosuch'"),
    (["optimize", "agglomeration", "--population", "1"], "search.population must be at least 2; received 1"),
    (["optimize", "agglomeration", "--variant", "x"], "variant must be one of paper, fragmenting; received"),
    (["optimize", "agglomeration", "--set", "block=2"], "--set must be of the form search.KEY=VALUE"),
    (["optimize", "agglomeration", "--set", "search.blok=2"], "search.blok must be a known key; received 2"),
    (["cache", "none.h5"], "cache file must be an existing file; received 'none.h5'"),
    (["cache", "flow.toml"], "must be a whole HDF5 file written by a cache"),
    (["frobnicate"], "No such command 'frobnicate'"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(w[0][:2]) for w in WRONG])
def test_wrong_input_is_told_and_nothing_written(tisim, impacts, tmp_path, arguments, message):
    code, out, err = tisim(*(impacts if a == "FLOW" else a for a in arguments))
    assert code == 2
    assert message in err
    assert "Traceback" not in err
    assert out == ""
    assert [path.name for path in tmp_path.iterdir()] == [impacts]


def test_unwritable_folder(tisim, toml):
    code, _, err = tisim("run", toml, "--out", "flow.toml/x")
    assert code == 2
    assert "output folder must be writable; received 'flow.toml/x'" in err


def test_scene_files_that_are_none(tisim, impacts, tmp_path):
    content = (tmp_path / impacts).read_text()
    for text, message in {
        content[: len(content) // 2] + "[": "scene file must be TOML",
        content.replace("duration", "durration"): "must be",
        content.replace("[effects.impact]", "[effects.warp]"): "effects.warp.kind must be one of",
        "": "scene.particles must be given; received 'nothing'",
    }.items():
        (tmp_path / impacts).write_text(text)
        code, _, err = tisim("run", impacts)
        assert code == 2
        assert message in err
    (tmp_path / "folder.toml").mkdir()
    assert tisim("run", "folder.toml")[0] == 2


def test_cases_explain_and_version(tisim):
    code, out, _ = tisim("cases")
    assert code == 0
    assert "agglomeration" in out
    assert "--size paper" in out
    code, out, _ = tisim("explain", "agglomeration", "--size", "small")
    assert code == 0
    assert "60 particles" in out
    assert "hardness = 265480 Pa" in out
    assert tisim("--version")[1].startswith("tisim 0.")


def test_without_leaves_an_effect_out_of_the_scene_and_of_what_is_compiled(tisim, impacts, tmp_path):
    assert tisim("run", impacts, "--without", "impact")[0] == 0
    assert Scene.from_toml(tmp_path / "out" / "flow" / "scene.toml").effects == ()
    with h5py.File(tmp_path / "out/flow/result.h5") as file:
        assert "impacts" not in file["work"].attrs
    code, out, _ = tisim(
        "explain", "agglomeration", "--size", "small", "--without", "fragmentation", "--without", "cooling"
    )
    assert code == 0
    present, left_out = out.split("It leaves out")
    assert not any(word in present for word in ("fragmentation", "cooling", "pieces", "fracture_energy"))
    assert "pieces (of fragmentation)" in left_out
    assert "cooling_loss (of cooling)" in left_out


def test_check_tells_right_from_wrong(tisim, monkeypatch):
    checks = [
        Check("one", 1.0, 1.0, 0.0),
        Check("two", 2.1, 2.0, 0.01),
        Check("three", float("nan"), 0.0, 1.0),
    ]
    made = Case("toy", "A toy", "", {}, lambda size, seed: None, lambda: iter(checks))
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": made})
    code, out, err = tisim("check", "toy")
    assert code == 1
    assert [line.split()[-1] for line in out.splitlines()[1:]] == ["pass", "FAIL", "FAIL"]
    assert err.strip().endswith("2 of 3 checks failed")
    checks[1:] = []
    assert tisim("check", "toy")[0] == 0


def test_doctor(tisim, monkeypatch):
    monkeypatch.setattr("tisim.doctor.rate_of", lambda backend: {"taichi": 1e8}.get(backend))
    code, out, _ = tisim("doctor")
    assert code == 0
    for word in ("backend", "LLVM", "processor", "cores", "memory", "cuda", "numpy"):
        assert word in out


def spread(result):
    """Mean distance from the middle, m."""
    return float(np.linalg.norm(result.state["position"], axis=1).mean())


def toy_problem(size, variant):
    def scene(design, seed):
        low, high = (-design["half_side"],) * 3, (design["half_side"],) * 3
        return Scene(
            particles=Cloud(number=5, radius=1e-4, density=1.0),
            domain=Box(low=low, high=high),
            stepper=Verlet(control=FixedStep(dt=1.0)),
            duration=2.0,
            seed=seed,
        )

    genome = Genome((Gene("half_side", "m", 0.01, 0.1),))
    return Problem(
        "toy",
        genome,
        scene,
        spread,
        symbol="R",
        derived={"2 R": lambda r: 2 * r},
        picture=lambda scene, result: cloud(result),
    )


TOY = Case(
    name="toy",
    title="A toy",
    source="none",
    sizes={"default": Size("5 grains", {}, {"generations": 2, "population": 6, "parents": 2})},
    scene=lambda size, seed: None,
    check=lambda: iter(()),
    problem=toy_problem,
    variants=("only",),
)
SEARCH = ["optimize", "toy", "--out", "s", "--generations", "1", "--set", "search.ensemble.max_starts=4"]


def test_optimize_ends_with_all_its_files_and_resumes(tisim, tmp_path, monkeypatch):
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": TOY})
    with monkeypatch.context() as patch:
        press_ctrl_c(patch, after=9)
        code, _, err = tisim(*SEARCH)
    assert code == 130
    assert "give the same command again" in " ".join(err.split())
    code, out, err = tisim(*SEARCH)
    assert code == 0
    assert "2 R" in out
    names = {
        "search.h5",
        "best.csv",
        "convergence.png",
        "convergence.pdf",
        "best_scene.toml",
        "best_cloud.png",
    }
    assert names <= {path.name for path in (tmp_path / "s").iterdir()}
    assert "generation   1  best R" in err
    ran = len(Cache(tmp_path / "s/search.h5"))
    assert tisim(*SEARCH)[0] == 0
    assert len(Cache(tmp_path / "s/search.h5")) == ran
    code, _, err = tisim(*SEARCH, "--fresh")
    assert code == 2
    assert "--overwrite" in err
    code, out, _ = tisim("cache", "s/search.h5")
    assert code == 0
    assert out.split("\n")[1].split()[:2] == ["toy", str(ran)]
    assert tisim("cache", "s/search.h5", "--verify")[0] == 0
    assert tisim("cache", "s/search.h5", "--compact")[1].startswith(f"{ran} evaluations kept")
    about = Cache(tmp_path / "s/search.h5").tables()
    assert any(name.endswith("hall_of_fame") for name in about)
