"""Studies of one scene and another share what they compile."""

import os

import pytest

from tests.scenes import compiled
from tisim.accuracy.timing import Bench

READY = Bench.ready


@pytest.fixture(autouse=True, scope="session")
def shared():
    """A simulation for each structure, number of worlds and capacity, kept for all tests here."""
    if os.environ.get("TISIM_TEST_PRECISION", "f64") != "f64":
        pytest.skip("a study starts f64 anew, and all that is compiled in f32 would be lost")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Bench, "ready", lambda self, scene, worlds: compiled(scene, worlds, scene.capacity()))
        patch.setattr(Bench, "close", lambda self: None)
        yield


@pytest.fixture
def own(monkeypatch):
    """A bench keeps what it has made, as it does outside of tests."""
    monkeypatch.setattr(Bench, "ready", READY)
