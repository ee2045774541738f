"""Requests to stop a command: Ctrl-C, SIGTERM, SIGHUP; and a closed terminal."""

import contextlib
import fcntl
import os
import signal
import subprocess
import sys
import termios

import pytest

from tests.optimize.drift_case import CASE
from tisim import Scene, interrupt
from tisim.backend import runtime
from tisim.interrupt import Interrupt

ASKED = [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]


@pytest.fixture(autouse=True)
def listener():
    """Handle signals, even if the tests run in the background or under nohup."""
    before = {number: signal.signal(number, signal.default_int_handler) for number, _ in ASKED}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize(("number", "code"), ASKED)
def test_signal_is_reported_at_once_and_raised_at_a_good_moment(number, code):
    calls = []
    with Interrupt(lambda: calls.append(1)) as interrupt_:
        interrupt_.check()
        os.kill(os.getpid(), number)
        assert calls == [1]
        with pytest.raises(KeyboardInterrupt):
            interrupt_.check()
    assert (interrupt_.forced, interrupt.exit_code()) == (False, code)
    assert signal.getsignal(number) is signal.default_int_handler


def test_only_ctrl_c_forces():
    """At the end of a session SIGTERM and SIGHUP may both come, each to a process and to its group."""
    with Interrupt(lambda: None) as handler:
        for number in (signal.SIGHUP, signal.SIGTERM, signal.SIGHUP):
            os.kill(os.getpid(), number)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert handler.forced
    assert interrupt.exit_code() == 130


@pytest.mark.parametrize(("number", "code"), ASKED)
def test_an_ignored_signal_stays_ignored(number, code):
    """As SIGHUP under nohup."""
    signal.signal(number, signal.SIG_IGN)
    with interrupt.handle_signals(interrupt.raise_interrupt), Interrupt(lambda: None) as handler:
        os.kill(os.getpid(), number)
        handler.check()
    assert not handler.pending
    assert signal.getsignal(number) is signal.SIG_IGN


@pytest.mark.long
@pytest.mark.parametrize(("number", "code"), ASKED[1:])
def test_run_saves_a_checkpoint(tisim, toml, tmp_path, monkeypatch, press_ctrl_c, number, code):
    press_ctrl_c(monkeypatch, after=2, times=3, number=number)
    ended, _, err = tisim("run", toml, "--out", "cut")
    assert ended == code
    assert "To go on, give the same command again." in " ".join(err.split())
    names = {path.name for path in (tmp_path / "cut").iterdir()}
    assert names == {".tisim", ".tisim.lock", "checkpoint.h5"}


@pytest.mark.long
def test_comparison_says_how_to_continue(tisim, tmp_path, monkeypatch, press_ctrl_c):
    monkeypatch.setattr("tisim.cases.case.every", lambda: {CASE.name: CASE})
    press_ctrl_c(monkeypatch, after=9, number=signal.SIGTERM)
    code, _, err = tisim("compare", "drift", "--methods", "random", "--out", "c")
    assert code == 143
    assert "compare.h5 has all finished runs. To go on, give the same command" in " ".join(err.split())
    assert (tmp_path / "c" / "compare.h5").exists()


@pytest.mark.parametrize(("number", "code"), ASKED)
def test_commands_without_files_end_properly_too(tisim, monkeypatch, number, code):
    monkeypatch.setattr(runtime, "init", lambda *settings: os.kill(os.getpid(), number))
    assert tisim("check", "vibration") == (code, "", "")


@pytest.mark.slow
def test_run_whose_terminal_is_closed_saves_a_checkpoint(toml, tmp_path):
    """From then on every print fails."""
    scene = Scene.from_toml(tmp_path / toml).model_copy(update={"duration": 1e3})
    (tmp_path / toml).write_text(scene.to_toml())
    ours, theirs = os.openpty()
    command = "from tisim.cli.main import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", command, "run", toml, "--out", "cut"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )  # fmt: skip
    os.close(theirs)
    output = b""
    while b"left" not in output:
        with contextlib.suppress(OSError):
            output += os.read(ours, 1000)
        assert process.poll() is None, output
    os.close(ours)
    assert process.wait() == 129
    assert (tmp_path / "cut" / "checkpoint.h5").exists()
