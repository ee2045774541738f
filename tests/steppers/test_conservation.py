"""Energy and momentum of an array that throws itself apart, by every stepper."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from conservation import STEPPERS, drift, measure

BOUNDS = {
    "Verlet, 500 steps": 2e-3,
    "Trapezoid, as Z16 section 8.1": 0.5,
    "Trapezoid, error=1e-3": 2e-2,
    "Trapezoid, error=1e-5": 5e-4,
    "Collocation, error=1e-4": 1e-5,
    "Collocation, error=1e-8": 1e-10,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STEPPERS)
def test_energy_and_momentum(name):
    """Forces between pairs cancel to rounding; energy is as good as the steps."""
    result = measure(STEPPERS[name], sites=4)
    assert result.status.ok
    energy, momentum = drift(result)
    assert abs(energy) < BOUNDS[name]
    assert momentum < 1e-13
