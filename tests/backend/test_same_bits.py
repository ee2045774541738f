"""Taichi and Quadrants give the same bits, in scenes of every kind and on every schedule."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests import extremes
from tests.backend.bits import bits, scene_of
from tisim.backend import choice, runtime
from tisim.backend.taichi import BACKEND
from tisim.engine.simulation import SCHEDULES

pytestmark = pytest.mark.long

FAMILIES = ("effects.granular", "stepper.collocation.0", "stepper.brownian.2")
"""Contacts with history, an implicit stepper with forces between all particles, and noise with hydrodynamics.
Impacts and noise are compared in tests/engine/test_schedules.py, with ``elsewhere``."""


def bits_of(backend, schedule, folder, names=()):
    """Hashes of scenes under a backend, from a separate process; all scenes unless ``names`` selects some."""
    file = folder / f"{backend}-{schedule}.json"
    command = [sys.executable, "-m", "tests.backend.bits", str(file), *names, "--schedule", schedule]
    environment = os.environ | {choice.VARIABLE: backend}
    root = Path(__file__).parents[2]
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(file.read_text())


@pytest.mark.parametrize("name", extremes.scenes())
def test_a_scene_of_every_kind_can_begin(name):
    made = scene_of(name)
    start = made.start()
    for effect in made.acting():
        effect.check_start(start, made)


@pytest.mark.slow
def test_scenes_of_some_families(tmp_path):
    if runtime.current().settings != runtime.Runtime(threads=1).settings:
        pytest.skip("bits are promised of one device, precision and arithmetic")
    other = next((name for name in choice.installed() if name != BACKEND), None)
    if other is None:
        pytest.skip("one backend is installed")
    theirs = bits_of(other, "world", tmp_path, FAMILIES)
    for name in FAMILIES:
        mine = bits(scene_of(name), "world")
        assert "reached its end" in mine["ended"]
        assert mine == theirs[name], name


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Hashes of all scenes by backend and schedule, with all compiler passes on, as in users' runs."""
    folder = tmp_path_factory.mktemp("bits")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TI_ADVANCED_OPTIMIZATION", "1")
        return {
            (backend, schedule): bits_of(backend, schedule, folder)
            for schedule in SCHEDULES
            for backend in choice.LLVM
        }


@pytest.mark.slow
@pytest.mark.parametrize("name", extremes.scenes())
def test_a_scene_of_every_kind_on_every_schedule(found, name):
    """Takes an hour for all scenes."""
    first = found["taichi", "world"][name]
    for way, results in found.items():
        assert results[name] == first, way
