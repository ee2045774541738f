"""The stages of an avalanche: their initial states, and failed stages."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.cases.avalanche.test_scene import TINY
from tisim import RunError
from tisim.cases.avalanche import stages
from tisim.cases.avalanche.scene import DIAMETERS, FLUX, REST
from tisim.cases.avalanche.stages import avalanches
from tisim.effects import Walls
from tisim.engine.result import Status
from tisim.operators import AtRest

D = DIAMETERS[0]


def moving_up(scenes, progress, fails=None):
    """Results of scenes in which each grain has moved up by its diameter."""
    results = []
    for index, scene in enumerate(scenes):
        state = {**scene.start(), "spin": np.zeros((TINY.number, 3)), "id": np.arange(TINY.number)}
        state["position"] = state["position"] + [0.0, 0.0, D]
        results.append(SimpleNamespace(scene=scene, state=state, status=Status(index != fails, "as made")))
    progress(1.0)
    return results


def gate(scene):
    return next(one for one in scene.effects if isinstance(one, Walls) and one.name == "gate").motion


def test_each_stage_begins_where_the_last_one_ended(monkeypatch):
    """Runs of one size and start share one settling run for all fields; the wall opens in the last stage."""
    calls, parts = [], []

    def run(scenes, progress):
        calls.append(list(scenes))
        return moving_up(scenes, progress)

    monkeypatch.setattr(stages, "run", run)
    wanted = [(D, 0.0, 3), (D, FLUX, 3), (D, FLUX, 4)]
    runs = avalanches(TINY, wanted, parts.append)
    assert [len(scenes) for scenes in calls] == [2, 3, 3]
    assert parts == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert [(one.diameter, one.field, one.seed) for one in runs] == wanted
    for one in runs:
        loose = next(scene for scene in calls[0] if scene.seed == one.seed).start()["position"]
        np.testing.assert_allclose(
            one.end.state["position"] - loose, np.tile([0, 0, 3 * D], (TINY.number, 1))
        )
        np.testing.assert_allclose(one.magnetised["position"][:, 2] - one.settled["position"][:, 2], D)
    fields = [[any("magnetic" in e.kind() for e in scene.effects) for scene in scenes] for scenes in calls]
    assert fields == [[False, False], [False, True, True], [False, True, True]]
    speeds = [{gate(scene).velocity[0] > 0 for scene in scenes} for scenes in calls]
    assert speeds == [{False}, {False}, {True}]
    rests = [e for scene in calls[2] for e in scene.effects if isinstance(e, AtRest)]
    assert len(rests) == 3
    assert {(one.energy, one.unbalanced) for one in rests} == {tuple(REST.values())}


def test_a_failed_stage_is_an_error(monkeypatch):
    monkeypatch.setattr(stages, "run", lambda scenes, progress: moving_up(scenes, progress, fails=1))
    with pytest.raises(RunError, match="avalanche: as made"):
        avalanches(TINY, [(D, 0.0, 3), (D, 0.0, 4)])
