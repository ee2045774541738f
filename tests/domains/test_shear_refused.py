"""Parts that cannot be combined with a box in simple shear."""

import numpy as np
import pytest

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.effects.contact.sheared import DT, MATERIALS, crowd
from tests.scenes import scene
from tests.throwaway import Trap
from tisim import InputError, ShearedBox
from tisim.accuracy.sweep import methods
from tisim.effects import Gravity, Impact, StokesDrag, Walls
from tisim.geometry import Plane
from tisim.operators import PeakDisplacement
from tisim.sources import ElectricField, UniformFlow
from tisim.steppers import ApproachTime, ErrorControl, Trapezoid, Verlet

BOX = {"low": (0, 0, 0), "high": (1, 1, 1), "rate": 1.0}
IMPLICIT = Trapezoid(control=ErrorControl())
WRONG = {
    "axes": (
        {"gradient": "x"},
        {},
        r"sheared_box.gradient must be another axis than sheared_box.flow; rec",
    ),
    "open": ({"periodic": (True, False, True)}, {}, r"sheared_box.periodic must be true along flow and grad"),
    "images": ({"images": False}, {}, r"sheared_box.images must be true; received False"),
    "stepper": (
        {},
        {"stepper": IMPLICIT},
        r"stepper must be one that follows shear, such as verlet or boris",
    ),
    "control": (
        {},
        {"stepper": Verlet(control=ApproachTime()), "effects": ()},
        r"stepper.control must be one that does not depend on pairs, such as fixed_step, in a sheared_box",
    ),
    "sudden": (
        {},
        {"effects": (Impact(hardness=1.0),)},
        r"effects.impact must be a force, not a pair event",
    ),
    "walls": (
        {},
        {"effects": (HERTZ_MINDLIN, Walls(planes=[Plane()]))},
        r"effects.walls must be the same at all places \(homogeneous\), as gravity is, in a she",
    ),
    "drag": (
        {},
        {"effects": (StokesDrag(viscosity=1e-3),)},
        r"effects.stokes_drag must be the same at all places",
    ),
    "flow": (
        {},
        {"effects": (UniformFlow(velocity=(0.0, 0.0, 0.0)),)},
        r"effects.uniform_flow must be the same at all places",
    ),
    "a force that does not say so": (
        {},
        {"effects": (Trap(stiffness=1.0),)},
        r"effects.trap must be the same at all places",
    ),
    "an operator": (
        {},
        {"effects": (PeakDisplacement(),)},
        r"effects.peak_displacement must be the same at all places",
    ),
}


@pytest.mark.parametrize(("box", "more", "message"), WRONG.values(), ids=WRONG)
def test_parts_incompatible_with_shear_are_refused(box, more, message):
    settings = {
        "effects": (HERTZ_MINDLIN,),
        "materials": MATERIALS,
        "quantities": {"spin": np.zeros((1, 3))},
        **more,
    }
    with pytest.raises(InputError, match=message):
        scene([[0, 0, 0]], [[0, 0, 0]], domain=ShearedBox(**{**BOX, **box}), **settings)


def test_uniform_fields_are_accepted_with_shear():
    scene([[0, 0, 0]], [[0, 0, 0]], (Gravity(), ElectricField()), domain=ShearedBox(**BOX))


def test_a_cost_study_tries_no_stepper_without_shear(rng):
    made = crowd(rng)
    tried = {type(one.base.stepper) for one in methods(made, DT, 1.0, (0.0,), (("f64", "strict"),), 1)}
    assert tried == {Verlet}
