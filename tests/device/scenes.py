"""Small scenes for which a device and the CPU must give the same result, to rounding."""

import numpy as np

from tests.effects.contact.grains import heap
from tests.scenes import flow, scene
from tisim.effects import ChowDrag, Lorentz
from tisim.sources import MagneticField
from tisim.steppers import Boris, FixedStep

STEPS = 20


def grains():
    """Grains that overlap, spin and slide in a cell: each pair once, with contact history, and walls."""
    return heap(np.random.default_rng(5), n=40, steps=STEPS)


def impacts():
    """A cloud under all impact laws, which bonds and cools, and a step control that monitors pairs."""
    return flow(grains=60, duration=4e-5)


def fast():
    """A drag law with a power of the speed, and an oscillating field."""
    places, speeds = np.arange(12.0)[:, None], np.geomspace(1.0, 1e4, 12)[:, None]
    field = MagneticField(amplitude=(0.0, 0.0, 0.5), omega=(0.0, 0.0, 1e5))
    return scene(
        places * [[1.0, 0.0, 0.0]],
        speeds * [[1.0, 0.5, -0.2]],
        (ChowDrag(density=1.2, viscosity=1.8e-5), field, Lorentz()),
        dt=1e-6,
        steps=STEPS,
        stepper=Boris(control=FixedStep(dt=1e-6)),
        quantities={"charge": np.full(12, 1e-3)},
    )


SCENES = {"grains": grains, "impacts": impacts, "fast": fast}
