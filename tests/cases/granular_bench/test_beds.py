"""Evaluation of draw-down tests: Beverloo's law, the heap, the table and the figure; and a few runs."""

from types import SimpleNamespace

import numpy as np
import pytest

import tisim
from tisim.analysis import beverloo_rate
from tisim.cases.granular_bench.beds import (
    PACKED,
    VALUES,
    Bed,
    bed_figure,
    beverloo_constants,
    beverloo_fit,
    table,
)
from tisim.cases.granular_bench.measures import discharge, floor, heap, repose
from tisim.cases.granular_bench.problem import problem
from tisim.cases.granular_bench.scene import DENSITY, DIAMETER, NATURAL, SEARCH_SETTINGS, STEADY_PART, scene
from tisim.optimize.settings import Settings, proposed

STARTS = 4


def cone(degrees, rate=0.1, closed=None):
    """A result with a heap of known slope on the disc, grains in the silo and one falling grain. The silo
    discharges at ``rate`` (kg/s), and is clogged for the last part ``closed`` of the run."""
    made = scene(number=10)
    low, slope = -8 * DIAMETER, np.tan(np.radians(degrees))
    side = np.arange(-8 * DIAMETER, 8 * DIAMETER, 0.4 * DIAMETER)
    sites = np.stack(np.meshgrid(side, side, np.arange(0.0, 8 * DIAMETER, 0.4 * DIAMETER)), -1).reshape(-1, 3)
    inside = sites[sites[:, 2] + slope * np.hypot(*sites[:, :2].T) < 7 * DIAMETER * slope]
    # The first of them falls, high above the heap.
    other = [
        [0.0, 0.0, low + 6 * DIAMETER],
        [0.0, 0.0, DIAMETER],
        [0.0, 0.0, -DIAMETER],
        [0.1, 0.0, low - DIAMETER],
    ]
    position = np.vstack([inside + np.array([0.0, 0.0, low + DIAMETER / 2]), other])
    velocity = np.zeros_like(position)
    velocity[-4] = [0.0, 0.0, -0.3]
    state = {
        "position": position,
        "velocity": velocity,
        "radius": np.full(len(position), DIAMETER / 2),
    }
    begin, end = (part * 10 * DENSITY * np.pi / 6 * DIAMETER**3 for part in STEADY_PART)
    passed, first = (end, 0.1) if closed is None else ((begin + end) / 2, 0.0)
    if closed is not None and rate > 0:
        first = (1 - closed) * made.duration - (passed - begin) / rate
    measures = {
        "passage_rate": rate, "passed_mass": passed, "passage_begin_mass": begin, "passage_begin_time": first,
    }  # fmt: skip
    return SimpleNamespace(scene=made, state=state, time=1.0, measures=measures)


def test_the_heap_lies_on_the_disc_and_has_its_slope():
    result = cone(25.0)
    assert floor(result) == pytest.approx(-0.04)
    assert heap(result).sum() == len(result.state["radius"]) - 4
    for degrees in (20.0, 25.0, 30.0):
        assert repose(cone(degrees)) == pytest.approx(degrees, abs=1.5)
    nothing = SimpleNamespace(
        scene=result.scene, state={name: values[-4:] for name, values in result.state.items()}
    )
    assert np.isnan(repose(nothing))


def test_beverloos_law_is_recovered():
    outlets = np.array([4.0, 6.0, 9.0])
    rates = np.array([
        beverloo_rate(d * DIAMETER, DIAMETER, PACKED * DENSITY, discharge=0.61, empty=1.3) for d in outlets
    ])  # fmt: skip
    assert beverloo_fit(outlets, rates) == pytest.approx((0.61, 1.3), rel=1e-9)


