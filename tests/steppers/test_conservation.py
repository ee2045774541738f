"""Energy and momentum of an exploding array, with every stepper."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from conservation import STEPPERS, drift, measure

BOUNDS = {
    "Verlet, 500 steps": (0.0, 2e-3),
    # Bounded by dt_lim alone, not by the error of a step.
    "Trapezoid, as Z16 section 8.1": (0.1, 0.3),
    "Trapezoid, error=1e-3": (0.0, 2e-2),
    "Trapezoid, error=1e-5": (0.0, 4e-4),
    "Collocation, error=1e-4": (0.0, 8e-6),
    "Collocation, error=1e-8": (0.0, 3e-11),
}
"""Least and greatest change of the energy, relative to the final kinetic energy."""


@pytest.mark.slow
@pytest.mark.parametrize("name", STEPPERS)
def test_energy_and_momentum(name):
    """Pair forces cancel to rounding, and the energy error follows the steps."""
    result = measure(STEPPERS[name], sites=4)
    assert result.status.ok
    energy, momentum = drift(result)
    least, most = BOUNDS[name]
    assert least <= abs(energy) < most
    assert momentum < 1e-13
