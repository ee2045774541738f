"""A run killed at any moment resumes from its last checkpoint and ends with the same bits."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.soak import runs

COMMAND = [
    "run", "agglomeration", "--size", "paper",
    "--set", "effects.impact.hardness=1e7", "--set", "duration=3e-3", "--seed", "4", "--out",
]  # fmt: skip
MAIN = "from tisim.cli.main import main; main()"
KILLED = (
    """
import os, signal
from tisim.engine import checkpoint
save, left = checkpoint.save, {saves}

def counted(*arguments):
    global left
    save(*arguments)
    left -= 1
    if left == 0:
        os.kill(os.getpid(), signal.SIGKILL)

checkpoint.save = counted
"""
    + MAIN
)
"""Code of a run that is killed after some checkpoints; the first come after few steps on any machine."""
ROOT = Path(__file__).parents[2]


def begin(folder, *more, code=MAIN):
    """Start a run that saves checkpoints as often as possible."""
    environment = {**os.environ, "TISIM_CHECKPOINT_SECONDS": "0", "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-c", code, *COMMAND, str(folder), *more],
        env=environment,
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def end_of(folder):
    with h5py.File(folder / "result.h5") as file:
        return {name: np.asarray(values) for name, values in file["end"].items()}, dict(file["work"].attrs)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "run"
    assert begin(folder).wait() == 0
    return end_of(folder)


@pytest.mark.slow
@pytest.mark.parametrize("saves", [1, 6])
def test_sigkill_and_resume_end_as_if_never_stopped(whole, tmp_path, saves):
    folder = tmp_path / "cut"
    assert begin(folder, code=KILLED.format(saves=saves)).wait() == -signal.SIGKILL
    assert (folder / "checkpoint.h5").exists()
    assert not (folder / "result.h5").exists()
    assert begin(folder, "--resume").wait() == 0
    state, work = end_of(folder)
    assert work == whole[1]
    for name, values in whole[0].items():
        np.testing.assert_array_equal(state[name], values)


@pytest.mark.slow
def test_kills_and_full_disks_at_random_lose_nothing(tmp_path):
    """A part of the trials of tests/soak.sh."""
    for counts in runs.soak(seed=8, share=0.1, folder=tmp_path):
        assert counts.clean, counts


def test_half_of_the_kills_wait_for_the_file(tmp_path, monkeypatch):
    """The file appears after a hundred polls; a kill that does not wait for it comes before any poll."""
    looks = []

    class Running:
        @staticmethod
        def poll():
            looks.append(None)
            if len(looks) == 100:
                file.touch()

    file = tmp_path / "trajectory.h5"
    monkeypatch.setattr(runs.time, "sleep", lambda seconds: None)
    waited = 0
    for seed in range(100):
        looks.clear()
        file.unlink(missing_ok=True)
        runs._wait(Running, file, np.random.default_rng(seed), 1.0)
        assert len(looks) in (0, 100)
        waited += len(looks) == 100
    assert 30 < waited < 70
