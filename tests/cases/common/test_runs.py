"""Checks of results: no failed run, and the largest overlap of grains."""

from types import SimpleNamespace

import numpy as np
import pytest

from tisim import Box, RunError, ShearedBox
from tisim.cases.common.runs import overlap, sound
from tisim.domains.domain import Open
from tisim.engine.result import Status


def result_with(*status):
    return SimpleNamespace(scene=SimpleNamespace(name="a scene"), status=Status(*status))


def test_results_of_worlds_that_end_or_continue():
    fine = [result_with(True, "as made"), result_with(False, "running")]
    assert sound(fine) == fine
    with pytest.raises(RunError, match="a scene: a force is not a number"):
        sound([*fine, result_with(False, "a force is not a number")])


@pytest.mark.parametrize(("periodic", "deepest"), [(True, 0.5), (False, 0.25)])
def test_the_largest_overlap_is_over_the_mean_radius_and_across_faces(periodic, deepest):
    """Grains of radius 1 and 3 overlap by 0.5, and by 1 across the face of a periodic box."""
    box = Box(low=(0.0,) * 3, high=(6.5, 9.0, 9.0), periodic=(periodic, False, False))
    state = {"position": np.array([[0.5, 4.0, 4.0], [4.0, 4.0, 4.0]]), "radius": np.array([1.0, 3.0])}
    result = SimpleNamespace(scene=SimpleNamespace(domain=box), state=state, time=0.0)
    assert overlap(result) == pytest.approx(deepest)
    result.scene.domain = Open()
    assert overlap(result) == pytest.approx(0.25)


@pytest.mark.parametrize(("time", "deepest"), [(0.0, 0.5), (1.0, 0.0)])
def test_images_in_a_sheared_box_use_its_final_shear(time, deepest):
    box = ShearedBox(low=(0.0,) * 3, high=(8.0, 6.0, 8.0), rate=0.5)
    state = {"position": np.array([[4.0, 0.5, 4.0], [4.0, 5.0, 4.0]]), "radius": np.ones(2)}
    result = SimpleNamespace(scene=SimpleNamespace(domain=box), state=state, time=time)
    assert overlap(result) == pytest.approx(deepest)
