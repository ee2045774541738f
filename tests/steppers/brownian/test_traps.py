"""Brownian particles in a harmonic trap have the variance of the scheme, and steps with a large bias are
refused."""

import math

import numpy as np
import pytest
import scipy.constants

import tisim
from tisim import effects as laws
from tisim.steppers.brownian.brownian import LONGEST_RELAXATION, Brownian
from tisim.steppers.brownian.drift_limit import DriftLimit

RADIUS, VISCOSITY, TEMPERATURE, STIFFNESS = 1e-6, 1e-3, 300.0, 1e-6
RELAXATION = 6 * math.pi * VISCOSITY * RADIUS / STIFFNESS
NUMBER = 20000


def trapped(part, number=NUMBER, stiffness=STIFFNESS, mass=4e-15):
    """A scene of particles in separate traps, with steps of a given fraction of the relaxation time (s)."""
    return tisim.Scene(
        particles=tisim.Particles(
            position=np.zeros((number, 3)), velocity=np.zeros((number, 3)), radius=RADIUS, mass=mass
        ),
        effects=(laws.Tether(stiffness=(stiffness,) * 3),),
        stepper=Brownian(
            temperature=TEMPERATURE,
            viscosity=VISCOSITY,
            control=DriftLimit(longest=part * RELAXATION, shortest=1e-8),
        ),
        duration=12 * RELAXATION,
    )


@pytest.mark.long
@pytest.mark.parametrize("part", [0.02, LONGEST_RELAXATION])
def test_the_variance_is_larger_by_half_of_a_step_over_the_relaxation_time(part):
    result = tisim.run(trapped(part))
    places = result.state["position"] / math.sqrt(scipy.constants.k * TEMPERATURE / STIFFNESS)
    # The variance of 3 n normal numbers has the relative error sqrt(2 / (3 n)).
    exact = 1 / (1 - part / 2)
    assert abs((places**2).mean() / exact - 1) < 4 * math.sqrt(2 / (3 * NUMBER))


@pytest.mark.parametrize("mass", [1e-18, 1e-9])
def test_longer_steps_are_refused_whatever_the_mass(mass):
    said = r"brownian.control.longest must be at most 0.2 of the relaxation time of effects.tether"
    with pytest.raises(tisim.InputError, match=said) as refused:
        trapped(1.05 * LONGEST_RELAXATION, number=2, mass=mass)
    assert f"= {RELAXATION:.3g} s; received " in str(refused.value)


def test_without_a_trap_steps_may_be_of_any_length():
    scene = trapped(LONGEST_RELAXATION, number=2, stiffness=0.0)
    scene.replace({"stepper.control.longest": 100 * RELAXATION})
