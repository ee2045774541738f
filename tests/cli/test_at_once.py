"""Two commands with the same folder at once: the second is refused, for every command."""

import os
import subprocess
import sys

import pytest

from tests.accuracy.scenes import only, oscillator
from tisim.cases import case as catalogue
from tisim.cases.case import Case, Size
from tisim.files import output_folder

STOPPED = """
import os, signal
from tisim.cli.main import main
from tisim.engine import checkpoint

def save(*arguments, save=checkpoint.save):
    save(*arguments)
    os.kill(os.getpid(), signal.SIGSTOP)

checkpoint.save = save
main()
"""
"""A run that stops itself after it has saved a checkpoint, and keeps its locks."""
REFUSED = (
    "output folder must be without a command that is still at work there; "
    "received {!r}, where another process is running\n"
)


@pytest.fixture
def under_way(toml, tmp_path):
    """A run into the folder ``out`` in another process, which has stopped after a checkpoint."""
    process = subprocess.Popen(
        [sys.executable, "-c", STOPPED, "run", toml, "--out", "out", "--frames", "3"],
        cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        env={
            **os.environ, "TISIM_CHECKPOINT_SECONDS": "0",
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        },
    )  # fmt: skip
    _, status = os.waitpid(process.pid, os.WUNTRACED)
    assert os.WIFSTOPPED(status)
    yield process
    process.kill()
    process.wait()


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.long
def test_a_run_locks_its_folder_until_it_ends(tisim, toml, tmp_path, under_way):
    before = content(tmp_path / "out")
    assert set(before) == {".tisim", ".tisim.lock", "checkpoint.h5", "trajectory.h5"}
    for more in ((), ("--overwrite",), ("--fresh",), ("--resume", "--frames", "3")):
        assert tisim("run", toml, "--out", "out", *more) == (2, "", REFUSED.format("out"))
    assert content(tmp_path / "out") == before
    code, out, _ = tisim("export", "out", "--format", "xyz", "--out", "x")
    assert (code, out) == (0, "x/trajectory.xyz\n"), "whoever only reads is not kept out"
    under_way.kill()
    under_way.wait()
    assert tisim("run", toml, "--out", "out", "--frames", "3")[0] == 0
    assert "result.h5" in content(tmp_path / "out")


@pytest.fixture
def at_work(tmp_path):
    """A folder in which another process is running."""
    (tmp_path / "out").mkdir()
    with output_folder.lock(tmp_path / "out"):
        yield "out"


def test_costs_are_measured_by_one_process_at_a_time(tisim, at_work, tmp_path, monkeypatch):
    only(monkeypatch)
    (tmp_path / "swing.toml").write_text(oscillator().to_toml())
    assert tisim("cost", "swing.toml", "--out", at_work, "--overwrite") == (2, "", REFUSED.format("out"))


def test_figures_are_made_by_one_process_at_a_time(tisim, at_work, monkeypatch):
    sizes = {"default": Size("", {})}
    parts = ("toy", "A toy", "none", sizes, lambda size, seed: None, lambda: iter(()))
    toy = Case(*parts, figures=lambda size, progress: pytest.fail("nothing is to be run"))
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": toy})
    assert tisim("figures", "toy", "--out", at_work, "--overwrite") == (2, "", REFUSED.format("out"))
