"""Wrong input: a message of one line, exit code 2, and nothing written."""

import os
import subprocess
import sys

import pytest

from cases.case import every

CASES = ", ".join(sorted(every()))

WRONG = [
    (["run", "nosuch"], f"case must be one of {CASES}, or a scene file ending in"),
    (["run", "none.toml"], "scene file must exist; received 'none.toml'"),
    (["run", "FLOW", "--size", "small"], "--size must be given for a case only; received 'small'"),
    (["run", "FLOW", "--set", "hardness"], "--set must be key=value; received 'hardness'"),
    (["run", "FLOW", "--set", "effects.warp.speed=9"], "effects.warp.speed must be a setting of this scene"),
    (["run", "FLOW", "--set", "effects.impact.hardnes=1"], "impact.hardnes must be a known key: name, "),
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
    (["check", "nosuch"], f"case must be one of {CASES}, or your own NAME.py with a CASE; received 'nosuch'"),
    (["optimize", "agglomeration", "--population", "1"], "options.population must be at least 2; received 1"),
    (["optimize", "agglomeration", "--variant", "x"], "variant must be one of paper, fragmenting; received"),
    (["optimize", "agglomeration", "--set", "block=2"], "--set must be of the form search.KEY=VALUE"),
    (["optimize", "agglomeration", "--set", "search.blok=2"], "search.blok must be a known key: "),
    (["optimize", "capture", "--size", "25nm"], "size must be one of default for the inverse problem"),
    (["compare", "blast", "--size", "clumps"], "size must be one of small, default for the inverse problem"),
    (["optimize", "capture", "--size", "huge"], "size must be one of default, longitudinal, long, 25nm; rec"),
    (["optimize", "cascade"], "case must be one with an inverse problem; received 'cascade'"),
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


@pytest.mark.parametrize("seconds", ["x", "nan", "-1", ""])
def test_checkpoint_seconds_that_are_none(tisim, impacts, monkeypatch, seconds):
    monkeypatch.setenv("TISIM_CHECKPOINT_SECONDS", seconds)
    code, out, err = tisim("run", impacts)
    said = f"TISIM_CHECKPOINT_SECONDS must be a number of seconds, at least 0; received {seconds!r}\n"
    assert (code, out, err) == (2, "", said)


@pytest.mark.parametrize(
    "code", ["from tisim.cli.main import main; main(['cases'])", "import tisim.cli.main as c; c.main()"]
)
def test_a_backend_that_is_none(code):
    """Told in a line by the command, as importing the package has gone well."""
    environment = {**os.environ, "TISIM_BACKEND": "os"}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    said = "TISIM_BACKEND must be taichi or quadrants; received 'os'\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", said)
