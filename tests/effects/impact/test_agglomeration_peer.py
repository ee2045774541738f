"""The engine against an independent program of the same model, benchmarks/agglomeration_numba.py.

The two can agree particle by particle for a limited time only. Each impact amplifies the rounding error, and
if a step is shortened to end when two surfaces meet, rounding decides whether they touch. Measured over 16
worlds of 60 grains of Z04's best design: all worlds have the same events for at least the first 75 steps
(nearly all of them merges). The largest difference grows from 1e-14 after 20 steps to 1e-13 after 40 and
2e-10 after 80; one world passes 1e-9 at step 75, four more by step 103, the other eleven never. With steps of
1e-6 s throughout it is 3e-15 after 200 steps.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

from tisim import Simulation
from tisim.backend import runtime
from tisim.cases.agglomeration.problem import cost
from tisim.cases.agglomeration.scene import BEST, DURATION, scene
from tisim.steppers import ApproachTime, Verlet

numba = pytest.importorskip("numba")
# Small parallel loops get slow if tbb is installed and numba prefers it.
numba.config.THREADING_LAYER_PRIORITY = ["omp", "workqueue", "tbb"]
sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
peer = pytest.importorskip("agglomeration_numba")

GRAINS, WORLDS = 60, 16
EVEN = Verlet(control=ApproachTime(shortest=1e-6, longest=1e-6))


@pytest.fixture(scope="module")
def simulation(the_runtime):
    """One compilation serves every scene of the case."""
    simulation_ = Simulation(scene(BEST, 0, 200), WORLDS)
    yield simulation_
    simulation_.close()


def prepare(design, grains, **changes):
    """Scenes from 16 random starts (seeds), and the same starts for the other program."""
    scenes = [scene(design, seed, grains).model_copy(update=changes) for seed in range(WORLDS)]
    starts = [s.particles.arrays(s.domain, s.seed) for s in scenes]
    laws = [{**design, "grain_mass": start["mass"][0]} for start in starts]
    return scenes, starts, laws


def apart(result, final):
    """Largest difference of any quantity, relative to its largest value; grains in order of x.

    Rounding decides which of two merging grains of equal size keeps its index, so indices are not compared.
    """
    a, b = np.argsort(final["position"][:, 0]), np.argsort(result.state["position"][:, 0])
    return max(np.abs(x[a] - result.state[name][b]).max() / np.abs(x).max() for name, x in final.items())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hardness", "even", "steps", "tolerance"),
    [
        pytest.param(1, False, 40, 1e-9, id="adaptive"),
        pytest.param(1, True, 200, 1e-9, id="even steps"),
        pytest.param(200, False, 25, 1e-9, id="hard grains"),
    ],
)
def test_every_step_has_the_same_events_and_particles(simulation, hardness, even, steps, tolerance):
    if runtime.current().precision != "f64":
        pytest.skip("a comparison of f64 programs")
    design = {**BEST, "hardness": hardness * BEST["hardness"]}
    scenes, starts, laws = prepare(design, GRAINS, **({"stepper": EVEN} if even else {}))
    settings = {"longest": 1e-6} if even else {}
    simulation.load(scenes)
    stride = 1 if steps < 100 else 10
    for number in range(stride, steps + 1, stride):
        simulation.run(steps=stride)
        results = simulation.results()
        finals, counts = peer.simulate(starts, laws, DURATION, steps=number, **settings)
        for w, result in enumerate(results):
            ours = dict(zip(peer.COUNTS, (result.work[name] for name in peer.COUNTS), strict=True))
            theirs = dict(zip(peer.COUNTS, counts[w].tolist(), strict=True))
            assert ours == theirs, f"world {w}, step {number}"
            assert apart(result, finals[w]) < tolerance, f"world {w}, step {number}"
    assert counts[:, 2].min() >= 20


@pytest.mark.slow
def test_cost_of_a_design_is_the_same(simulation):
    """Mean Pi over 16 starts of 200 grains, whole runs, in which rounding may change the events."""
    scenes, starts, laws = prepare(BEST, 200)
    simulation.load(scenes)
    simulation.run()
    ours = np.array([cost(result) for result in simulation.results()])
    finals, _ = peer.simulate(starts, laws, DURATION)
    whole = [np.cbrt((start["radius"] ** 3).sum()) for start in starts]
    theirs = np.array([1 - final["radius"].mean() / b for final, b in zip(finals, whole, strict=True)])
    error = np.sqrt((ours.var(ddof=1) + theirs.var(ddof=1)) / WORLDS)
    assert abs(ours.mean() - theirs.mean()) < 4 * error
