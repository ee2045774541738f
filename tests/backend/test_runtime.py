"""The runtime refuses unknown settings, objects of an earlier start raise an error when used, any thread may
call, and the caller's floating-point mode is unchanged."""

import os
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import tisim
from tests.scenes import scene
from tests.throwaway import Trap
from tisim import InputError, RunError, Scene, Simulation
from tisim.backend import memory, runtime, surroundings
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.components.component import rounded
from tisim.describe import diagnostics
from tisim.engine.batches import Batches


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"device": "tpu"}, "device must be one of cpu, cuda, vulkan; received 'tpu'"),
        ({"precision": "f16"}, "precision must be one of f64, f32; received 'f16'"),
        ({"arithmetic": "loose"}, "arithmetic must be one of strict, fast; received 'loose'"),
        ({"threads": -1}, r"threads must be a whole number, at least 1 \(0 for all cores\); received -1"),
        ({"threads": 1.5}, r"threads must be a whole number, at least 1 \(0 for all cores\); received 1.5"),
    ],
)
def test_unknown_settings_are_refused_before_anything_starts(settings, message):
    before = runtime.generation()
    with pytest.raises(InputError, match=f"^{message}$"):
        runtime.init(**settings)
    assert runtime.generation() == before


def test_starting_again_with_the_same_settings_changes_nothing():
    now, before = runtime.current(), runtime.generation()
    assert runtime.init(now.device, now.precision, now.threads) is now or runtime.current() == now
    assert runtime.generation() == before


def test_unknown_memory_size_refuses_nothing(monkeypatch):
    monkeypatch.setattr(surroundings, "memory_limit", lambda: sys.maxsize)
    there = runtime.memory()
    assert diagnostics._memory() == f"{there / 2**30:.1f} GiB"
    monkeypatch.delattr(os, "sysconf")
    assert runtime.memory() == sys.maxsize
    assert diagnostics._memory() == "unknown"


STALE = """
import numpy as np
from tisim import Particles, Scene, Simulation, run
from tisim.backend import memory, runtime
from tisim import InputError, RunError
from tisim.steppers import FixedStep
from tisim.steppers import Verlet
at = np.zeros((1, 3))
scene = Scene(particles=Particles(position=at, velocity=at + 1, radius=1.0, mass=1.0),
              stepper=Verlet(control=FixedStep(dt=0.5)), duration=1.0)
runtime.init(threads=1)
old = Simulation(scene)
old.load([scene])
runtime.init(threads=2)
uses = (
    lambda: old.run(), lambda: old.load([scene]), lambda: old.results(), lambda: old.s.read("mass"),
    lambda: old.s.write("mass", 1.0), lambda: old.fraction(), lambda: next(old.chunks()), lambda: old.ended(),
)
for use in uses:
    try:
        use()
    except RunError as refusal:
        print(refusal)
result = run(scene)
assert result.status.ok and (result.state["position"] == 1).all()
runtime.init(threads=1)
assert (run(scene).state["position"] == 1).all()
print("made anew")
old.close()
old.close()
mine = Simulation(scene)
assert np.float64(5e-324) * 1.0 > 0.0
try:
    runtime.init(device="cuda")
except InputError:
    runtime.init(threads=2)
mine.close()
assert (run(scene).state["position"] == 1).all()
print("closed")
del mine
memory.MAX_TREES_PER_START, before = 1, runtime.generation()
for number in (9, 20, 45):
    at = np.zeros((number, 3))
    more = Particles(position=at, velocity=at + 1, radius=1.0, mass=1.0)
    assert (run(scene.model_copy(update={"particles": more})).state["position"] == 1).all()
print(runtime.generation() - before)
"""


@pytest.mark.long
def test_simulations_of_an_earlier_start_raise_an_error():
    """An error instead of a segmentation fault. The old simulation can be closed and a new one works, also
    after a failed start and if Taichi was restarted because it had grown."""
    completed = subprocess.run(
        [sys.executable, "-c", STALE], capture_output=True, text=True, timeout=3600, check=False
    )
    refusal = "a Simulation must be used with the settings it was made under; start it anew"
    assert completed.stdout.splitlines() == [*[refusal] * 8, "made anew", "closed", "3"], completed.stderr
    assert completed.returncode == 0


