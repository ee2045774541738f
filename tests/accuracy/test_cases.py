"""The quantities that the cases compare in a study."""

import numpy as np
import pytest

from tests.scenes import simulate
from tisim import Box, Particles
from tisim.accuracy.quantity import estimate, truth_in_closed_form
from tisim.cases.agglomeration import scene as agglomeration
from tisim.cases.blast import scene as blast
from tisim.cases.case import every
from tisim.cases.vibration import scene as vibration
from tisim.sources import ElectricField


@pytest.mark.parametrize(
    "name",
    [
        # The start of a packed filter is a packing and its field, which take long.
        pytest.param(name, marks=pytest.mark.slow if name == "packed_filter" else ())
        for name, case in sorted(every().items())
        if case.quantities
    ],
)
def test_every_size_of_every_case_names_its_quantities(name):
    case = every()[name]
    for size in case.sizes:
        quantities = case.quantities(case.scene(size, 0))
        assert quantities
        assert len({quantity.random for quantity in quantities}) == 1
        assert len({quantity.name for quantity in quantities}) == len(quantities)


def test_paths_that_are_chaotic_are_not_compared():
    assert [q.random for q in every()["blast"].quantities(blast.scene())] == [False]
    assert [q.random for q in every()["blast"].quantities(blast.scene(contact=True))] == [True]
    assert [q.random for q in every()["agglomeration"].quantities(agglomeration.scene_for("small", 0))] == [
        True
    ]


@pytest.mark.long
def test_the_array_follows_its_closed_form():
    """Both quantities, the positions and the centre of the array, agree with their closed forms."""
    scene = vibration.scene(near_field="none", sites=2, duration=0.004)
    positions, centre = every()["vibration"].quantities(scene)
    (result,) = simulate([scene], capacity=8)
    for quantity in (positions, centre):
        truth = truth_in_closed_form(quantity, result)
        error, off = estimate(quantity, [result]).error(truth.estimate, truth.size)
        assert error < 1e-5
        assert off == 0.0
    assert truth.estimate.value[2] == 0.0
    assert np.linalg.norm(truth.estimate.value) > 1e-5


def test_a_closed_form_is_used_only_if_it_holds():
    def closed_forms(scene):
        return [q.exact is not None for q in every()["vibration"].quantities(scene)]

    assert closed_forms(vibration.scene(near_field="none")) == [True, True]
    assert closed_forms(vibration.scene()) == [False, True]
    for change in (
        {"effects.electric_field.constant": [1.0, 0.0, 0.0]},
        {"effects.electric_field.amplitude": [0.1, 0.1, 0.0]},
        {"effects.electric_field.begin": 1e-3},
        {"effects.magnetic_field.begin": 1e-3},
        {"effects.electric_field.end": 1e-3},
        {"effects.magnetic_field.end": 1e-3},
        {"effects.magnetic_field.constant": [1.0, 0.0, 1.0]},
        {"effects.tether.stiffness": [0.5, 0.0, 0.5]},
        {"particles.mean_velocity": [1.0, 0.0, 0.0]},
        {"particles.deviation": [0.0, 1e-3, 0.0]},
    ):
        assert closed_forms(vibration.scene().replace(change)) == [False, False], change
    rest = vibration.scene(near_field="none", sites=2)
    arrays = rest.particles.arrays(rest.domain, 0)
    for change, holds in (
        ({}, True),
        ({"charge": np.repeat([1.0, 2.0], 4)}, False),
        ({"mass": np.repeat([1.0, 2.0], 4)}, False),
        ({"anchor": arrays["position"] + 1e-3}, False),
    ):
        values = {**arrays, **change}
        core = {name: values.pop(name) for name in ("position", "velocity", "radius", "mass")}
        start = Particles(**core, quantities=values)
        assert closed_forms(rest.model_copy(update={"particles": start})) == [holds, holds], change
    around = Box(low=(-1.0,) * 3, high=(1.0,) * 3)
    assert closed_forms(rest.model_copy(update={"domain": around})) == [False, False]
    bare = vibration.scene().model_copy(update={"effects": (ElectricField(),)})
    assert closed_forms(bare) == [False, False]
