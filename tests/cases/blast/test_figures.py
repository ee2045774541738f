"""Pictures of a run of a blast."""

import numpy as np
import pytest

from tisim import Recording, run
from tisim.cases.blast.figures import SEQUENCE_FRAMES, BlastHistory, beside, pictures, table
from tisim.cases.blast.scene import scene
from tisim.io.reader import frames
from tisim.plotting.cloud import PROJECTION


@pytest.mark.slow
def test_pictures_of_a_run(tmp_path):
    path = tmp_path / "trajectory.h5"
    blast = scene(number=60, duration=0.06)
    run(blast, record=Recording(path, frames=3))
    with frames(path) as trajectory:
        assert pictures(trajectory) == {}
    run(blast, record=Recording(path, frames=24))
    with frames(path) as trajectory:
        figures, history = pictures(trajectory), BlastHistory.of(trajectory)
        last = trajectory[-1]
    assert len(figures["sequence.png"].axes) == SEQUENCE_FRAMES
    arrows = figures["velocities.png"].axes[-1].collections[0]
    np.testing.assert_array_equal(arrows.U, (last.arrays["velocity"] @ PROJECTION)[:, 0])
    left, right, *_ = figures["envelope.png"].axes
    np.testing.assert_array_equal(left.lines[0].get_ydata(), history.axes[:, 0])
    assert history.axes[-1, 0] > 1.1 * history.axes[0, 0]
    assert right.lines[0].get_linestyle() == "-"
    assert not BlastHistory(
        history.time, history.axes, history.touching, history.paths[::6], history.velocities[::6]
    ).dense(0)
    figure = beside({"default": history}, {"default": last})
    np.testing.assert_array_equal(figure.axes[1].lines[0].get_ydata(), history.axes[:, 0])
    assert len(table({"default": history}).splitlines()) == 1 + len(history.time)
