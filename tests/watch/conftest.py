"""Runs that are written frame by frame, and a browser."""

import numpy as np
import pytest

from tests.report.conftest import scene
from tisim.engine.result import Result, Status
from tisim.io.reader import Frame
from tisim.io.run_folder import write_result
from tisim.io.trajectory import Trajectory, recorded_fields
from tisim.watch.budget import Budget


class Growing:
    """A run of particles that drift along x, 1 mm a frame, written when a test asks for it."""

    def __init__(self, folder, n=40, name="growing", **settings):
        self.folder, self.n, self.count = folder, n, 0
        self.scene = scene(n, name=name, **settings)
        self.start = np.random.default_rng(1).uniform(-0.009, 0.009, (n, 3))
        self.file = Trajectory(folder / "trajectory.h5", [self.scene])

    def arrays(self, k):
        place = np.mod(self.start + [1e-3 * k, 0, 0] + 0.01, 0.02) - 0.01
        given = {"id": np.arange(self.n), "position": place, "velocity": np.full((self.n, 3), 0.1 * k)}
        fields = recorded_fields(self.scene)
        usual = {
            one.name: np.full(one.shape(self.n), 1e-3 if one.name in ("radius", "mass") else 0.0)
            for one in fields
        }
        return {name: np.asarray(given.get(name, values)) for name, values in usual.items()}

    def write(self, frames=1):
        for _ in range(frames):
            self.file.write(0, Frame(0.01 * self.count, self.count, self.arrays(self.count)))
            self.count += 1

    def end(self, status=None):
        self.file.close()
        last = self.count - 1
        ended = status or Status(True, "reached its end")
        counts = {"steps": last, "particle_steps": self.n * last}
        given = Result(
            self.scene, self.arrays(last), self.arrays(0), 0.01 * last, counts, ended, 0.1, {"device": "cpu"}
        )
        write_result(given, self.folder / "result.h5")


@pytest.fixture
def growing(tmp_path):
    made = []

    def begin(folder=tmp_path, **settings):
        made.append(Growing(folder, **settings))
        return made[-1]

    yield begin
    for one in made:
        one.file.close()


class Clock:
    """Times that a test sets, s."""

    def __init__(self):
        self.now = self.used = 0.0

    def __call__(self):
        return self.now

    def processor(self):
        return self.used


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def unlimited():
    """A budget that allows work at once."""
    return Budget(share=np.inf, credit=0.0)
