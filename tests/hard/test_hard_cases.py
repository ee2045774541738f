"""The hard cases of ``tisim hard``: every number is within its bound."""

import pytest

from tests.hard.judging import holds
from tisim.backend import runtime
from tisim.cases.hard.hard_case import hard_cases

CASES = [case for cases in hard_cases().values() for case in cases]
SLOW = (
    *("grazing_spheres", "released_overlaps", "beyond_the_speed_of_waves", "moments_near_divergence"),
    *("magnets_that_snap_together", "antiparallel_magnets", "collapse_of_soft_magnets", "mixture_of_grains"),
    *("restitution_of_unlike_masses", "bond_or_rebound", "threshold_of_bonding", "all_grains_merge"),
    *("grains_that_merge_and_break", "fragments_fill_every_slot", "thousand_overlapping_spheres"),
    *("column_at_rest", "friction_at_its_limit", "impacts_from_nanometres_to_kilometres"),
    *("far_from_the_origin", "colloids_of_nanometres", "electrons_from_a_nanometre"),
    *("zero_field_to_saturation", "time_of_a_million_steps"),
    *("fibres_that_touch_and_overlap", "absolute_zero_to_a_billion_kelvin"),
    *("random_driven_charges", "random_damped_grains", "closed_inlet"),
    *("one_body", "coincident_bodies", "jammed_start", "sizes_one_to_ten", "near_cubes", "needles"),
)
"""Cases that compile large structures, or several, or whose laws other quick tests compile."""

pytestmark = pytest.mark.long


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=[pytest.mark.slow] * (case.name in SLOW), id=case.name) for case in CASES],
)
def test_all_numbers_are_within_their_bounds(case):
    if runtime.current().precision != "f64":
        pytest.skip("the bounds are of double precision")
    holds(case)
