"""Compiled kernels on the disk: left locked by a process that was killed, and used by many at once."""

import os
import subprocess
import sys
import time

import pytest

from tisim.backend import kernel_cache
from tisim.backend.taichi import BACKEND

SCRIPT = """
from tests.scenes import head_on
import tisim
print("ready", flush=True)
print(tisim.run(head_on(1.0, ())).status.ok, flush=True)
"""
QUEUES = """
from tisim.files import atomic

def wait(handle, path, *how, wait=atomic._wait_for_lock):
    print("queues", path.name, flush=True)
    wait(handle, path, *how)

atomic._wait_for_lock = wait
"""
"""Before it: says when it comes to wait for a lock of ours."""


def begin(script=SCRIPT):
    """A process that runs a scene."""
    command, pipe = [sys.executable, "-c", script], subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)


def warned(process):
    """What it says on standard error, once it has ended well."""
    out, warnings = process.communicate(timeout=300)
    assert "True" in out.split()
    assert process.returncode == 0
    return warnings


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache of its own, as of another machine."""
    monkeypatch.setenv(kernel_cache.LOCKS[BACKEND][0], str(tmp_path))
    kernel_cache.lock().parent.mkdir(exist_ok=True)
    return tmp_path


def leave_lock(age):
    """A lock of this age, s."""
    kernel_cache.lock().touch()
    then = time.time() - age
    os.utime(kernel_cache.lock(), (then, then))


def test_a_lock_that_was_left_behind_is_removed_and_one_that_is_held_is_not(folder):
    kernel_cache.unlock()
    leave_lock(age=kernel_cache.STALE / 2)
    kernel_cache.unlock()
    assert kernel_cache.lock().exists()
    leave_lock(age=2 * kernel_cache.STALE)
    kernel_cache.unlock()
    assert not kernel_cache.lock().exists()


@pytest.mark.long
def test_kernels_are_kept_after_a_kill_and_nothing_warns(folder):
    """The lock is where the compiler looks for it: it warns of one that is held, not of one left behind."""

    leave_lock(age=0.0)
    assert kernel_cache.lock().name in warned(begin())
    leave_lock(age=2 * kernel_cache.STALE)
    assert warned(begin()) == ""
    kernels = [path for path in folder.rglob("*") if path.suffix in (".tic", ".qdc")]
    assert len(kernels) > 5
    # Now there is something to read: who starts while another process writes waits, however long that takes.
    with kernel_cache.exclusive_access():
        leave_lock(age=0.0)
        waits = begin(QUEUES + SCRIPT)
        assert waits.stdout.readline() == "ready\n"
        assert waits.stdout.readline() == f"queues {kernel_cache.QUEUE}\n"
        kernel_cache.lock().unlink()
    assert warned(waits) == ""


@pytest.mark.slow
def test_many_processes_at_once_do_not_warn(folder):
    """They begin and end together, with nothing on the disk, and with everything."""
    for _ in range(2):
        assert {warned(process) for process in [begin() for _ in range(8)]} == {""}