def test_the_interval_of_beverloos_law_is_the_spread_over_starts():
    """Clogged silos are left out of the fit of their start, also if they flowed at first."""

    def bed(d, closed):
        law = [beverloo_rate(d * DIAMETER, DIAMETER, PACKED * DENSITY, discharge=c) for c in (0.5, 0.7)]
        return Bed("outlet", d, [cone(25.0, law[0], closed), cone(25.0, law[1])])

    found = [bed(d, closed) for d, closed in ((4.0, 1.0), (5.0, 0.2), (6.0, 0.05), (8.0, None))]
    assert [one.flowing for one in found] == [1, 1, 2, 2]
    constant, k = beverloo_constants(found)
    assert (constant.value, constant.half) == pytest.approx((0.6, 1.2706), rel=1e-4)
    assert (k.value, k.half) == pytest.approx((1.4, 0.0), abs=1e-9)
    assert found[0].mean_rate().value == found[0].rates[1]
    # A fit needs at least two outlets.
    assert beverloo_constants(found[1:3])[0].value == pytest.approx(0.7)
    closed = Bed("outlet", 3.0, [cone(25.0, 0.0), cone(25.0, 0.0, 0.5)])
    assert np.isnan([closed.mean_rate().value, beverloo_constants([closed])[0].value]).all()


@pytest.mark.long
def test_table_and_figure_have_each_bed():
    found = [
        Bed(what, value, [cone(20.0 + 5 * k, 0.01 * (k + 1) * part) for part in (0.9, 1.1)])
        for what, values in VALUES.items() for k, value in enumerate(values)
    ]  # fmt: skip
    rows = table(found).splitlines()
    assert len(rows) == 1 + len(found)
    assert rows[0].startswith("varied,value,angle_of_repose_degrees,angle_of_repose_degrees_95,discharge")
    # The interval of 0.009 and 0.011 is Student's 12.7 for two values, times 0.001.
    name, *first = rows[1].split(",")
    assert name == "friction"
    assert [float(x) for x in first[2:5]] == pytest.approx([0.0, 0.01, 0.012706], abs=1e-6)
    assert first[-1] == "2"
    figure = bed_figure(found)
    # The silo is drawn above the disc, with their diameters.
    picture = figure.axes[0].images[0]
    covered = picture.get_array()[..., 3] > 0.5
    left, right, _, _ = picture.get_extent()
    unit = (right - left) / covered.shape[1] / DIAMETER
    silo = np.flatnonzero(covered[covered.shape[0] // 2 + 50 :].any(axis=0))
    assert (np.ptp(silo) + 1) * unit == pytest.approx(12.0, rel=1e-2)
    assert covered.sum(axis=1).max() * unit == pytest.approx(16.0, rel=1e-2)
    angles, law = figure.axes[2], figure.axes[5]
    drawn = [np.asarray(axis.containers[0].lines[0].get_ydata(), float) for axis in (angles, law)]
    np.testing.assert_allclose(drawn[0], [one.angle.value for one in found[:4]])
    np.testing.assert_allclose(drawn[1], [(one.rates**0.4).mean() for one in found[-5:]])


def test_settings_of_the_search_are_sound():
    assert isinstance(Settings(**proposed(problem(), SEARCH_SETTINGS, None)), Settings)


@pytest.mark.slow
def test_rough_grains_make_a_steeper_heap_and_flow_more_slowly():
    """Draw-down tests with three kinds of grains, from four starts each, whose rates differ by a tenth.

    The discharge rate is near Beverloo's law. The default case has an angle of repose between glass beads and
    sand."""
    smooth_grains = {"friction": 0.1, "rolling_friction": 0.0, "restitution": 0.5}
    rough_grains = {"friction": 0.8, "rolling_friction": 0.4, "restitution": 0.5}
    results = tisim.run([
        scene(design, seed) for design in (NATURAL, smooth_grains, rough_grains) for seed in range(STARTS)
    ])  # fmt: skip
    assert all(result.status.ok for result in results)
    rates, angles = (
        np.reshape([measure(result) for result in results], (3, STARTS)) for measure in (discharge, repose)
    )
    law = beverloo_rate(7 * DIAMETER, DIAMETER, PACKED * DENSITY)
    usual, smooth, rough = rates.mean(axis=1)
    assert 0.5 * law < rough < usual < 0.9 * smooth < 2 * law
    usual, smooth, rough = angles
    assert ((usual > 18) & (usual < 32)).all()
    assert (rough > usual).all()
    # Without rolling friction hardly any grains stay on the disc.
    assert (rough > 8).all()
    kept = np.reshape([heap(result).sum() for result in results], (3, STARTS))
    assert (kept[1] < 0.3 * kept[2]).all()
