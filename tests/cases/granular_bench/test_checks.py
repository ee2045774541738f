"""Tests of single contacts: a few impacts as one batch, and all checks among the slow tests."""

from types import SimpleNamespace

import numpy as np
import pytest

from tisim.cases.granular_bench import checks, particle_tests
from tisim.cases.granular_bench.checks import BOUND, check, rebounds
from tisim.cases.granular_bench.mindlin_impact import oblique_impacts
from tisim.cases.granular_bench.shear_cell import expected_ratio


@pytest.mark.slow
def test_impacts_agree_with_the_law_in_numpy_and_with_rigid_spheres():
    """At least one impact of each test of Chung and Ooi, as one batch."""
    tests = particle_tests.TESTS
    some = [tests[3][1], tests[4][4], tests[4][12], tests[5][16], tests[6][5], tests[7][20], tests[8][30]]
    found = rebounds([*tests[1], *tests[2], *some])
    for one in found:
        assert one.restitution == pytest.approx(one.impact.restitution, abs=BOUND)
    velocity, spin = oblique_impacts([one.impact for one in found], 2000)
    for k, one in enumerate(found):
        impact = one.impact
        assert one.velocity[0] == pytest.approx(velocity[k], abs=BOUND * impact.approach)
        assert one.spin[1] * impact.radius == pytest.approx(
            spin[k] * impact.radius, abs=BOUND * impact.approach
        )
    sliding = found[6]
    loss = sliding.impact.sideways - sliding.velocity[0]
    assert loss == pytest.approx(0.092 * 1.98 * sliding.impact.speed, rel=1e-3)
    assert np.abs(sliding.velocity[1]) == 0


@pytest.mark.parametrize(("law", "right"), [(expected_ratio, True), (lambda number: 0.465, False)])
def test_one_stress_ratio_for_all_flows_is_not_accepted_for_glass_beads(monkeypatch, law, right):
    """It is nevertheless within the bounds for each single flow."""
    beds = [SimpleNamespace(inertial_number=n, ratio=float(law(n))) for n in (0.28, 0.11, 0.05)]
    monkeypatch.setattr(checks, "sheared_beds", lambda fractions: beds)
    *each, rise = checks.shear_checks()
    assert all(item.ok for item in each)
    assert rise.ok == right


@pytest.mark.slow
def test_all_checks_pass():
    wrong = [(item.name, *item.cells) for item in check() if not item.ok]
    assert not wrong
