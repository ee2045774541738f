"""Fitness functions do not change unintentionally."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import tisim
from tests.regression import fitness_record
from tisim.optimize import FitnessRecord
from tisim.scene.scene import PHYSICS_VERSION

STANDARD_ERRORS = 4.0
"""Bound on the difference of two means, exceeded by chance once in 16,000 comparisons."""


@pytest.fixture(scope="module")
def recorded_fitness():
    return FitnessRecord.load(fitness_record.FILE)


@pytest.fixture(scope="module")
def now():
    return fitness_record.measure()


def test_the_record_is_of_this_physics(recorded_fitness):
    assert recorded_fitness.physics == PHYSICS_VERSION


@pytest.mark.long
def test_same_settings_give_the_same_fitness_to_the_last_bit(recorded_fitness, now):
    """To the bit on the platform of the record; in the mean on others, whose exp and pow round
    differently."""
    if recorded_fitness.same_arithmetic(now):
        assert now.values == recorded_fitness.values
    else:
        assert max(recorded_fitness.deviations(now).values()) < STANDARD_ERRORS


@pytest.mark.slow
def test_the_other_schedule_gives_the_same_fitness_to_the_last_bit(now):
    problem = fitness_record.PROBLEM
    scenes = [problem.scene(fitness_record.DESIGNS["fragile"], seed) for seed in range(4)]
    simulation = tisim.Simulation(scenes[0], worlds=4, schedule="particle")
    simulation.load(scenes)
    simulation.run()
    (objective,) = problem.objectives
    assert [objective.of(r) for r in simulation.results()] == now.values["fragile"]["Pi"][:4]
    simulation.close()


def elsewhere(folder, *options):
    """The record computed in a separate process, because precision and threads belong to the runtime."""
    file = folder / "fitness.json"
    command = [sys.executable, fitness_record.__file__, "--write", str(file), *options]
    subprocess.run(command, check=True, cwd=Path(fitness_record.__file__).parents[2])
    return FitnessRecord.load(file)


@pytest.mark.slow
def test_single_precision_gives_the_same_fitness_in_the_mean(recorded_fitness, tmp_path):
    single = elsewhere(tmp_path, "--precision", "f32")
    assert not recorded_fitness.same_arithmetic(single)
    assert max(recorded_fitness.deviations(single).values()) < STANDARD_ERRORS


@pytest.mark.slow
def test_any_number_of_threads_gives_the_same_fitness_to_the_last_bit(now, tmp_path):
    assert elsewhere(tmp_path, "--threads", "1").values == now.values
    assert elsewhere(tmp_path, "--threads", "3").values == now.values


@pytest.mark.long
def test_the_bound_detects_a_change_of_physics(now):
    """A hardness 1.5 times as large differs by 7, 30 and 10 standard errors (measured).

    A hardness 1.25 times as large is also detected (19), by the design with the least variation between
    starts.
    """
    names = ("published", "hard and slow", "fragile")
    designs = {name: fitness_record.DESIGNS[name] for name in names}
    harder = {name: {**design, "hardness": 1.5 * design["hardness"]} for name, design in designs.items()}
    changed = FitnessRecord.measure(fitness_record.PROBLEM, harder, fitness_record.STARTS)
    before = replace(now, values={name: now.values[name] for name in names})
    assert min(before.deviations(changed).values()) > STANDARD_ERRORS
