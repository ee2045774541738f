"""Snapshots of the whole state, from which a failed world is run again."""

import time
from types import SimpleNamespace

import numpy as np

from tisim.engine import replay


def test_slow_snapshots_are_made_rarely(monkeypatch):
    """A snapshot of a million grains takes seconds, and would otherwise take most of the time."""
    made = []

    def image():
        made.append(time.sleep(0.02))
        return {"underway": np.zeros(1)}

    monkeypatch.setattr(replay, "EVERY", 0.0)
    one = replay.Replay(SimpleNamespace(s=SimpleNamespace(image=image)), None)
    began = time.perf_counter()
    while time.perf_counter() - began < 0.3:
        one.save_image()
    assert len(made) == 1
