"""What a study answers for a scene of one's own: closed paths, short runs, and laws that change nothing."""

import time

import numpy as np
import pytest

from tests.accuracy.scenes import RATE, SPEED, only, oscillator
from tisim.accuracy import Study, files, study
from tisim.accuracy.bench import LOOKS, Bench
from tisim.accuracy.listing import sources
from tisim.effects.tether import Tether

PERIOD = 2 * np.pi / RATE
FEW = {"precisions": ("f64",), "repeats": 1, "coarser": 2}


@pytest.fixture
def verlet_only(monkeypatch):
    """One compilation serves all tests here."""
    only(monkeypatch)


def closed():
    """The oscillator, back where it has begun."""
    return oscillator().model_copy(update={"duration": PERIOD})


def test_a_motion_that_returns_to_its_start_is_measured_by_its_size(verlet_only, tmp_path):
    found = study(closed(), **FEW)
    (truth,) = found.truths
    # 1 - cos of half the way between two looks is by how much the turning point may be missed.
    assert truth.size == pytest.approx(SPEED / RATE, rel=1.1 * (1 - np.cos(np.pi / LOOKS)))
    assert np.linalg.norm(truth.estimate.value) < 1e-6 * truth.size
    # Verlet's phase runs ahead by (w dt)^2 / 24 of itself.
    for row in found.rows:
        dt = float(row.setting.removeprefix("dt="))
        assert row.errors[0][0] == pytest.approx(2 * np.pi * (RATE * dt) ** 2 / 24, rel=0.1)
    assert found.cheapest(1e-4).python == found.rows[1].python
    assert "displacement: relative to its largest on the way" in found.table().renderables[0].plain
    found.write(tmp_path)
    again = Study(closed(), **FEW)
    files.resume(again, tmp_path)
    assert again.truths[0].size == truth.size
    assert again.rows == found.rows


def test_compiling_takes_nothing_of_the_budget(verlet_only, monkeypatch):
    """Eleven days of it, of a budget of three hours."""
    now, late, ready = time.monotonic, [0.0], Bench.ready

    def slowly(self, scene, worlds):
        late[0] += 1e6
        return ready(self, scene, worlds)

    monkeypatch.setattr(time, "monotonic", lambda: now() + late[0])
    monkeypatch.setattr(Bench, "ready", slowly)
    found = study(closed(), **FEW, budget=1e4)
    assert found.complete
    assert len(found.rows) == 3


def test_a_law_that_makes_no_difference_is_called_the_same(verlet_only, monkeypatch):
    softer = Tether(stiffness=(10.0,) * 3)
    monkeypatch.setattr(Tether, "approximations", lambda self, extent: (softer, self.model_copy()))
    found = study(closed(), **FEW)
    assert [row.same for row in found.line("Tether")] == [False, True]
    assert not any(row.same for row in found.line("Verlet, FixedStep: dt"))
    assert "no change: the same as of the law that it stands for, but for rounding" in sources(found)
