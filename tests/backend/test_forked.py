"""A process forked after Taichi has started refuses to run anything at once, can still read results, and does
not disturb its parent."""

import multiprocessing
import os
import pickle
import time
import warnings

import pytest

import tisim
from tests.scenes import scene
from tisim import RunError
from tisim.backend import runtime
from tisim.files import atomic
from tisim.io.recording import Recording

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
REFUSAL = (
    "tisim has been started in the process that this one was forked from, and cannot run here; "
    "start processes by spawn: multiprocessing.get_context('spawn')"
)
FLIGHT = scene([[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], (), dt=0.5, steps=4)


def forked(function, *arguments):
    """Run a function in a forked process; return its result, or the error that it raises there."""
    reader, writer = os.pipe()
    with warnings.catch_warnings():
        # As of Python 3.12, a fork with threads running gives a warning; such a fork is intended here.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        try:
            answer = function(*arguments)
        except Exception as error:
            answer = error
        os.write(writer, pickle.dumps(answer))
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as answers:
        answer = pickle.loads(answers.read())
    os.waitpid(child, 0)
    return answer


@pytest.mark.parametrize(
    "use",
    [
        lambda: tisim.run(FLIGHT),
        lambda: tisim.Simulation(FLIGHT),
        lambda: runtime.init(threads=1),
        lambda: runtime.init(runtime._current.device, runtime._current.precision, runtime._current.threads),
        runtime.current,
        runtime.restart,
    ],
    ids=["run", "Simulation", "init anew", "init as it is", "current", "restart"],
)
def test_running_is_refused_at_once(use):
    tisim.run(FLIGHT)
    began = time.monotonic()
    error = forked(use)
    assert type(error) is RunError
    assert str(error) == REFUSAL
    assert time.monotonic() - began < 10.0


def test_nothing_is_written_before_the_refusal(tmp_path):
    recording = Recording(tmp_path / "t.h5", frames=1)
    assert str(forked(tisim.run, FLIGHT, None, recording)) == REFUSAL
    assert list(tmp_path.iterdir()) == []


def test_results_are_readable_and_the_parent_continues(tmp_path):
    before = tisim.run(FLIGHT, record=Recording(tmp_path / "t.h5", frames=2))
    assert list(forked(lambda: tisim.read(tmp_path / "t.h5").times)) == [0.0, 1.0, 2.0]
    assert forked(lambda: multiprocessing.current_process().name) == "MainProcess"
    assert (tisim.run(FLIGHT).state["position"] == before.state["position"]).all()


def test_a_turn_of_another_thread_is_not_waited_for():
    with runtime.turn:
        assert forked(runtime.turn.acquire, False)


def test_a_child_does_not_hold_the_locks_of_its_parent(tmp_path):
    """Nor does it release the parent's locks when it leaves the context in which it was forked."""
    path = tmp_path / "lock"

    def leave():
        held.__exit__(None, None, None)
        with pytest.raises(RunError, match="has been locked by another process"):
            atomic.locked(path, exclusive=True, timeout=0.0).__enter__()
        return sorted(atomic._held)

    held = atomic.locked(path, exclusive=True)
    held.__enter__()
    assert forked(leave) == []
    ready, go_on = os.pipe(), os.pipe()

    def stay():
        os.write(ready[1], b"x")
        os.read(go_on[0], 1)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        stay()
        os._exit(0)
    os.read(ready[0], 1)
    held.__exit__(None, None, None)
    with atomic.locked(path, exclusive=True, timeout=0.0):
        pass
    os.write(go_on[1], b"x")
    assert os.waitpid(child, 0)[1] == 0
    for descriptor in (*ready, *go_on):
        os.close(descriptor)
