"""Charged particles in uniform fields, one in each world, for tests of steppers."""

from __future__ import annotations

import numpy as np

from tests.scenes import scene
from tisim.effects import Lorentz, Tether
from tisim.sources import ElectricField, MagneticField
from tisim.steppers import Boris, ErrorControl, FixedStep, IterationControl, Trapezoid


def equal_steps(dt, phi=0.5, tolerance=1e-13, **more):
    """The implicit stepper with steps of one length, each solved to the last digits."""
    control = IterationControl(first=dt, longest=dt, shortest=dt, tolerance=tolerance, iterations=60)
    return Trapezoid(phi=phi, control=control, **more)


def accurate(error, longest=1.0):
    """The implicit stepper with control of the truncation error."""
    return Trapezoid(control=ErrorControl(error=error, tolerance=error / 100, first=1e-4, longest=longest))


def boris(dt):
    """The stepper of Boris with steps of one length."""
    return Boris(control=FixedStep(dt=dt))


def charged(
    stepper, duration, flux=2.0, stiffness=0.0, constant=0.0, amplitude=0.0, omega=0.0, velocity=(0, 0, 0)
):
    """One particle of 2 kg and 3 C at the origin; E along x, B along z, tethered along x."""
    return scene(
        [[0.0, 0.0, 0.0]],
        [velocity],
        (
            Lorentz(),
            ElectricField(constant=(constant, 0, 0), amplitude=(amplitude, 0, 0), omega=(omega, 0, 0)),
            MagneticField(constant=(0, 0, flux)),
            Tether(stiffness=(stiffness, 0, 0)),
        ),
        mass=2.0,
        quantities={"charge": 3.0},
        stepper=stepper,
        duration=duration,
    )


W, PUSH = 3.0 * 2.0 / 2.0, 3.0 / 2.0
"""q B/m for B = 2 T, and q E/m for E = 1 V/m."""


def final(result):
    """Velocity of the only particle, m/s."""
    assert result.status.ok, result.status.reason
    return result.state["velocity"][0]


def order(steps, errors):
    """Order of a stepper, by regression."""
    return -np.polyfit(np.log(steps), np.log(errors), 1)[0]
