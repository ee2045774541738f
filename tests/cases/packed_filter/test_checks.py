"""The checks of packed_filter: 23 minutes of one core of an AMD EPYC (Zen 4)."""

import pytest

from tisim.cases.packed_filter import CASE
from tisim.cases.packed_filter.checks import of_colloids, of_magnetisation
from tisim.cases.packed_filter.scene import filter_of

pytestmark = pytest.mark.long


@pytest.mark.slow
def test_the_claims_hold():
    for one in CASE.check():
        assert one.ok is not False, (one.name, *one.cells)


def test_energies_and_encounters_of_colloids():
    """m B / kT and Gamma are proportional to the volume of a colloid. The fractions of small colloids are
    those of the lognormal distribution."""
    found = {one.name: one.value for one in of_colloids(filter_of("small"))}
    energy = [value for name, value in found.items() if name.startswith("energy")]
    assert energy == pytest.approx([60.23 * (radius / 5.1) ** 3 for radius in (5.1, 2.0, 1.0)], rel=1e-3)
    coupling = [value for name, value in found.items() if name.startswith("coupling")]
    assert coupling[1] / coupling[0] == pytest.approx(8)
    # mu_0 m^2 / (2 pi d^3 k T) by hand, with m = 2.478e-19 A m^2 and d = 10.2 nm.
    assert coupling[0] == pytest.approx(2.81, rel=0.01)
    small, own = (value for name, value in found.items() if name.startswith("part"))
    # ln(2 / 4.735) / 0.3853 = -2.237 and ln(2 / 2.665) / 0.4513 = -0.636 standard deviations.
    assert small == pytest.approx(0.0127, abs=0.001)
    assert own == pytest.approx(0.25, abs=0.015)
    # (0.02 x 0.4 mm / (0.03 x 5.1 nm))^2
    assert found["steps of colloids that touch over those here"] == pytest.approx(2.734e9, rel=1e-3)
    assert found["time in which a colloid of B16's suspension meets another, s"] == pytest.approx(
        8.2e-3, rel=0.01
    )


@pytest.mark.slow
def test_near_neighbours_change_the_magnetisation_more():
    """Fibres at a solid fraction of 0.2 are twice as near to each other as at 0.025."""
    dense, dilute = (of_magnetisation(filter_of("small", fraction=part), 2).value for part in (0.2, 0.025))
    assert 0.08 < dense.value < 0.18
    assert dilute.value < 0.5 * dense.value
