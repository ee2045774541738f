"""tisim cost: its files and answers, its interruption and continuation, and its errors."""

import csv
import os
import re
import shlex
import signal
from dataclasses import replace

import pytest
from typer.main import get_command

from tests.accuracy.scenes import only, oscillator
from tests.own_files import LAW
from tisim import InputError
from tisim.accuracy import Row, quantity, runner, storage
from tisim.accuracy.scene_changes import options, shell_line
from tisim.accuracy.sweep import methods
from tisim.cases.case import every
from tisim.cli import cost, scene_arguments
from tisim.cli.main import app

CASES = ", ".join(sorted(every()))
WRONG = [
    (["nosuch"], f"case must be one of {CASES}, or a scene file ending in"),
    (["vibration", "--size", "huge"], "size must be one of alone, default, equilibrium"),
    (["vibration", "--set", "effects.warp.speed=9"], "effects.warp.speed must be a setting of this scene"),
    (["vibration", "--without", "warp"], "effect to leave out must be one of"),
    (["vibration", "--error", "0"], "--error must be greater than 0; received 0.0"),
    (["vibration", "--quantity", "speed"], "quantity must be one of positions, centre of gravity; received"),
    (["vibration", "--repeats", "0"], "repeats must be a whole number, at least 1; received 0"),
    (["vibration", "--coarser", "-2"], "coarser + finer must be at least 0; received -2"),
    (["vibration", "--limit", "0"], "limit must be greater than 0; received 0.0"),
    (["vibration", "--budget", "-1"], "budget must be greater than 0; received -60.0"),
    (["agglomeration", "--starts", "4,x"], "--starts must be whole numbers with commas between; received"),
    (["agglomeration", "--starts", "1"], "starts must be at least 2; received [1]"),
    (["agglomeration", "--device", "abacus"], "device must be one of cpu, cuda, vulkan; received 'abacus'"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(w[0][:2]) for w in WRONG])
def test_wrong_input_is_reported_and_nothing_written(tisim, tmp_path, arguments, message):
    code, out, err = tisim("cost", *arguments)
    assert code == 2
    assert message in " ".join(err.split())
    assert "Traceback" not in err
    assert out == ""
    assert list(tmp_path.iterdir()) == []


def test_cases_have_default_sizes_for_cost_studies(tisim, tmp_path, monkeypatch):
    """granular_bench is measured in a bed, unless another size is given; other cases at their
    default size."""
    asked = []

    def note(target, size, *others):
        asked.append((target, size))
        raise InputError("scene must be left alone; received one")

    (tmp_path / "swing.toml").touch()
    with monkeypatch.context() as patch:
        patch.setattr(scene_arguments, "load_scene", note)
        for words in (
            ["granular_bench"],
            ["granular_bench", "--size", "default"],
            ["vibration"],
            ["swing.toml"],
        ):
            assert tisim("cost", *words)[0] == 2
    assert asked == [
        ("granular_bench", "bed"),
        ("granular_bench", "default"),
        ("vibration", None),
        ("swing.toml", None),
    ]
    code, out, _ = tisim("cases")
    assert code == 0
    assert " ".join(out.split()).count("fallen into a cup; default of tisim cost") == 1


@pytest.fixture
def swing(tmp_path, monkeypatch):
    """The oscillator as a file; only its own stepper is tried, which takes one compilation."""
    only(monkeypatch)
    (tmp_path / "swing.toml").write_text(oscillator().to_toml())
    return "swing.toml"


def rows(folder):
    with (folder / storage.COST_CSV).open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.long
def test_cost_answers_and_stores_its_measurements(tisim, swing, tmp_path, monkeypatch):
    command = ("cost", swing, "--no-f32", "--no-fast", "--quick", "--error")
    with monkeypatch.context() as patch:
        patch.setattr(quantity, "LARGEST_REFERENCE_ERROR", 1e-12)
        code, out, err = tisim(*command, "1e-3")
        assert (code, out) == (1, "")
        assert "displacement must be known by the reference to 1e-12 of the motion; received" in err
        assert "dt=" not in err
        code, out, err = tisim(*command, "1e-3", "--anyway")
    assert code == 0
    # The source of the error, and problems with it, are printed first, not only at the end.
    truth, advice, *measured = [
        line for line in err.splitlines() if not line.startswith(("running", "going"))
    ]
    assert truth.startswith("error of displacement: against Verlet, FixedStep at ")
    assert advice.startswith("displacement: the reference itself is off by ")
    settings = [
        re.fullmatch(r"Verlet, FixedStep: dt, (dt=\S+): error \S+; \S+ s(; .* left)?", line)[1]
        for line in measured
    ]
    assert settings == ["dt=0.0316", "dt=0.01", "dt=0.00316"]
    folder = tmp_path / "out" / "swing-cost"
    assert {path.name for path in folder.iterdir()} == {".tisim", *storage.COST_FILES}
    # dt = 0.0316 and 0.01 come before: their errors are 7e-3 and 7e-4.
    assert [row["setting"] for row in rows(folder)] == ["dt=0.0316", "dt=0.01", "dt=0.00316"]
    (answer,) = [line for line in out.splitlines() if line.startswith("  tisim run")]
    assert answer.split("--set")[0].strip() == "tisim run swing.toml"
    chosen = answer.split("dt=")[1]
    errors = {row["setting"]: float(row["error of displacement"]) for row in rows(folder)}
    assert errors[f"dt={chosen}"] < 1e-3
    before = (folder / storage.HDF5).read_bytes()
    code, again, _ = tisim(*command, "1e-3")
    assert code == 0
    assert [line for line in again.splitlines() if line.startswith("  tisim run")] == [answer]
    code, _, err = tisim(*command, "1e-9")
    assert code == 1
    message = " ".join(err.split())
    assert "error of displacement must be at least" in message
    assert "finer settings go further); received 1e-09" in message
    assert "Traceback" not in message
    assert (folder / storage.HDF5).read_bytes() == before
    code, _, err = tisim(*command[:-1], "--set", "duration=1.0")
    assert code == 2
    assert "output folder must be without the study of another scene" in " ".join(err.split())


