"""``tisim doctor`` times steps of the package, as its benchmarks do."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tisim.backend import choice
from tisim.backend.taichi import BACKEND
from tisim.describe import diagnostics
from tisim.effects import Granular, NearField

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_steps_of_all_pairs_and_of_contacts_are_timed():
    """In a separate process; no time belongs to a step that computes nothing."""
    laws = [type(make().effects[0]) for make in diagnostics.TIMED_SCENES.values()]
    assert laws == [NearField, Granular]
    times = diagnostics.step_times_of(BACKEND)
    assert times.keys() == diagnostics.TIMED_SCENES.keys()
    # A pair of charges takes a root and a division: between 0.1 ns and 100 ns.
    pairs = diagnostics.TIMED_SIDE**6
    assert 0.1e-9 * pairs < times["charges"] < 100e-9 * pairs
    assert 1e-6 < times["grains in contact"] < 0.1


def test_a_backend_that_is_absent_or_fails_has_no_times(monkeypatch):
    monkeypatch.setattr(choice, "installed", lambda: ["taichi"])
    assert diagnostics.step_times_of("quadrants") == {}
    monkeypatch.setattr(sys, "executable", "/bin/false")
    assert diagnostics.step_times_of("taichi") == {}


def benchmark_time(backend):
    """The shortest time of a step of 1000 charges, s, by tests/benchmarks/near_field.py."""
    command = [sys.executable, "tests/benchmarks/near_field.py", "--numbers", "1000", "--repeats", "5"]
    environment = os.environ | {choice.VARIABLE: backend}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    return 1e-3 * float(re.findall(r"tisim .*best ([\d.]+)", done.stdout)[0])


@pytest.mark.slow
@pytest.mark.skipif(len(choice.installed()) < 2, reason="one backend is installed")
def test_the_ratio_of_both_backends_equals_the_benchmark():
    """On an otherwise idle machine: the shortest of three turns of each."""
    ratios = []
    for time in (lambda backend: diagnostics.step_times_of(backend)["charges"], benchmark_time):
        turns = [[time(backend) for backend in choice.LLVM] for _ in range(3)]
        taichi, quadrants = (min(times) for times in zip(*turns, strict=True))
        ratios.append(taichi / quadrants)
    assert ratios[0] == pytest.approx(ratios[1], rel=0.25)
