"""The law that is named when a world stops."""

import numpy as np
import pytest

from tests.scenes import fixed
from tisim import Clump, Particles, Scene, run
from tisim.backend.taichi import ti
from tisim.effects import PairForce, RigidClumps


class Apart(PairForce):
    """NaN if surfaces overlap."""

    short_ranged = True

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        gap = distance - s.radius[w, i] - s.radius[w, j]
        return ti.select(gap < 0.0, ti.math.nan, 0.0) * separation


class Near(PairForce):
    """NaN if centres are far apart."""

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return ti.select(distance > 8.0, ti.math.nan, 0.0) * separation


@pytest.mark.slow
def test_a_law_excluded_within_a_clump_is_not_named():
    clump = Clump(centres=[(0, 0, 0), (1.0, 0, 0)], radii=[1.0], density=1.0)
    sphere = Particles(position=[[7.0, 0, 0]], velocity=[[1.0, 0, 0]], radius=1.0, mass=1.0)
    made = Scene(
        particles=Particles.of_clumps(clump, [(0.5, 0, 0)], spheres=sphere),
        effects=(RigidClumps(), Apart(), Near()),
        stepper=fixed(0.1),
        duration=3.0,
    )
    result = run(made)
    assert not result.status.ok
    assert "a quantity is not finite, by effects.near, at particle 0" in result.status.reason
    assert 0.9 < result.time < 2.1
    assert np.isfinite(result.state["position"]).all()
