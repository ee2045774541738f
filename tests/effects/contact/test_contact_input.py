"""Contact: invalid scenes are refused by name."""

import pytest

from tests.scenes import scene
from tisim import InputError
from tisim.effects import Contact, ContactBond, ContactDissipation, ContactFriction, ContactSoftening, Hertz
from tisim.steppers import Verlet

WRONG = {
    "contact.stiffness must be greater than 0.0; received 0": lambda: Contact(stiffness=0),
    "contact.exponent must be greater than 0; received 0": lambda: Contact(stiffness=1, exponent=0),
    "hertz.poisson must be at most 0.5; received 0.6": lambda: Hertz(young=1, poisson=0.6),
    "contact_bond.threshold must be less than 1.0; received 1": lambda: ContactBond(stiffness=1, threshold=1),
    "contact_friction.dynamic must be at most static; received 0.5": lambda: ContactFriction(
        stiffness=1, static=0.4, dynamic=0.5
    ),
    "effects.contact_dissipation must be used together with effects.contact or effects.hertz; "
    "received 'contact_dissipation'": lambda: scene(
        [[0, 0, 0]], [[0, 0, 0]], (ContactDissipation(damping=1),)
    ),
    "stepper.control must be one that suits contact, such as fixed_step or the control of an implicit "
    "stepper; received 'approach_time'": lambda: scene(
        [[0, 0, 0]], [[0, 0, 0]], (Contact(stiffness=1),), stepper=Verlet()
    ),
    "effects.contact_softening must be used together with effects.contact; "
    "received 'hertz, contact_softening'": lambda: scene(
        [[0, 0, 0]],
        [[0, 0, 0]],
        (Hertz(young=1, poisson=0), ContactSoftening(sensitivity=1, reference_temperature=1)),
    ),
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        WRONG[message]()
    assert str(fault.value) == message
