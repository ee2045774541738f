"""Studies of users' own scenes: closed paths, short runs, and laws that make no difference."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tests.accuracy.scenes import RATE, SPEED, STEP, only, oscillator, place
from tisim import RunError
from tisim.accuracy import Quantity, Study, quantity, run, storage, study, table, write
from tisim.accuracy.quantity import displacement
from tisim.accuracy.report import error_texts, notes
from tisim.accuracy.runner import StudyRunner
from tisim.accuracy.timing import OBSERVATIONS, SimulationCache
from tisim.backend import runtime
from tisim.effects import Tether
from tisim.steppers import ErrorControl, FixedStep, Trapezoid, Verlet

PERIOD = 2 * np.pi / RATE
FEW = {"precisions": ("f64",), "repeats": 1, "coarser": 2}
RETURNING = Quantity("known", displacement, place, returns=True)
MISSED = 1.1 * (1 - np.cos(np.pi / OBSERVATIONS))
"""Largest relative error in the size of the motion if a turning point is half-way between observations."""


@pytest.fixture
def verlet_only(monkeypatch):
    """One compilation serves all tests here."""
    only(monkeypatch)


def closed():
    """The oscillator for one period, after which it is back at its start."""
    return oscillator().model_copy(update={"duration": PERIOD})


def test_a_motion_that_returns_to_its_start_is_measured_by_its_size(verlet_only, tmp_path):
    cost_study = study(closed(), **FEW)
    (truth,) = cost_study.truths
    assert truth.size == pytest.approx(SPEED / RATE, rel=MISSED)
    assert np.linalg.norm(truth.estimate.value) < 1e-6 * truth.size
    # The relative phase error of Verlet is (w dt)^2 / 24.
    for row in cost_study.rows:
        dt = float(row.setting.removeprefix("dt="))
        assert row.errors[0][0] == pytest.approx(2 * np.pi * (RATE * dt) ** 2 / 24, rel=0.1)
    # Timings decide which of the finer rows is cheapest; the coarsest is not accurate enough.
    assert cost_study.cheapest(1e-4).errors[0][0] <= 1e-4 < cost_study.rows[0].errors[0][0]
    assert (
        "displacement: relative to its largest value during the run" in table(cost_study).renderables[0].plain
    )
    write(cost_study, tmp_path)
    again = Study(closed(), **FEW)
    storage.resume(again, tmp_path)
    assert again.truths[0].size == truth.size
    assert again.rows == cost_study.rows


@pytest.mark.parametrize(
    ("stepper", "periods"),
    [
        # Particles with individual steps are at one time only at the end of the run.
        (Trapezoid(control=ErrorControl(longest=10.0)), 1),
        (Verlet(control=FixedStep(dt=PERIOD / 8)), 1),
        # Of 128 observations, every second one is at the start and the others half a period later.
        (Verlet(control=FixedStep(dt=PERIOD / 400)), 64),
        (Verlet(control=FixedStep(dt=PERIOD / 400)), 128),
    ],
    ids=["long windows", "long steps", "half a period between observations", "a period between observations"],
)
def test_observations_see_the_size_of_a_motion(monkeypatch, stepper, periods):
    only(monkeypatch)
    scene = oscillator().model_copy(update={"stepper": stepper, "duration": periods * PERIOD})
    cost_study = study(scene, (RETURNING,), **{**FEW, "coarser": 0})
    # The relative error of Verlet's amplitude is (w dt)^2 / 8.
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
        run(cost_study, progress=lambda fraction, what: outcomes.append(other.submit(free).result()))
        assert outcomes
        assert not any(outcomes)
        assert other.submit(free).result()


def test_compilation_does_not_count_in_the_budget(verlet_only, monkeypatch):
    """Compilation takes eleven days here, and the budget is three hours."""
    now, late, ready = time.monotonic, [0.0], SimulationCache.compiled

    def slowly(self, scene, worlds):
        late[0] += 1e6
        return ready(self, scene, worlds)

    monkeypatch.setattr(time, "monotonic", lambda: now() + late[0])
    monkeypatch.setattr(SimulationCache, "compiled", slowly)
    cost_study = study(closed(), **FEW, budget=1e4)
    assert cost_study.complete
    assert len(cost_study.rows) == 3


def test_a_setting_over_the_limit_is_a_failed_row(verlet_only, monkeypatch, tmp_path):
    now, late = time.monotonic, [0.0]

    def slowly(self, scenes, progress, on_result=None, run=SimulationCache.run):
        if scenes[0].stepper.control.dt == 0.01:
            progress(0.0)
            late[0] += 1e4
            progress(0.5)
        return run(self, scenes, progress, on_result)

    with monkeypatch.context() as patch:
        patch.setattr(time, "monotonic", lambda: now() + late[0])
        patch.setattr(SimulationCache, "run", slowly)
        cost_study = study(closed(), **FEW, limit=3e3)
    assert [row.failed for row in cost_study.rows] == [
        "over the limit of 3000 s" * (k == 0) for k in range(3)
    ]
    assert cost_study.complete
    assert cost_study.cheapest(1.0) in cost_study.rows[1:]
    assert "  dt=0.01: over the limit of 3000 s" in map(str, table(cost_study).renderables)
    write(cost_study, tmp_path)
    for limit, known in ((3e3, 3), (1e3, 3), (4e3, 2), (np.inf, 2)):
        again = Study(closed(), **FEW, limit=limit)
        storage.resume(again, tmp_path)
        assert (len(again.rows), again.complete) == (known, known == 3)
    run(again)
    assert sorted(len(row.errors) for row in again.rows) == [1, 1, 1]


def test_a_reference_that_takes_longer_than_the_budget_is_stopped(verlet_only, monkeypatch):
    """It is stopped although its estimated time was within the budget."""
    now, late = time.monotonic, [0.0]

    def slowly(self, scenes, progress, on_result=None, run=SimulationCache.run):
        if scenes[0].stepper.control.dt < STEP / 5:
            progress(0.0)
            late[0] += 1e4
            progress(0.5)
        return run(self, scenes, progress, on_result)

    monkeypatch.setattr(time, "monotonic", lambda: now() + late[0])
    monkeypatch.setattr(SimulationCache, "run", slowly)
    with pytest.raises(RunError, match=r"^the reference: .*: takes longer than the budget allows$"):
        study(closed(), **FEW, budget=1e3)


def test_a_setting_over_the_budget_is_not_begun_in_a_later_repeat(verlet_only, monkeypatch):
    def cost(self, method, k, cost=StudyRunner._cost):
        return 1e9 if method.settings[k].description == "dt=0.001" else cost(self, method, k)

    monkeypatch.setattr(StudyRunner, "_cost", cost)
    cost_study = study(closed(), **{**FEW, "repeats": 2}, budget=1e6)
    assert [row.setting for row in cost_study.rows] == ["dt=0.01", "dt=0.00316"]
    assert not cost_study.complete


def test_a_useless_reference_ends_a_study_that_needs_one(verlet_only, monkeypatch):
    """The study ends before any setting is run, and keeps the reference values."""
    monkeypatch.setattr(quantity, "LARGEST_REFERENCE_ERROR", 1e-12)
    cost_study = Study(closed(), **FEW, require_reference=True)
    refusal = r"^displacement must be known by the reference to 1e-12 of the motion; received .* are chaotic"
    for _ in range(2):
        with pytest.raises(RunError, match=refusal):
            run(cost_study)
    assert cost_study.rows == []
    assert len(cost_study.truths) == 1
    assert len(study(closed(), **FEW).rows) == 3


def test_a_law_that_makes_no_difference_is_called_the_same(verlet_only, monkeypatch):
    softer = Tether(stiffness=(10.0,) * 3)
    monkeypatch.setattr(Tether, "approximations", lambda self, extent: (softer, self.model_copy()))
    cost_study = study(closed(), **FEW)
    assert [row.same for row in cost_study.line("Tether")] == [False, True]
    assert not any(row.same for row in cost_study.line("Verlet, FixedStep: dt"))
    below = notes(cost_study)
    assert "no change: the same errors, up to rounding, as with the law that it approximates" in below
    assert any(line.startswith("time: median of the wall seconds; spread: ") for line in below)
    unknown = any(text.startswith("<") for row in cost_study.rows for text in error_texts(row))
    assert any(line.startswith("<: ") for line in below) == unknown
