"""Stiff springs and near contact.

Steps that are far too long for a spring, and contacts that last for a small part of the flight.
"""

import numpy as np
from scipy.integrate import quad

from tisim import Scene, run
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.runs import ends, given, kinetic, missing, verlet
from tisim.effects import Contact, NearField, Tether
from tisim.steppers import ErrorControl, Stepper, Trapezoid


def tight(**limits: float) -> Trapezoid:
    """Return the implicit trapezoidal rule with an error of 1e-6 a step."""
    return Trapezoid(control=ErrorControl(error=1e-6, tolerance=1e-8, shortest=1e-14, **limits))


def spring(stiffness: float, stepper: Stepper, duration: float) -> Scene:
    """Return 1 kg released at 1 m from the anchor of a spring (N/m)."""
    return Scene(
        particles=given((1.0, 0, 0), (0, 0, 0), 1e-3, 1.0, anchor=np.zeros((1, 3))),
        # With a pair force, here of no strength, all particles of a world have one step.
        effects=(Tether(stiffness=(stiffness,) * 3), NearField()),
        stepper=stepper,
        duration=duration,
    )


@hard_case(
    "Springs of 4 N/m, and 100 and 1e6 times stiffer, with one and the same control: the first step is up to "
    "20 radians long.",
    Criterion("distance from the centre after 3.25 periods / amplitude", 1e-4),
    Criterion("speed there, relative error", 1e-6),
    Criterion("steps of any spring beyond 1.2 times the fewest", 10),
    Criterion("rejected steps of the stiffest", least=2),
)
def stiff_springs(stepper=tight):
    """stepper : function of the first and the longest step."""
    factors = np.array([1.0, 1e2, 1e6])
    results = sound(
        run([
            spring(4.0 * f, stepper(first=0.01, longest=0.1), 3.25 * np.pi / np.sqrt(f))
            for f in factors
        ])
    )  # fmt: skip
    speed = np.array([result.state["velocity"][0, 0] for result in results])
    steps = [result.work["steps"] for result in results]
    return (
        max(np.abs(result.state["position"]).max() for result in results),
        np.abs(speed / (-2 * np.sqrt(factors)) - 1).max(),
        max(steps) - 1.2 * min(steps),
        results[2].work["rejections"],
    )


@hard_case(
    "Verlet in steps ten times as long as the stability limit w dt = 2 of a spring would grow without bound.",
    Criterion("below the limit: position after 10 s, absolute error, m", 1e-3),
    Criterion("beyond it: words missing from the message", 0, 0),
    Criterion("particles left that are not finite", 0, 0),
)
def step_beyond_stability():
    stable, stiff = run([spring(4.0 * f, verlet(0.01), 10.0) for f in (1.0, 1e6)])
    words = ("the critical one at most 0.001 s, by effects.tether", "particle 0")
    lost = missing(stiff, *words) + (stiff.time >= 10.0) + (not stable.status.ok)
    finite = all(np.isfinite(values).all() for values in stiff.state.values())
    return abs(stable.state["position"][0, 0] - np.cos(20.0)), lost, not finite


@hard_case(
    "Spheres of 1 m graze each other at 200 m/s with an overlap of 1 mm: the contact lasts a few hundredths "
    "of the flight.",
    Criterion("deflection over the impulse along the straight path, relative error", 1e-3),
    Criterion("kinetic energy, relative change", 1e-9),
    Criterion("without overlap: change of velocity, m/s", 0, 0),
)
def grazing_spheres():
    speed, stiffness, apart = 100.0, 1e6, 2.0 - 1e-3
    scenes = [
        Scene(
            particles=given([[-1.0, 0, 0], [1.0, y, 0]], [[speed, 0, 0], [-speed, 0, 0]], 1.0, 1.0),
            effects=(Contact(stiffness=stiffness),),
            stepper=verlet(1e-6),
            duration=0.02,
        )
        for y in (apart, 2.0)
    ]
    touched, missed = ends(scenes)

    def across(x):
        d = np.hypot(apart, x)
        return stiffness * (1 - d / 2) ** 2 * np.pi * max(1 - d**2 / 4, 0.0) * apart / d

    impulse, _ = quad(across, -0.1, 0.1, points=[0])
    return (
        abs(touched["velocity"][1, 1] / (impulse / (2 * speed)) - 1),
        abs(kinetic(touched) / speed**2 - 1),
        np.abs(missed["velocity"] - [[speed, 0, 0], [-speed, 0, 0]]).max(),
    )
