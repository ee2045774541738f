"""Studies of several scenes share their compiled simulations."""

import os

import pytest

from tests.scenes import compiled
from tisim.accuracy.timing import SimulationCache

READY = SimulationCache.compiled


@pytest.fixture(autouse=True, scope="session")
def shared():
    """A simulation for each structure, number of worlds and capacity, kept for all tests here."""
    if os.environ.get("TISIM_TEST_PRECISION", "f64") != "f64":
        pytest.skip("a study starts f64 anew, and all that is compiled in f32 would be lost")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            SimulationCache, "compiled", lambda self, scene, worlds: compiled(scene, worlds, scene.capacity())
        )
        patch.setattr(SimulationCache, "close", lambda self: None)
        yield


@pytest.fixture
def own(monkeypatch):
    """Restore the cache that keeps its own simulations, as outside of tests."""
    monkeypatch.setattr(SimulationCache, "compiled", READY)
