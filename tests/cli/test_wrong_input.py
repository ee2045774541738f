"""Wrong input: a message of one line, exit code 2, and nothing written."""

import inspect
import os
import re
import subprocess
import sys
from typing import get_args, get_type_hints

import pytest
from typer.main import get_command

from tisim.cases.case import every
from tisim.cli.main import app

CASES = ", ".join(sorted(every()))

WRONG = [
    (["run", "nosuch"], f"case must be one of {CASES}, or a scene file ending in"),
    (["run", "blats"], "NAME.py with a CASE; received 'blats'; did you mean 'blast'?\n"),
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
    (["run", "FLOW", "--device", "abacus"], "device must be one of cpu, cuda, vulkan; received 'abacus'"),
    (["run", "FLOW", "--precision", "f16"], "precision must be one of f64, f32; received 'f16'"),
    (["run", "FLOW", "--resume"], "output folder must be one that an interrupted run has left"),
    (["run", "agglomeration", "--size", "huge"], "size must be one of small, default, paper; received"),
    (["explain", "nosuch"], "case must be one of"),
    (["check", "nosuch"], f"case must be one of {CASES}, or your own NAME.py with a CASE; received 'nosuch'"),
    (["optimize", "agglomeration", "--population", "0"], "options.population must be at least 1; received 0"),
    (["run", "agglomeration", "--variant", "x"], "variant must be one of fields; received 'x'"),
    (["explain", "capture", "--variant", "hard"], "variant must be left out, as capture has one scene"),
    (["optimize", "agglomeration", "--variant", "x"], "one of paper, fragmenting, fields; received"),
    (["optimize", "agglomeration", "--set", "block=2"], "--set must be of the form search.KEY=VALUE"),
    (["optimize", "agglomeration", "--set", "search.blok=2"], "search.blok must be a known key: "),
    (["optimize", "capture", "--size", "25nm"], "size must be one of default for the inverse problem"),
    (["compare", "blast", "--size", "clumps"], "size must be one of small, default for the inverse problem"),
    (["optimize", "capture", "--size", "huge"], "size must be one of default, longitudinal, long, 25nm; rec"),
    (["optimize", "concentration"], "case must be one with an inverse problem; received 'concentration'"),
    (["cache", "none.h5"], "cache file must be an existing file; received 'none.h5'"),
    (["cache", "flow.toml"], "by a cache; received a file that is another program's, or damaged at its"),
    (["frobnicate"], "command must be one of run, cases, explain, "),
    (["optimise"], "export; received 'optimise'; did you mean 'optimize'?\n"),
    (["--verson"], "option must be one of 'tisim --help'; received '--verson'; did you mean '--version'?\n"),
    (["run"], "CASE_OR_FILE must be given (A case of 'tisim cases', a scene file, or your own"),
    (["cache"], "FILE must be given (The search.h5 of a search); received nothing\n"),
    (["run", "FLOW", "FLOW"], "arguments must be CASE_OR_FILE and no more; received also 'flow.toml'\n"),
    (["cases", "all", "of"], "arguments must be none; received also 'all', 'of'\n"),
    (["plot", "a\0b"], "FILE must be a path that this system can have; received 'a\\x00b'\n"),
    (["run", "FLOW", "--seed"], "--seed must be given with a value; received nothing\n"),
    (["run", "FLOW", "--fresh=3"], "--fresh must be given without a value; received '--fresh=3'\n"),
    (["run", "FLOW", "--seed", "1.5"], "--seed must be a whole number; received '1.5'\n"),
    (["run", "FLOW", "--every=often"], "--every must be a number; received 'often'\n"),
    (["movie", "o", "--rate", "x"], "--rate must be a whole number; received 'x'\n"),
    (["cost", "FLOW", "--finer", "17"], "--finer must be a whole number, at least -16, at most 16; rece"),
    (["run", "FLOW", "--frmes", "3"], "'tisim run --help'; received '--frmes'; did you mean '--frames'?\n"),
    (["run", "FLOW", "-x"], "option must be one of 'tisim run --help'; received '-x'\n"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(w[0][:2]) for w in WRONG])
def test_wrong_input_is_reported_and_nothing_written(tisim, impacts, tmp_path, arguments, message):
    code, out, err = tisim(*(impacts if a == "FLOW" else a for a in arguments))
    assert code == 2
    assert message in err
    assert "Traceback" not in err
    assert "--compact" not in err
    assert out == ""
    assert [path.name for path in tmp_path.iterdir()] == [impacts]


def test_unwritable_folder(tisim, toml):
    code, _, err = tisim("run", toml, "--out", "flow.toml/x")
    assert code == 2
    assert "output folder must be writable; received 'flow.toml/x'" in err


def test_invalid_scene_files_are_refused(tisim, impacts, tmp_path):
    content = (tmp_path / impacts).read_text()
    for text, message in {
        content[: len(content) // 2] + "[": "scene file must be TOML",
        content.replace("duration", "durration"): "must be",
        content.replace("[effects.impact]", "[effects.warp]"): "effects.warp.kind must be one of",
        "": "scene.particles must be given; received nothing",
    }.items():
        (tmp_path / impacts).write_text(text)
        code, _, err = tisim("run", impacts)
        assert code == 2
        assert message in err
    (tmp_path / "folder.toml").mkdir()
    assert tisim("run", "folder.toml")[0] == 2


@pytest.mark.parametrize("seconds", ["x", "nan", "-1", ""])
def test_invalid_checkpoint_seconds_are_refused(tisim, impacts, monkeypatch, seconds):
    monkeypatch.setenv("TISIM_CHECKPOINT_SECONDS", seconds)
    code, out, err = tisim("run", impacts)
    said = f"TISIM_CHECKPOINT_SECONDS must be a number of seconds, at least 0; received {seconds!r}\n"
    assert (code, out, err) == (2, "", said)


def number_options():
    """(command, option) for all numeric options."""
    for name, command in get_command(app).commands.items():
        types = get_type_hints(inspect.unwrap(command.callback))
        for option in command.params:
            if {int, float} & {types[option.name], *get_args(types[option.name])}:
                yield name, option.opts[0]


@pytest.mark.parametrize(("command", "option"), list(number_options()))
def test_a_word_for_a_number_is_refused(tisim, command, option):
    code, out, err = tisim(command, "FLOW", option, "many")
    assert (code, out) == (2, "")
    assert re.fullmatch(rf"{option} must be a (whole )?number.*; received 'many'\n", err)


@pytest.mark.parametrize(
    "words", [["-c", "from tisim.cli.main import main; main(['cases'])"], ["-m", "tisim", "cases"]]
)
def test_an_invalid_backend_is_refused(words):
    """The command reports it in a line, because importing the package succeeds."""
    environment = {**os.environ, "TISIM_BACKEND": "os"}
    command = [sys.executable, *words]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    said = "TISIM_BACKEND must be taichi or quadrants; received 'os'\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", said)
