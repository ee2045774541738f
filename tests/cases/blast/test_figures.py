"""Pictures of a run of a blast."""

import numpy as np
import pytest

from tisim import Recording, run
from tisim.cases.blast.figures import SEQUENCE_FRAMES, BlastHistory, beside, pictures, table
from tisim.cases.blast.rest_figure import W_TAU, growth, rest_figure, rest_table, rested
from tisim.cases.blast.scene import scene
from tisim.io.reader import frames
from tisim.rendering.camera import USUAL_CAMERA


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
    np.testing.assert_array_equal(arrows.U, USUAL_CAMERA.project(last.arrays["velocity"])[:, 0])
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


@pytest.mark.long
def test_figure_and_table_of_the_blast_at_rest():
    """Half axes and turns are near their closed forms, and drawn; the path ends at 1/(1 + 2i)."""
    cloud, clouds = growth(60), rested(60)
    assert cloud.path[0] == 0
    assert cloud.path[-1] == pytest.approx(1 / (1 + 2j), abs=1e-3)
    rows = np.array([row.split(",") for row in rest_table(clouds).splitlines()[1:]], float)
    np.testing.assert_array_equal(rows[:, 0], W_TAU)
    np.testing.assert_allclose(rows[:, 1], rows[:, 4], rtol=0.1)
    np.testing.assert_allclose(rows[:, 2:4].mean(axis=1), rows[:, 5], rtol=0.1)
    np.testing.assert_allclose(rows[:, 6], rows[:, 7], atol=1e-3)
    assert rows[0, 2] > 2 * rows[-1, 2]
    grown, shapes, turned, paths = rest_figure(cloud, clouds).axes
    np.testing.assert_array_equal(grown.lines[0].get_ydata(), cloud.axes[:, 0])
    np.testing.assert_array_equal(shapes.lines[0].get_ydata(), rows[:, 1])
    np.testing.assert_allclose(turned.lines[0].get_ydata(), np.degrees(rows[:, 6]))
    np.testing.assert_array_equal(paths.lines[-1].get_xdata(), cloud.path.real)
