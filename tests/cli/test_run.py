"""tisim run: its files, its interruption and continuation, and its failures."""

import re

import h5py
import numpy as np
import pytest

from tisim import InputError, Scene, read
from tisim.backend import runtime


def test_run_leaves_its_files_and_overwrites_nothing(tisim, toml, tmp_path):
    code, out, _ = tisim("run", toml, "--set", "particles.density=2e3", "--seed", 7)
    assert code == 0
    assert "ok" in out
    rows = [line.split() for line in out.splitlines()]
    assert ["particle", "steps", "80000"] in rows
    assert ["device", "cpu,", "f64,", "strict"] in rows
    assert ["threads", str(runtime.current().threads)] in rows
    folder = tmp_path / "out" / "flow"
    assert {path.name for path in folder.iterdir()} == {
        "result.h5",
        "scene.toml",
        "versions.json",
        "cloud.png",
        ".tisim",
        ".tisim.lock",
    }
    scene = Scene.from_toml(folder / "scene.toml")
    assert (scene.seed, scene.particles.density) == (7, 2e3)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    code, _, err = tisim("run", toml)
    assert (code, err.strip()) == (
        2, "output folder must be without a finished run (or give --overwrite); received 'out/flow'"
    )  # fmt: skip
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


OTHERS = "output folder must be without files that tisim has not written and would replace"


@pytest.mark.parametrize(
    ("command", "name", "message"),
    [
        ("run", "scene.toml", OTHERS),
        ("run", "result.h5.new", OTHERS),
        ("run", "result.h5", "output folder must be without a finished run (or give --overwrite)"),
        ("cost", "cost.csv", OTHERS),
    ],
)
def test_files_of_the_user_are_not_replaced(tisim, toml, tmp_path, command, name, message):
    users = tmp_path / "mine" / name
    users.parent.mkdir()
    users.write_text("the user's own")
    code, out, err = tisim(command, toml, "--out", "mine")
    assert (code, out) == (2, "")
    assert message in err
    assert [(path.name, path.read_text()) for path in users.parent.iterdir()] == [(name, "the user's own")]
    users.rename(tmp_path / "elsewhere")
    users.symlink_to(tmp_path / "elsewhere")
    code, out, err = tisim(command, toml, "--out", "mine", "--overwrite")
    assert (code, out) == (2, "")
    assert f"mine/{name} must be a regular file that can be opened; received a symbolic" in err
    assert (tmp_path / "elsewhere").read_text() == "the user's own"


@pytest.mark.long
def test_ctrl_c_and_resume_end_as_if_never_stopped(tisim, toml, tmp_path, monkeypatch, press_ctrl_c):
    (tmp_path / "whole").mkdir()
    (tmp_path / "whole" / "result.h5").write_text("of an earlier run")
    assert tisim("run", toml, "--out", "whole", "--overwrite")[0] == 0
    with monkeypatch.context() as patch:
        press_ctrl_c(patch, after=2)
        code, _, err = tisim("run", toml, "--out", "cut")
    assert code == 130
    assert "To go on, give the same command again." in " ".join(err.split())
    assert sorted(path.name for path in (tmp_path / "cut").iterdir()) == [
        ".tisim", ".tisim.lock", "checkpoint.h5",
    ]  # fmt: skip
    code, _, err = tisim("run", toml, "--out", "cut")
    assert code == 0
    assert "going on with cut/checkpoint.h5, from " in " ".join(err.split())
    assert not (tmp_path / "cut" / "checkpoint.h5").exists()
    with h5py.File(tmp_path / "whole/result.h5") as whole, h5py.File(tmp_path / "cut/result.h5") as cut:
        assert dict(whole["work"].attrs) == dict(cut["work"].attrs)
        for name, values in whole["end"].items():
            np.testing.assert_array_equal(cut["end"][name], values)


@pytest.mark.parametrize("stopped", [True, False], ids=["interrupted", "finished"])
def test_a_killed_run_leaves_nothing_of_an_earlier_run(
    tisim, toml, tmp_path, monkeypatch, press_ctrl_c, stopped
):
    """The second run, with --overwrite, is killed before its first checkpoint. Then the first run is not
    continued, and is not read as the content of the folder."""
    command, folder = ("run", toml, "--frames", 4), tmp_path / "out" / "flow"
    with monkeypatch.context() as patch:
        if stopped:
            press_ctrl_c(patch, after=2)
        assert tisim(*command)[0] == (130 if stopped else 0)
    press_ctrl_c(monkeypatch, after=1, times=2)
    assert tisim(*command, "--seed", 2, "--overwrite")[0] == 130
    assert {path.name for path in folder.iterdir()} == {".tisim", ".tisim.lock", "trajectory.h5"}
    assert read(folder / "trajectory.h5").scene.seed == 2
    with pytest.raises(InputError, match="one with a whole run or study"):
        read(folder)
    assert tisim(*command, "--resume")[0] == 2


def test_second_ctrl_c_stops_at_once(tisim, toml, tmp_path, monkeypatch, press_ctrl_c):
    press_ctrl_c(monkeypatch, after=1, times=2)
    assert tisim("run", toml)[0] == 130
    assert {path.name for path in (tmp_path / "out" / "flow").iterdir()} == {".tisim", ".tisim.lock"}


BEYOND_RANGE = [
    *("--set", "particles.deviation=[1e308, 1e308, 1e308]"),
    *("--set", "duration=1e9", "--set", "stepper.control.dt=1e9"),
]


def test_failed_run_says_where_and_keeps_the_last_good_state(tisim, toml, tmp_path):
    code, out, err = tisim("run", toml, *BEYOND_RANGE)
    assert code == 1
    assert "failed" in out
    # The run failed in its first steps, so the progress bar does not reach the end.
    assert "100%" not in err
    assert "at t = " in err
    with h5py.File(tmp_path / "out/flow/result.h5") as file:
        assert not file.attrs["ok"]
        assert np.isfinite(file["end/velocity"]).all()


@pytest.mark.slow
def test_without_removes_an_effect_from_scene_and_kernels(tisim, impacts, tmp_path):
    assert tisim("run", impacts, "--without", "impact")[0] == 0
    assert Scene.from_toml(tmp_path / "out" / "flow" / "scene.toml").effects == ()
    with h5py.File(tmp_path / "out/flow/result.h5") as file:
        assert "impacts" not in file["work"].attrs
    code, out, _ = tisim(
        "explain", "agglomeration", "--size", "small", "--without", "fragmentation", "--without", "cooling",
        "--all",
    )  # fmt: skip
    assert code == 0
    present, left_out = " ".join(out.split()).split("Effects left out")
    assert not any(word in present for word in ("fragmentation", "cooling", "pieces", "fracture_energy"))
    assert "pieces (of fragmentation)" in left_out
    assert "cooling_loss (of cooling)" in left_out


def test_a_run_that_ends_by_itself_shows_steps_and_measures(tisim, tmp_path, monkeypatch, press_ctrl_c):
    """The time of its end is unknown: the run has no percentage, and no frames at equal parts of it."""
    command = ("run", "packing", "--size", "small", "--out", "packed")
    code, _, err = tisim(*command, "--frames", "10")
    assert code == 2
    assert (
        "--frames must be replaced by --every, the time between frames, as this run ends by itself"
        in " ".join(err.split())
    )
    assert not (tmp_path / "packed").exists()
    press_ctrl_c(monkeypatch, after=2)
    code, _, err = tisim(*command)
    assert code == 130
    assert re.search(r"stopped at step \d+, packing_fraction 0\.\d+", " ".join(err.split()))
    assert "%" not in err
