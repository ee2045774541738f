"""Observation of the runs of a study, and the number of simulations that it keeps."""

import numpy as np
import pytest

from tests.accuracy.scenes import oscillator
from tisim import Result, Status, steppers
from tisim.accuracy import timing
from tisim.accuracy.scene_changes import in_steps_of_at_most
from tisim.accuracy.timing import FREE_TREES, OBSERVATIONS, ResultObserver, SimulationCache
from tisim.backend import memory
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.components.serialization import load
from tisim.steppers import StepControl, Stepper

load(steppers)
CONTROLS = {k: c for k, c in StepControl.known().items() if c.__module__.startswith("tisim.")}


class Waiting:
    """A world that stops at each observation time and at its end."""

    def __init__(self, duration):
        self.time = 0.0
        self.scenes = [oscillator().model_copy(update={"duration": duration})]

    def results(self, worlds):
        return [Result(self.scenes[0], {}, {}, self.time, {}, Status(True, ""), 0.0)]


def test_a_world_is_observed_once_at_each_time():
    """In one of 20 cases, n times a fraction of the duration is rounded down."""
    for duration in np.random.default_rng(0).uniform(0.0, 10.0, 200):
        times, world = [], Waiting(duration)
        observer = ResultObserver(duration, lambda result, times=times: times.append(result.time))
        observer.observe(world)
        while world.time < duration:
            assert observer.pause(world)[0] > world.time
            world.time = min(observer.pause(world)[0], duration)
            observer.observe(world)
        assert len(times) == OBSERVATIONS + 1
        np.testing.assert_allclose(np.diff(times), duration / OBSERVATIONS, rtol=1e-12)


@pytest.mark.parametrize("kind", CONTROLS)
def test_steps_of_every_control_can_be_kept_short(kind):
    """This holds for any names of the step lengths, and for any shortest step."""
    control = CONTROLS[kind]
    required = {name: 1e-3 for name, info in control.model_fields.items() if info.is_required()}
    duration = 1e-5
    stepper = Stepper.known()["verlet"].model_construct(control=control(**required))
    scene = oscillator().model_copy(update={"stepper": stepper, "duration": duration})
    assert scene.stepper.control.min_steps(duration) < OBSERVATIONS
    short = in_steps_of_at_most(scene, duration / OBSERVATIONS).stepper.control
    assert short.min_steps(duration) >= OBSERVATIONS * (1 - 1e-12)
    # Its settings are still consistent, and the compiled structure is the same.
    assert control(**short.model_dump()) == short
    assert short.structure() == control(**required).structure()


class Memory:
    """The SNode trees of a simulation, and nothing else of it."""

    def __init__(self, scene, worlds):
        self.trees = [self.tree() for _ in range(4)]

    @in_taichi_thread
    def tree(self):
        builder = Builder()
        builder.dense(ti.i, 4).place(ti.field(ti.f64))
        return Tree(builder)

    def close(self):
        for tree in self.trees:
            tree.destroy()


def test_a_study_of_many_structures_closes_the_least_recently_used_simulations(own, monkeypatch):
    monkeypatch.setattr(timing, "Simulation", Memory)
    monkeypatch.setattr(memory, "MAX_TREES", len(memory.in_use()) + FREE_TREES + 8)
    cache, scene = SimulationCache(), oscillator()
    first = cache.compiled(scene, 1)
    for worlds in range(2, FREE_TREES):
        latest = cache.compiled(scene, worlds)
        assert cache.compiled(scene, 1) is first
        assert cache.compiled(scene, worlds) is latest
    assert all(tree.alive for tree in first.trees + latest.trees)
    # Two older simulations fit beside the space reserved for a new one, and the new one.
    assert len(cache.cached) == 3
    assert sum(tree.alive for simulation in cache.cached.values() for tree in simulation.trees) == 12
    for simulation in cache.cached.values():
        simulation.close()
