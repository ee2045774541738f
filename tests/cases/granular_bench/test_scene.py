"""The bed that ``tisim cost`` softens: its quantities for known positions, and the effect of softening."""

from types import SimpleNamespace

import numpy as np
import pytest

import tisim
from tisim.cases.common.runs import overlap
from tisim.cases.granular_bench.measures import centre_height, quantities, side_load
from tisim.cases.granular_bench.scene import bed, impact_time, linear_stiffness, scene_for


def test_quantities_of_a_bed():
    position = np.array([[3e-3, 0.0, 1e-3], [0.0, -3e-3, 3e-3], [0.0, 3e-3, 3e-3], [2.5e-3, 2.8e-3, 3e-3]])
    loads = np.zeros((4, 6))
    # Two grains are pushed inwards by 2 N and 3 N; forces along the side do not count.
    loads[0, :3], loads[1, :3], loads[3, 2] = [-2.0, 7.0, 1.0], [0.0, 3.0, 0.0], 9.0
    state = {
        "position": position, "radius": np.full(4, 1.3e-3), "mass": np.array([1.0, 1.0, 1.0, 2.0]),
        "side_loads": loads,
    }  # fmt: skip
    result = SimpleNamespace(scene=bed(), state=state, time=0.0)
    assert centre_height(result) == pytest.approx(2.6e-3)
    assert side_load(result) == pytest.approx(5.0 / (5.0 * 9.80665))
    apart = np.hypot(2.5e-3, 0.2e-3)
    assert overlap(result) == pytest.approx((2.6e-3 - apart) / 1.3e-3)


def test_the_bed_is_stiff_and_its_steps_are_parts_of_an_impact():
    scene = scene_for("bed", 3)
    assert scene.digest() == bed(seed=3).digest()
    assert scene.stepper.control.dt == pytest.approx(impact_time(2e8) / 20, rel=5e-3)
    assert impact_time(2e8 / 1000) == pytest.approx(1000**0.4 * impact_time(2e8), rel=1e-12)
    # Half a period of Hooke's spring with this stiffness and half a grain's mass has the same duration.
    mass = 2500 * np.pi / 6 * 5e-3**3
    assert np.pi * np.sqrt(mass / 2 / linear_stiffness(2e8)) == pytest.approx(impact_time(2e8))
    assert [one.name for one in quantities(scene)] == [
        "height of the bed",
        "load on the side",
        "largest overlap",
    ]
    assert [one.name for one in quantities(scene_for("default", 0))] == ["discharge rate", "angle of repose"]


@pytest.mark.slow
def test_overlaps_in_a_bed_softened_a_hundredfold_grow_by_hertz():
    """The factor is 100^(2/3) at equal loads, roughly, as a mean over six starts."""
    results = tisim.run([bed(seed=seed, young=young) for young in (2e8, 2e6) for seed in range(6)])
    assert all(result.status.ok for result in results)
    overlaps = np.array([overlap(result) for result in results]).reshape(2, 6).mean(axis=1)
    assert overlaps[1] / overlaps[0] == pytest.approx(100 ** (2 / 3), rel=0.4)
    loads = np.array([side_load(result) for result in results]).reshape(2, 6).mean(axis=1)
    assert (loads > 0.3).all()
    assert loads[1] == pytest.approx(loads[0], rel=0.4)
