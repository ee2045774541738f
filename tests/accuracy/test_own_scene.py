"""What a study answers for a scene of one's own: closed paths, short runs, and laws that change nothing."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tests.accuracy.scenes import RATE, SPEED, only, oscillator, place
from tisim.accuracy import Quantity, Study, storage, study
from tisim.accuracy.quantity import displacement
from tisim.accuracy.table import sources
from tisim.accuracy.timing import OBSERVATIONS, SimulationCache
from tisim.backend import runtime
from tisim.effects import Tether
from tisim.steppers import ErrorControl, FixedStep, Trapezoid, Verlet

PERIOD = 2 * np.pi / RATE
FEW = {"precisions": ("f64",), "repeats": 1, "coarser": 2}
RETURNING = Quantity("known", displacement, place, returns=True)
MISSED = 1.1 * (1 - np.cos(np.pi / OBSERVATIONS))
"""By how much observations may miss a turning point, of the size of the motion: half way between two."""


@pytest.fixture
def verlet_only(monkeypatch):
    """One compilation serves all tests here."""
    only(monkeypatch)


def closed():
    """The oscillator, back where it has begun."""
    return oscillator().model_copy(update={"duration": PERIOD})


def test_a_motion_that_returns_to_its_start_is_measured_by_its_size(verlet_only, tmp_path):
    cost_study = study(closed(), **FEW)
    (truth,) = cost_study.truths
    assert truth.size == pytest.approx(SPEED / RATE, rel=MISSED)
    assert np.linalg.norm(truth.estimate.value) < 1e-6 * truth.size
    # Verlet's phase runs ahead by (w dt)^2 / 24 of itself.
    for row in cost_study.rows:
        dt = float(row.setting.removeprefix("dt="))
        assert row.errors[0][0] == pytest.approx(2 * np.pi * (RATE * dt) ** 2 / 24, rel=0.1)
    assert cost_study.cheapest(1e-4).python == cost_study.rows[1].python
    assert "displacement: relative to its largest on the way" in cost_study.table().renderables[0].plain
    cost_study.write(tmp_path)
    again = Study(closed(), **FEW)
    storage.resume(again, tmp_path)
    assert again.truths[0].size == truth.size
    assert again.rows == cost_study.rows


@pytest.mark.parametrize(
    ("stepper", "periods"),
    [
        # Particles alone are together at the end of the run, and nowhere before.
        (Trapezoid(control=ErrorControl(longest=10.0)), 1),
        (Verlet(control=FixedStep(dt=PERIOD / 4)), 1),
        # Every other observation of 128 is at the start, and the others half a period later.
        (Verlet(control=FixedStep(dt=PERIOD / 400)), 64),
        (Verlet(control=FixedStep(dt=PERIOD / 400)), 128),
    ],
    ids=["long windows", "long steps", "half a period between observations", "a period between observations"],
)
def test_observations_see_the_size_of_a_motion(monkeypatch, stepper, periods):
    only(monkeypatch)
    scene = oscillator().model_copy(update={"stepper": stepper, "duration": periods * PERIOD})
    cost_study = study(scene, (RETURNING,), **{**FEW, "coarser": 0})
    # Verlet's amplitude is off by (w dt)^2 / 8 of itself.
    error = (RATE * PERIOD / OBSERVATIONS) ** 2 / 8
    assert cost_study.truths[0].size == pytest.approx(SPEED / RATE, rel=MISSED + error)
    assert len(cost_study.rows) == len([row for row in cost_study.rows if not row.failed]) > 0


def test_other_threads_wait_while_a_study_starts_taichi_anew(verlet_only):
    def free():
        acquired = runtime.turn.acquire(blocking=False)
        if acquired:
            runtime.turn.release()
        return acquired

    outcomes = []
    with ThreadPoolExecutor(1) as other:
        cost_study = Study(closed(), (RETURNING,), **{**FEW, "coarser": 0})
        cost_study.run(progress=lambda fraction, what: outcomes.append(other.submit(free).result()))
        assert outcomes
        assert not any(outcomes)
        assert other.submit(free).result()


def test_compiling_takes_nothing_of_the_budget(verlet_only, monkeypatch):
    """Eleven days of it, of a budget of three hours."""
    now, late, ready = time.monotonic, [0.0], SimulationCache.compiled

    def slowly(self, scene, worlds):
        late[0] += 1e6
        return ready(self, scene, worlds)

    monkeypatch.setattr(time, "monotonic", lambda: now() + late[0])
    monkeypatch.setattr(SimulationCache, "compiled", slowly)
    cost_study = study(closed(), **FEW, budget=1e4)
    assert cost_study.complete
    assert len(cost_study.rows) == 3


def test_a_law_that_makes_no_difference_is_called_the_same(verlet_only, monkeypatch):
    softer = Tether(stiffness=(10.0,) * 3)
    monkeypatch.setattr(Tether, "approximations", lambda self, extent: (softer, self.model_copy()))
    cost_study = study(closed(), **FEW)
    assert [row.same for row in cost_study.line("Tether")] == [False, True]
    assert not any(row.same for row in cost_study.line("Verlet, FixedStep: dt"))
    assert "no change: the same as of the law that it stands for, but for rounding" in sources(cost_study)
