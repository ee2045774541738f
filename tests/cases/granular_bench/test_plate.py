"""Single grains on a plate beside the silo, which measure restitution and friction."""

import numpy as np
import pytest

import tisim
from tests.scenes import by_id
from tisim.cases.granular_bench.plate import DRAWN, DROPPED, rebound, scene_with_plate, sliding
from tisim.cases.granular_bench.scene import scene
from tisim.effects import Walls

FEW = {"number": 250, "silo": 4.0, "outlet": 5.0, "duration": 0.2}
DESIGNS = (
    {"friction": 0.3, "rolling_friction": 0.1, "restitution": 0.9},
    {"friction": 1.0, "rolling_friction": 0.4, "restitution": 0.2},
)


def test_the_plate_does_not_affect_the_draw_down_test():
    test, both = scene(seed=3, **FEW), scene_with_plate(seed=3, **FEW)
    alone, beside = (one.particles.arrays(one.domain, 3) for one in (test, both))
    for name in ("position", "velocity", "radius", "mass"):
        np.testing.assert_array_equal(beside[name][:-2], alone[name])
    assert [*beside["group"]] == [0] * 250 + [DRAWN, DROPPED]
    assert both.materials == test.materials
    heap, plate = next(one for one in both.effects if isinstance(one, Walls)).discs
    apart = plate.centre[0] - heap.radius
    assert apart - plate.radius > 0.02
    inside = np.hypot(*(beside["position"][-2:, :2] - plate.centre[:2]).T)
    assert (inside < plate.radius).all()


@pytest.mark.slow
def test_a_grain_rebounds_by_its_restitution_and_a_block_slides_at_its_friction():
    """The root of the ratio of heights is e, up to the effect of the weight during the soft contact. The
    angle of sliding is arctan mu."""
    results = tisim.run([scene_with_plate(design, **FEW) for design in DESIGNS])
    for design, result in zip(DESIGNS, results, strict=True):
        assert result.status.ok
        assert np.sqrt(rebound(result)) == pytest.approx(design["restitution"], abs=0.01)
        assert np.tan(np.radians(sliding(result))) == pytest.approx(design["friction"], rel=1e-6)
        # The block is drawn to the end of its way without rotation.
        way = by_id(result)["position"][-2] - result.start["position"][-2]
        np.testing.assert_allclose(way, [0.1, 0.0, 0.0], atol=1e-9)
