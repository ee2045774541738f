"""Numbers of the packing steppers at the ends of their ranges: a message, or finite numbers."""

import numpy as np
import pytest

from tests.steppers.packing.test_energy_minimisation import scene
from tests.steppers.packing.test_mechanical_contraction import SPHERE
from tisim import run
from tisim.steppers import EnergyMinimisation, MechanicalContraction, MonteCarloGrowth

pytestmark = pytest.mark.long

TINY, HUGE = 1e-300, 1e300
ENDS = {
    MechanicalContraction: {
        "volume_step": (TINY, HUGE),
        "tolerance": (0.0, HUGE),
        "motion": (TINY, HUGE),
    },
    EnergyMinimisation: {
        "fraction_step": (TINY, 0.1),
        "precision": (TINY, HUGE),
        "tolerance": (TINY, HUGE),
        "balance": (TINY, HUGE),
        "first": (TINY, HUGE),
        "longest": (TINY, HUGE),
    },
    MonteCarloGrowth: {
        "rate": (TINY, 1.0),
        "precision": (TINY, HUGE),
        "acceptance": (TINY, 1 - 1e-16),
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ENDS, ids=lambda kind: kind.kind())
def test_ends_of_ranges(kind):
    cases = [(name, value) for name, values in ENDS[kind].items() for value in values]
    scenes = [scene(SPHERE, 40, 0.2, duration=150.0, stepper=kind, **{name: value}) for name, value in cases]
    for case, result in zip(cases, run(scenes), strict=True):
        assert result.status.ok or result.status.reason, case
        for name in ("position", "radius", "orientation"):
            assert np.isfinite(result.state[name]).all(), (case, name)
