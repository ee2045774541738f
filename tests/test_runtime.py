"""The runtime: unknown settings are refused, and what an earlier start has made says so when used."""

import subprocess
import sys

import pytest

from tisim import runtime
from tisim.errors import InputError


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"device": "tpu"}, "device must be one of cpu, cuda; received 'tpu'"),
        ({"precision": "f16"}, "precision must be one of f64, f32; received 'f16'"),
        ({"threads": -1}, r"threads must be at least 1 \(0 for all cores\); received -1"),
    ],
)
def test_unknown_settings_are_refused_before_anything_starts(settings, message):
    before = runtime.generation()
    with pytest.raises(InputError, match=f"^{message}$"):
        runtime.start(**settings)
    assert runtime.generation() == before


def test_starting_again_with_the_same_settings_changes_nothing():
    now, before = runtime.current(), runtime.generation()
    assert runtime.start(now.device, now.precision, now.threads) is now or runtime.current() == now
    assert runtime.generation() == before


STALE = """
import numpy as np
from tisim import Particles, Scene, Simulation, runtime, run
from tisim.errors import RunError
from tisim.steppers.controller import FixedStep
from tisim.steppers.verlet import Verlet
at = np.zeros((1, 3))
scene = Scene(particles=Particles(position=at, velocity=at + 1, radius=1.0, mass=1.0),
              stepper=Verlet(control=FixedStep(dt=0.5)), duration=1.0)
runtime.start(threads=1)
old = Simulation(scene)
old.load([scene])
runtime.start(threads=2)
for use in (lambda: old.run(), lambda: old.load([scene])):
    try:
        use()
    except RunError as refusal:
        print(refusal)
result = run(scene)
assert result.status.ok and (result.state["position"] == 1).all()
runtime.start(threads=1)
assert (run(scene).state["position"] == 1).all()
print("made anew")
"""


@pytest.mark.long
def test_simulation_of_an_earlier_start_says_so():
    """Not a segmentation fault; and what is made anew works."""
    done = subprocess.run(
        [sys.executable, "-c", STALE], capture_output=True, text=True, timeout=120, check=False
    )
    refusal = "a Simulation must be used with the settings it was made under; start it anew"
    assert done.stdout.splitlines() == [refusal, refusal, "made anew"], done.stderr
    assert done.returncode == 0


def test_absent_device_is_refused():
    """A machine without a GPU says so; one with a GPU starts it."""
    code = (
        "from tisim import runtime, errors\n"
        "try: print(runtime.start(device='cuda').device)\n"
        "except errors.InputError as fault: print(fault)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False
    )
    line = done.stdout.strip().splitlines()[0]
    assert line == "cuda" or line.startswith("device must be present on this machine; received 'cuda'"), (
        done.stderr
    )
    assert done.returncode == 0
