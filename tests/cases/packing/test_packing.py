"""The case packing: its scenes, its table, its pictures."""

import pytest

from tisim import InputError, Recording, run
from tisim.cases.packing import CASE
from tisim.cases.packing.figures import pictures
from tisim.cases.packing.measures import measured
from tisim.cases.packing.scene import mixed, of_shape, rod
from tisim.io import run_folder
from tisim.io.reader import frames
from tisim.plotting.time_series import clouds


def test_sizes_of_a_mixture():
    size = mixed(1000, 3.0, 0.7, seed=1)
    assert (size**3).sum() == pytest.approx(1000)
    large = size > size.min() * 1.5
    assert size.max() / size.min() == pytest.approx(3.0)
    assert (size[large] ** 3).sum() / 1000 == pytest.approx(0.7, abs=0.01)


@pytest.mark.slow
def test_a_mixture_is_denser_than_equal_spheres():
    scenes = [
        of_shape(rod(1.0), "small", 1, number=120, attempts=100, method="original", sizes=sizes)
        for sizes in ((3.0, 0.7), None)
    ]
    dense, equal = (measured(result).fraction for result in run(scenes))
    assert dense > equal + 0.02


def test_the_pictures_of_a_run(tmp_path):
    """Bodies are drawn by their shapes, and bars count all of them; an ended packing lacks no frames."""
    scene = of_shape(rod(2.0), "small", 0, number=40, attempts=20, step=4.0)
    path = tmp_path / "trajectory.h5"
    rule = r"^frames must be replaced by every, the time between frames, as this run ends by .*; received 3$"
    with pytest.raises(InputError, match=rule):
        run(scene, record=Recording(path, frames=3))
    assert not path.exists()
    record = Recording(path, every=1e6)
    result = run(scene, record=record)
    with frames(record.path) as trajectory:
        assert trajectory.missing
    run_folder.write_result(result, tmp_path / "result.h5")
    for name in ("trajectory.h5", "result.h5"):
        with frames(tmp_path / name) as trajectory:
            assert not trajectory.missing
            figure = pictures(trajectory)["packing.png"]
            start, _end = clouds(trajectory).axes
    left, right = figure.axes
    assert left.images[0].get_array()[..., 3].max() == 1
    assert sum(bar.get_height() for bar in right.patches) == 40
    assert right.get_title(loc="left") == f"(b) packing fraction {measured(result).fraction:.3f}"
    (drawn,) = start.images
    assert 0.1 < drawn.get_array()[..., 3].mean() < 0.9
    assert start.get_title(loc="left").startswith("(a) start, t = 0 s: 40 bodies, mean bounding radius 1 m")


@pytest.mark.slow
def test_the_claims_hold():
    for one in CASE.check():
        assert one.ok is not False, (one.name, *one.cells)