KEPT = """
import atexit, gc
from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti

def made():
    builder = Builder()
    builder.dense(ti.i, 3).place(ti.field(ti.f64))
    return Tree(builder)

def count():
    return sum(type(one).__name__ == "SNodeTree" for one in gc.get_objects())

make = runtime.in_taichi_thread(made)
runtime.init(threads=1)
kept = [make(), make()]
runtime.init(threads=1, precision="f32")
kept.append(make())
print(count())
atexit.register(lambda: print(count()))
"""
"""Trees of two starts that exist until the process ends. The functions of atexit run after Taichi has
stopped."""


def test_no_tree_outlives_taichi():
    """A tree would be the last owner of its program, which must be freed in Taichi's thread on CUDA."""
    completed = subprocess.run([sys.executable, "-c", KEPT], capture_output=True, text=True, check=True)
    before, after = map(int, completed.stdout.split())
    assert (before >= 3, after) == (True, 0)


def test_absent_device_is_refused():
    """On a machine without a GPU this is an error; on one with a GPU, it starts."""
    code = (
        "from tisim import errors\n"
        "from tisim.backend import runtime\n"
        "try: print(runtime.init(device='cuda').device)\n"
        "except errors.InputError as fault: print(fault)"
    )
    completed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=3600, check=False
    )
    line = completed.stdout.strip().splitlines()[0]
    assert line == "cuda" or line.startswith("device must be present on this machine; received 'cuda'"), (
        completed.stderr
    )
    assert completed.returncode == 0


def moving(speed, effects=()):
    """A single grain at this speed, m/s."""
    return scene([[0.0, 0.0, 0.0]], [[speed, 0.0, 0.0]], effects, dt=0.5, steps=40)


def test_four_threads_get_their_own_results():
    """Other threads compile scenes of new structure meanwhile; each result has the bits of a run on
    its own."""
    scenes = [moving(1.0 + k, (Trap(stiffness=1e-6),) if k % 2 else ()) for k in range(24)]
    with ThreadPoolExecutor(4) as threads:
        results = list(threads.map(tisim.run, scenes))
    for one, result in zip(scenes, results, strict=True):
        assert result.scene is one
        assert result.status.ok
        (alone,) = tisim.run([one])
        for name, values in alone.state.items():
            np.testing.assert_array_equal(result.state[name], values)
    assert len({result.state["position"][0, 0] for result in results}) == len(scenes)


def test_a_run_from_within_the_progress_of_another():
    """The two runs use different simulations."""
    inner = []

    def progress(fraction):
        if not inner:
            inner.append(tisim.run(moving(7.0)))

    result = tisim.run(moving(3.0), progress)
    assert result.state["position"][0, 0] == pytest.approx(60.0)
    assert inner[0].state["position"][0, 0] == pytest.approx(140.0)


def test_the_callers_arithmetic_keeps_subnormal_numbers():
    """Taichi's start makes its own thread flush subnormal numbers to 0; a scene with them survives a round
    trip through text."""
    tisim.run(moving(1.0))
    assert np.float64(5e-324) * 1.0 > 0.0
    for number in (5e-324, 1e-310, 2.2e-308):
        again = Scene.from_dict(tomllib.loads(moving(number).to_toml()))
        assert again.particles.arrays(again.domain, 0)["velocity"][0, 0] == number > 0.0
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(lambda: np.float64(5e-324) * 1.0).result() > 0.0


def test_a_closed_simulation_raises_an_error():
    simulation = Simulation(moving(1.0))
    simulation.load([moving(1.0)])
    simulation.close()
    simulation.close()
    for use in (simulation.run, simulation.results, lambda: simulation.load([moving(1.0)])):
        with pytest.raises(RunError, match=r"^a Simulation must be used before it is closed; make another$"):
            use()


@in_taichi_thread
def tree():
    """A field tree of its own."""
    column, builder = ti.field(ti.f64), Builder()
    builder.dense(ti.i, 4).place(column)
    return column, Tree(builder)


def test_unreferenced_trees_are_destroyed():
    """More than Taichi allows at once; none of them is destroyed explicitly."""
    before = len(memory.in_use())
    for _ in range(600):
        column, _ = tree()
    assert len(memory.in_use()) <= before + 2
    in_taichi_thread(column.fill)(1.0)


