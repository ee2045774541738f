"""How a study observes its runs, and how many simulations it keeps."""

import numpy as np
import pytest

from tests.accuracy.scenes import oscillator
from tisim import Result, Status, steppers
from tisim.accuracy import timing
from tisim.accuracy.scene_changes import in_steps_of_at_most
from tisim.accuracy.timing import OBSERVATIONS, ROOM, ResultObserver, SimulationCache
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
    """A world that is where it waits to be observed, or at its end."""

    def __init__(self, duration):
        self.time = 0.0
        self.scenes = [oscillator().model_copy(update={"duration": duration})]

    def results(self, worlds):
        return [Result(self.scenes[0], {}, {}, self.time, {}, Status(True, ""), 0.0)]


def test_a_world_is_observed_each_time_once_and_waits_for_what_is_to_come():
    """In one case of 20, n times a part of the duration is rounded to less than n such parts."""
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
    """Whatever a control calls its lengths, and whatever the shortest is."""
    control = CONTROLS[kind]
    required = {name: 1e-3 for name, info in control.model_fields.items() if info.is_required()}
    duration = 1e-5
    stepper = Stepper.known()["verlet"].model_construct(control=control(**required))
    scene = oscillator().model_copy(update={"stepper": stepper, "duration": duration})
    assert scene.stepper.control.min_steps(duration) < OBSERVATIONS
    short = in_steps_of_at_most(scene, duration / OBSERVATIONS).stepper.control
    assert short.min_steps(duration) >= OBSERVATIONS * (1 - 1e-12)
    # Its parts still agree with each other, and what is compiled is the same.
    assert control(**short.model_dump()) == short
    assert short.structure() == control(**required).structure()


class Memory:
    """The trees of a simulation, without what they are for."""

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


def test_a_study_of_many_structures_gives_back_what_it_has_not_used_for_longest(own, monkeypatch):
    monkeypatch.setattr(timing, "Simulation", Memory)
    monkeypatch.setattr(memory, "MAX_TREES", len(memory.in_use()) + ROOM + 8)
    cache, scene = SimulationCache(), oscillator()
    first = cache.compiled(scene, 1)
    for worlds in range(2, ROOM):
        latest = cache.compiled(scene, worlds)
        assert cache.compiled(scene, 1) is first
        assert cache.compiled(scene, worlds) is latest
    assert all(tree.alive for tree in first.trees + latest.trees)
    # Two fit beside the room for another, and that one.
    assert len(cache.cached) == 3
    assert sum(tree.alive for simulation in cache.cached.values() for tree in simulation.trees) == 12
    for simulation in cache.cached.values():
        simulation.close()
