"""The inverse problem: scenes of designs, objectives, and designs that are not allowed."""

import numpy as np
import pytest

import tisim
from tests.cases.valve.states import result_of
from tisim import InputError
from tisim.cases.case import every
from tisim.cases.common.runs import OTHER_STARTS, sound
from tisim.cases.valve import published
from tisim.cases.valve.duct import open_flow
from tisim.cases.valve.measures import duct_of, pressure_at_rest, unhindered_rate
from tisim.cases.valve.problem import (
    BOUND,
    MISSED,
    MOST_ACROSS,
    STRONGEST,
    arrested,
    flux,
    part_left,
    problem,
    volume_rate,
    width,
)  # fmt: skip
from tisim.cases.valve.runs import ARRESTED
from tisim.optimize.settings import Settings, proposed
from tisim.sources import MagneticField

DESIGN = {"throat": 200e-6, "diameter": 40e-6, "flux": 0.15}


def moving(made, part):
    """A result of a scene in which grains flow at the given part of the unhindered rate."""
    mass = made.particles.masses(0)
    speed = part * unhindered_rate(made, mass.sum()) * duct_of(made).length / mass.sum()
    n = len(mass)
    return result_of(made, np.zeros((n, 3)), [[0, 0, speed]] * n, radius=20e-6, mass=mass)


def test_a_design_makes_its_valve():
    made = problem().scene(DESIGN, 3)
    assert made.seed == 3
    result = moving(made, 0.5)
    assert (flux(result), width(result)) == (0.15, pytest.approx(5.0))
    assert part_left(result) == pytest.approx(0.5)
    (field,) = [effect for effect in made.effects if isinstance(effect, MagneticField)]
    assert field.begin == 0.0
    # The pressure of the run is 100 kPa over 0.9 mm, applied to the 0.352 mm of the duct.
    assert volume_rate(made) == pytest.approx(open_flow(duct_of(made), 100e3 * 0.352 / 0.9, 0.345))
    assert pressure_at_rest(made) == pytest.approx(100e3 * 0.352 / 0.9, rel=2e-3)
    wider = problem().scene({**DESIGN, "throat": 260e-6}, 0)
    assert volume_rate(wider) > 1.5 * volume_rate(made)


@pytest.mark.parametrize("part", [0.9 * ARRESTED, 1.1 * ARRESTED])
def test_fields_count_if_they_arrest_and_widths_if_they_do_not(part):
    """A start that misses counts as so bad that one miss in four starts is worse than none."""
    jams = part < ARRESTED
    result = moving(problem().scene(DESIGN, 0), part)
    assert arrested(result) == jams
    field, let = (one.of(result) for one in problem(variant="front").objectives)
    assert (field, let) == ((0.15, volume_rate(result.scene)) if jams else (4 * STRONGEST, 0.0))
    assert problem(variant="field").objectives[0].of(result) == field
    never = problem(variant="never").objectives[0].of(result)
    assert never == pytest.approx(4 * 6 / 0.7 if jams else 5.0)


def test_one_of_four_starts_that_misses_is_worse_than_none():
    """The least mean field and constriction with one miss exceed the largest without a miss."""
    genes = {gene.name: gene for gene in problem(variant="front").genome.genes}
    weakest, narrowest = genes["flux"].low, genes["throat"].low / genes["diameter"].high
    assert (3 * weakest + MISSED * STRONGEST) / 4 > STRONGEST
    assert (3 * narrowest + MISSED * MOST_ACROSS) / 4 > MOST_ACROSS


def test_a_valve_with_an_open_flow_below_the_bound_is_refused():
    narrow, wide = ({**DESIGN, "throat": throat} for throat in (160e-6, 210e-6))
    assert volume_rate(problem(variant="front").scene(narrow, 0)) < BOUND
    assert volume_rate(problem(variant="field").scene(wide, 0)) >= BOUND
    with pytest.raises(InputError, match=r"open flow of the design must be at least .* m\^3/s; received"):
        problem(variant="field").scene(narrow, 0)


def test_only_the_small_valve_is_searched():
    with pytest.raises(InputError, match="size must be one of default for the inverse problem; received"):
        problem("l21_20")


def test_variants():
    assert problem(variant="never").scene({"throat": 200e-6, "diameter": 44e-6}, 0).effects[0].constant == (
        published.FLUX, 0.0, 0.0,
    )  # fmt: skip
    assert [one.maximise for one in problem(variant="front").objectives] == [False, True]
    assert not problem(variant="field").several


@pytest.mark.parametrize("name", ["valve", "mrf_shear"])
def test_every_variant_is_searched_with_the_population_of_the_case(name):
    case = every()[name]
    for variant in case.variants:
        made, search = case.inverse("default", variant)
        settings = Settings(**proposed(made, search, None))
        assert (settings.options.population, settings.options.first) == (8, 12)
        assert settings.generations == search["generations"]


@pytest.mark.slow
def test_a_valve_that_a_search_found_jams_from_other_starts_and_flows_in_a_weak_field():
    """The design of largest flow in docs/valve.md."""
    found = {"throat": 233.2e-6, "diameter": 41.33e-6, "flux": 0.3247}
    scenes = [
        problem().scene({**found, "flux": b}, OTHER_STARTS + k) for b in (0.3247, 0.02) for k in range(6)
    ]
    left = np.reshape([part_left(result) for result in sound(tisim.run(scenes))], (2, 6))
    assert left[0].mean() < ARRESTED
    assert left[1].min() > 0.5
