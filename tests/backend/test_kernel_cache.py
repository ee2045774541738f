"""Compiled kernels on disk: after a process was killed with the lock held, and with many processes
at once."""

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
"""Put before SCRIPT: prints a line when the process begins to wait for tisim's lock."""


def begin(script=SCRIPT):
    """A process that runs a scene."""
    command, pipe = [sys.executable, "-c", script], subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)


def warned(process):
    """Standard error of a process that has ended without error."""
    out, warnings = process.communicate(timeout=300)
    assert "True" in out.split()
    assert process.returncode == 0
    return warnings


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A fresh kernel cache, as on another machine."""
    monkeypatch.setenv(kernel_cache.LOCKS[BACKEND][0], str(tmp_path))
    kernel_cache.lock().parent.mkdir(exist_ok=True)
    return tmp_path


def leave_lock(age):
    """Make a lock of this age, s."""
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
    """The lock file is the one the compiler uses: the compiler warns of a lock that is held, not of a stale
    one."""

    leave_lock(age=0.0)
    assert kernel_cache.lock().name in warned(begin())
    leave_lock(age=2 * kernel_cache.STALE)
    assert warned(begin()) == ""
    kernels = [path for path in folder.rglob("*") if path.suffix in (".tic", ".qdc")]
    assert len(kernels) > 5
    # The cache has kernels now. A process that starts while another one writes waits, for any length of time.
    with kernel_cache.exclusive_access():
        leave_lock(age=0.0)
        waits = begin(QUEUES + SCRIPT)
        assert waits.stdout.readline() == "ready\n"
        assert waits.stdout.readline() == f"queues {kernel_cache.QUEUE}\n"
        kernel_cache.lock().unlink()
    assert warned(waits) == ""


@pytest.mark.slow
def test_many_processes_at_once_do_not_warn(folder):
    """The processes begin and end together, first with an empty cache and then with a full one."""
    for _ in range(2):
        assert {warned(process) for process in [begin() for _ in range(8)]} == {""}
