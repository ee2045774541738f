"""Compiled kernels that a killed process has left locked."""

import os
import subprocess
import sys
import time

import pytest

from tisim import kernel_cache
from tisim._taichi import BACKEND

SCRIPT = """
from tests.scenes import head_on
import tisim
print(tisim.run(head_on(1.0, ())).status.ok)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache of its own, as of another machine."""
    monkeypatch.setenv(kernel_cache.LOCKS[BACKEND][0], str(tmp_path))
    kernel_cache.lock().parent.mkdir(exist_ok=True)
    return tmp_path


def left(age):
    """A lock of this age, s."""
    kernel_cache.lock().touch()
    then = time.time() - age
    os.utime(kernel_cache.lock(), (then, then))


def test_a_lock_that_was_left_behind_is_removed_and_one_that_is_held_is_not(folder):
    kernel_cache.unlock()
    left(age=kernel_cache.STALE / 2)
    kernel_cache.unlock()
    assert kernel_cache.lock().exists()
    left(age=2 * kernel_cache.STALE)
    kernel_cache.unlock()
    assert not kernel_cache.lock().exists()


@pytest.mark.long
def test_kernels_are_kept_after_a_kill_and_nothing_warns(folder):
    """The lock is where the compiler looks for it: it warns of one that is held, not of one left behind."""

    def run():
        done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == "True"
        return done.stderr

    left(age=0.0)
    assert kernel_cache.lock().name in run()
    left(age=2 * kernel_cache.STALE)
    assert run() == ""
    kept = [path for path in folder.rglob("*") if path.suffix in (".tic", ".qdc")]
    assert len(kept) > 5