NUMBERS = (("f64", "strict"), ("f32", "strict"), ("f64", "fast"))
GIVEN = [
    (),
    ("--seed", "7", "--set", "duration=0.5", "--set", "stepper.control.dt=2e-3"),
    ("--set", "effects.tether.stiffness=[1.0, 2.0, 3.0]", "--set", 'name="two words"', "--threads", "1"),
    ("--set", 'stepper={kind="boris", control={kind="fixed_step", dt=0.02}}', "--seed", "0"),
    ("--without", "tether", "--set", "effects.near_field={alpha1=1.0, alpha2=2.0, beta2=3}"),
    ("--set", "effects.near_field={alpha1=1.0, alpha2=2.0}", "--set", "effects.near_field.beta2=3"),
    ("--set", "effects.own={kind='pull', strength=2.0}", "--plugin", "own_laws.py"),
]


@pytest.mark.parametrize("words", GIVEN, ids=lambda words: " ".join(words[1::2]) or "nothing")
def test_printed_commands_run_the_measured_scene(tmp_path, monkeypatch, own_file, words):
    """For all arguments of tisim cost, and for every kind of setting: stepper, tolerance, law, precision or
    arithmetic."""
    monkeypatch.chdir(tmp_path)
    own_file("own_laws.py", LAW)
    target = "my swing's.toml"
    (tmp_path / target).write_text(oscillator().model_copy(update={"seed": 3}).to_toml())
    measured, _, asked_options = parsed("cost", target, *words)
    tried_methods = methods(measured, 0.1, 1.0, (1.0, 0.0), NUMBERS, 1)
    settings = [setting for method in tried_methods for setting in method.settings]
    assert len(settings) > 8
    for setting in settings:
        changed = shell_line(options(measured, setting.scene, *setting.numbers))
        row = Row("", "", "", changed, setting.precision, 1, (1.0,), errors=((0.0, 0.0),))
        row = replace(row, arithmetic=setting.arithmetic)
        printed = cost.answer(row, 0, measured, **asked_options).splitlines()[-1]
        scene, numbers, again = parsed(*shlex.split(printed)[1:])
        assert (scene.digest(), numbers) == (setting.scene.digest(), setting.numbers)
        assert {name: again[name] for name in ("device", "threads", "plugins")} == {
            name: asked_options[name] for name in ("device", "threads", "plugins")
        }


def parsed(command, *words):
    """Parse a command; return its scene, its precision and arithmetic, and the parsed arguments that select
    the scene."""
    parameters = get_command(app).commands[command].make_context(command, list(words)).params
    _, scene = scene_arguments.load_scene(
        parameters["target"],
        parameters["size"],
        parameters["seed"],
        parameters["absent"] or (),
        parameters["changes"] or (),
    )
    names = ("target", "size", "seed", "changes", "device", "threads", "plugins")
    numbers = parameters.get("precision"), parameters.get("arithmetic")
    return scene, numbers, {name: parameters[name] for name in names}


@pytest.mark.long
def test_ctrl_c_keeps_measurements(tisim, swing, tmp_path, monkeypatch):
    command = ("cost", swing, "--no-f32", "--no-fast", "--repeats", "1", "--out", "cut")
    with monkeypatch.context() as patch:
        write, pressed = storage.write, []

        def press(study, folder):
            if len(study.rows) == 2 and not pressed:
                pressed.append(True)
                os.kill(os.getpid(), signal.SIGINT)
            return write(study, folder)

        patch.setattr(storage, "write", press)
        code, out, err = tisim(*command)
    assert code == 130
    assert "To go on, give the same command again" in " ".join(err.split())
    assert "dt=0.01 " in out
    cut = rows(tmp_path / "cut")
    assert [row["setting"] for row in cut] == ["dt=0.0316", "dt=0.01"]
    code, _, err = tisim(*command, "--fresh")
    assert (code, err) == (
        2, "output folder must be without measured costs (or give --overwrite); received 'cut'\n"
    )  # fmt: skip
    code, _, err = tisim(*command)
    assert code == 0
    assert "going on with cut/cost.h5, which has 2 settings" in " ".join(err.split())
    assert rows(tmp_path / "cut")[:2] == cut
    assert len(rows(tmp_path / "cut")) == 4
    with monkeypatch.context() as patch:
        patch.setattr(runner, "run", stopped)
        code, _, err = tisim(*command, "--set", "duration=1.0", "--overwrite")
    assert code == 130
    assert "give the same command again, without --overwrite." in " ".join(err.split())
    assert {path.name for path in (tmp_path / "cut").iterdir()} == {".tisim", ".tisim.lock"}


def stopped(*arguments):
    raise KeyboardInterrupt
