"""The command line in a fresh folder, with a scene file."""

import os
import signal

import pytest

from tisim import Box, Cloud, Scene
from tisim.cli.main import main
from tisim.effects import Impact
from tisim.interrupt import Interrupt
from tisim.steppers import FixedStep, Verlet


@pytest.fixture
def tisim(tmp_path, monkeypatch, capsys):
    """Run a command in a fresh folder; returns (exit code, standard output, standard error)."""
    monkeypatch.chdir(tmp_path)

    def command(*arguments):
        with pytest.raises(SystemExit) as exit_:
            main([str(argument) for argument in arguments])
        return exit_.value.code, *capsys.readouterr()

    return command


@pytest.fixture
def toml(tmp_path):
    """A scene file that compiles and runs quickly, with several progress checks."""
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
    """The same with an effect, for errors that occur before anything is compiled."""
    scene = Scene.from_toml(toml).model_copy(update={"effects": (Impact(hardness=2e5),)})
    (tmp_path / toml).write_text(scene.to_toml())
    return toml


@pytest.fixture
def press_ctrl_c():
    """Press Ctrl-C, or send another signal, at the ``after``-th progress check."""

    def press(monkeypatch, after, times=1, number=signal.SIGINT):
        looked = []

        def check(self, original=Interrupt.check):
            looked.append(1)
            if len(looked) == after:
                for _ in range(times):
                    os.kill(os.getpid(), number)
            original(self)

        monkeypatch.setattr(Interrupt, "check", check)

    return press