def test_too_many_trees_are_refused(monkeypatch):
    """An error is raised before the limit of 512, at which Taichi crashes."""
    monkeypatch.setattr(memory, "MAX_TREES", len(memory.in_use()) + 3)
    trees = [tree() for _ in range(3)]
    with pytest.raises(RunError, match=r"^at most \d+ sets of fields can be in use at once"):
        tree()
    in_taichi_thread(trees[0][0].fill)(1.0)
    trees[1][1].destroy()
    trees.append(tree())
    in_taichi_thread(trees[-1][0].fill)(2.0)


@in_taichi_thread
def kernels():
    """Number of compiled kernels that are still held."""
    return ti.lang.impl.get_runtime().get_num_compiled_functions()


def test_few_kernels_are_compiled_and_none_again():
    """There is no kernel per field and direction, and destroying another tree does not discard all
    kernels."""
    before = kernels()
    tisim.run(moving(1.0, (Trap(stiffness=2e-6, omega=1.0),)))
    tree()[1].destroy()
    Simulation(moving(1.0)).close()
    compiled = kernels()
    assert compiled - before < 24
    tisim.run(moving(2.0, (Trap(stiffness=2e-6, omega=1.0),)))
    assert kernels() == compiled


def grains(number):
    """Grains side by side without interaction."""
    at = np.arange(3.0 * number).reshape(number, 3)
    return scene(at, 0 * at, radius=0.1, mass=1.0, dt=0.5)


@pytest.mark.slow
def test_small_scenes_do_not_reuse_large_simulations():
    """An idle simulation is reused for scenes of similar size; sizes are rounded, so that similar ones share
    it."""
    batches = Batches()
    for number in (10_000, 3, 5, 9_900, 10_100):
        ((_, result),) = batches.run([grains(number)])
        assert result.status.ok
    sizes = [(each.worlds, each.s.capacity) for each in batches._idle]
    assert sorted(sizes) == [(1, 10240), (8, 3), (8, 5)]
    batches.close()
    assert not batches._idle


def test_a_few_worlds_of_a_small_scene_compile_nothing_after_one():
    batches = Batches()
    for number in (1, 3, 8, 2):
        assert all(result.status.ok for _, result in batches.run([grains(500)] * number))
    assert [(each.worlds, each.s.capacity) for each in batches._idle] == [(8, 512)]
    batches.close()


@pytest.mark.slow
def test_idle_simulations_are_closed_if_memory_is_short():
    """Idle simulations are closed, and unreferenced ones that the garbage collector has not yet freed."""
    kept = Batches()
    assert all(result.status.ok for _, result in kept.run([grains(3000)]))
    for _ in range(3):
        forgotten = Simulation(grains(3000))
        forgotten.itself = forgotten
        del forgotten
    before = memory.bytes_in_use()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runtime, "memory", lambda: before)
        Simulation(grains(3000)).close()
    assert not kept._idle


def test_rounded_sizes():
    """A rounded size is at least the size, and less than a quarter larger."""
    for number in range(1, 5000):
        assert number <= rounded(number) <= max(number, 1.25 * number)
    assert len({rounded(number) for number in range(1, 5000)}) < 50


@pytest.mark.long
def test_taichi_is_not_restarted_while_in_use(monkeypatch):
    """A simulation in use survives, however many kernels have been compiled."""
    mine, before = Simulation(moving(1.0)), runtime.generation()
    monkeypatch.setattr(memory, "MAX_TREES_PER_START", 0)
    assert tisim.run(grains(9)).status.ok
    assert runtime.generation() == before
    mine.load([moving(1.0)])
    mine.close()


GROWTH = """
from tests.benchmarks.changing_structure import soak
from tisim.backend import memory, runtime
memory.MAX_TREES_PER_START = 10
sizes = [size for _, _, size in soak(40, 5)]
print(runtime.generation(), *sizes)
"""


@pytest.mark.slow
def test_memory_does_not_grow_with_scenes_of_changing_structure():
    """Forty scenes, nearly all of them compiled; Taichi is restarted after every fifth."""
    completed = subprocess.run([sys.executable, "-c", GROWTH], capture_output=True, text=True, check=True)
    starts, *sizes = (float(word) for word in completed.stdout.split())
    assert starts >= 5
    assert max(sizes[4:]) < sizes[2] + 40.0, sizes
