"""The inverse problem: scenes of designs, objectives, and designs that are not allowed."""

from types import SimpleNamespace

import numpy as np
import pytest

import tisim
from tisim import InputError
from tisim.cases.case import every
from tisim.cases.common.magnetorheological_fluid import RANDOM_PACKING, relative_viscosity
from tisim.cases.common.runs import OTHER_STARTS, sound
from tisim.cases.mrf_shear.measures import flux, shear_stress
from tisim.cases.mrf_shear.problem import BOUND, design_viscosity, off_state_viscosity, problem, viscosity
from tisim.cases.mrf_shear.published import OIL_VISCOSITY
from tisim.cases.mrf_shear.scene import LARGE_RADIUS, SMALL_RADIUS

DESIGN = {"small": 0.25, "fraction": 0.2, "flux": 0.5}


def test_small_grains_lower_the_viscosity_without_field():
    thick = off_state_viscosity(0.3, [1.0, 0.25], [1.0, 0.0])
    assert thick == pytest.approx(OIL_VISCOSITY * relative_viscosity(0.3, RANDOM_PACKING))
    assert off_state_viscosity(0.3, [1.0, 0.25], [0.67, 0.33]) < thick


def test_a_design_makes_its_fluid():
    made = problem().scene(DESIGN, 3)
    assert made.seed == 3
    result = SimpleNamespace(scene=made)
    assert flux(result) == 0.5
    expected = off_state_viscosity(0.2, (2 * LARGE_RADIUS, 2 * SMALL_RADIUS), (0.75, 0.25))
    assert viscosity(result) == pytest.approx(expected, rel=0.01)
    one_size = problem().scene({**DESIGN, "small": 0.0}, 0)
    assert viscosity(SimpleNamespace(scene=one_size)) == pytest.approx(
        off_state_viscosity(0.2, (1.0,), (1.0,)), rel=0.01
    )
    radius = made.particles.arrays(made.domain, 0)["radius"]
    assert set(np.unique(radius)) == {SMALL_RADIUS, LARGE_RADIUS}


def test_a_fluid_above_the_bound_of_viscosity_is_refused():
    thick = {"small": 0.0, "fraction": 0.33, "flux": 0.6}
    assert design_viscosity(0.0, 0.33) > BOUND > design_viscosity(0.25, 0.2)
    problem(variant="front").scene(thick, 0)
    with pytest.raises(InputError, match=r"viscosity of the design must be at most 0\.024 Pa s; received"):
        problem(variant="bounded").scene(thick, 0)


def test_objectives_of_each_variant():
    names = {one: [each.name for each in problem(variant=one).objectives] for one in ("front", "field")}
    assert names == {"front": ["stress", "viscosity"], "field": ["stress", "viscosity", "field"]}
    assert not problem(variant="bounded").several
    assert [each.maximise for each in problem(variant="field").objectives] == [True, False, False]
    with pytest.raises(InputError, match="size must be one of default for the inverse problem"):
        problem("polydisperse")
    _, settings = every()["mrf_shear"].inverse("default", None)
    assert settings["generations"] > 0


@pytest.mark.slow
def test_a_fluid_that_a_search_found_has_the_same_stress_from_other_starts():
    """A design of a front, in docs/mrf_shear.md; half its field gives a quarter of its stress, as B^2."""
    found = {"small": 0.0875, "fraction": 0.2736, "flux": 0.7874}
    fields = (found["flux"], found["flux"] / 2)
    scenes = [problem().scene({**found, "flux": b}, OTHER_STARTS + k) for b in fields for k in range(3)]
    strong, weak = np.reshape([shear_stress(result) for result in sound(tisim.run(scenes))], (2, 3)).mean(
        axis=1
    )
    assert 70e3 < strong < 115e3
    assert 2.5 < strong / weak < 6.5
