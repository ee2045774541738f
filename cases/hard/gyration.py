"""Strong magnetic fields and gyration.

Charges in uniform fields, for ten thousand periods and in steps of hundreds of periods. Boris' method and the
trapezoidal rule are Lobatto collocation with two stages. With s stages a step of w dt = z turns the velocity
by the phase of the diagonal Pade approximant of exp(iz) of degree s - 1 and keeps the speed. All of these
methods conserve v + w b x r, and therefore the radius.
"""

from math import ceil, factorial

import numpy as np

from tisim import Scene, run
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.runs import ends, given
from tisim.cases.hard.singular import COULOMB_CONSTANT
from tisim.effects import Lorentz, NearField
from tisim.sources import ElectricField, MagneticField
from tisim.steppers import Boris, Collocation, ErrorControl, FixedStep, StageControl, Trapezoid

GYRATION, DRIFT_SPEED = 3.0, 0.75
"""Gyration frequency (1/s) and drift speed (m/s) for 3 C and 2 kg in 2 T and 1.5 V/m."""
PADE_DEGREES = {"boris": 1, "trapezoid": 1, "collocation": 4}
"""Degree of the Pade approximant of each method."""
EQUAL_STEPS = {
    # w dt and number of steps: ten thousand periods; steps far longer than a period; an end within a step.
    "boris": [(0.3, 209_440), (20.0, 10_000), (2e3, 10_000), (0.3, 10.37), (0.3, 0.37)],
    "trapezoid": [(0.3, 209_440), (20.0, 10_000), (2e3, 10_000), (0.3, 10.37), (0.3, 0.37)],
    "collocation": [(2.0, 31_416), (1.0, 10.37), (1.0, 0.37)],
}


def equal_steps(method, dt):
    """Return a stepper with steps of one length (s), solved to the last digits."""
    limits = {"first": dt, "longest": dt, "shortest": dt}
    return {
        "boris": lambda: Boris(control=FixedStep(dt=dt)),
        "trapezoid": lambda: Trapezoid(
            control=ErrorControl(error=1e3, tolerance=1e-14, iterations=20, **limits)
        ),
        "collocation": lambda: Collocation(control=StageControl(error=1e3, part=1e-17, sweeps=40, **limits)),
    }[method]()


def charges(position, velocity, stepper, duration, charge=3.0, mass=2.0, flux=2.0, field=0.0):
    """Return charges in B (T) along z and E (V/m) along x that repel each other."""
    return Scene(
        particles=given(position, velocity, 1e-3, mass, charge=charge),
        effects=(
            Lorentz(),
            ElectricField(constant=(field, 0, 0)),
            MagneticField(constant=(0, 0, flux)),
            NearField(strength="charge", alpha2=COULOMB_CONSTANT),
        ),
        stepper=stepper,
        duration=duration,
    )


def angle(z, degree):
    """Return the turn (rad) in a step of w dt = z: twice the phase of the numerator of the approximant."""
    k = degree
    terms = [
        factorial(2 * k - j)
        * factorial(k)
        / (factorial(2 * k) * factorial(j) * factorial(k - j))
        * (1j * z) ** j
        for j in range(k + 1)
    ]
    return 2 * np.angle(sum(terms))


def plane(vector):
    """Return the complex number x + i y of vectors."""
    return vector[..., 0] + 1j * vector[..., 1]


@hard_case(
    "Two like charges held together by B return to their start: a thousand steps on, and a thousand with "
    "velocities and B reversed.",
    Criterion("distance from the start, m", 1e-10),
    Criterion("velocity from the start, m/s", 1e-10),
    Criterion("distance covered on the way, m", least=0.5),
)
def reversed_time(method="boris"):
    """method : "boris", "trapezoid" or "collocation"."""
    charge = np.sqrt(4.0 / COULOMB_CONSTANT)
    place, speed = np.array([[1.0, 0, 0], [-1, 0, 0]]), np.array([[0, 0.7, 0.1], [0, -0.7, 0.2]])

    def after(position, velocity, sign):
        more = {"charge": charge, "mass": 1.0, "flux": sign * 3.0 / charge}
        (state,) = ends([charges(position, velocity, equal_steps(method, 0.01), 10.0, **more)])
        return state["position"], state["velocity"]

    there, going = after(place, speed, 1)
    home, returning = after(there, -going, -1)
    return np.abs(home - place).max(), np.abs(returning + speed).max(), np.abs(there - place).max()


@hard_case(
    "A charge gyrates for ten thousand periods, and ten thousand times in steps of 3 and of 300 periods.",
    Criterion("speed, relative error", 1e-9),
    Criterion("distance from the centre of the orbit, relative error; over w dt if that is above 1", 1e-9),
    Criterion("velocity against the phase of the method, relative error", 1e-8),
    Criterion("change of the velocity along the field, m/s", 0, 0),
    Criterion("place along the field, relative error", 1e-10),
    Criterion("runs that did not end at their duration, or took another number of steps", 0, 0),
    figure="gyrations",
)
def ten_thousand_gyrations(method="boris"):
    """method : "boris", "trapezoid" or "collocation"."""
    rotations = EQUAL_STEPS[method]
    results = sound(
        run([
            charges([0, 0, 0], [0.6, -0.8, 0.5], equal_steps(method, z / GYRATION), n * z / GYRATION)
            for z, n in rotations
        ])
    )  # fmt: skip
    rows = []
    for (z, steps), result in zip(rotations, results, strict=True):
        v, r = result.state["velocity"][0], result.state["position"][0]
        whole = int(steps)
        turned = whole * angle(z, PADE_DEGREES[method]) + angle((steps - whole) * z, PADE_DEGREES[method])
        # The centre of the circle, from the start; B along z turns a positive charge clockwise.
        start = 0.6 - 0.8j
        radius = abs(plane(r) - start / (1j * GYRATION))
        rows.append([
            abs(abs(plane(v)) - 1),
            abs(radius * GYRATION - 1) / max(1, z),
            abs(plane(v) - start * np.exp(-1j * turned)),
            abs(v[2] - 0.5),
            abs(r[2] / (0.5 * result.time) - 1),
            (result.time != result.scene.duration) + (result.work["steps"] != ceil(steps)),
        ])  # fmt: skip
    return np.max(rows, axis=0)


@hard_case(
    "A charge starts at rest in crossed E and B and drifts for ten thousand periods, also in steps of 300 "
    "periods.",
    Criterion("mean velocity from E/B, over the width of the orbit over the time", 1),
    Criterion("speed about the drift, relative error", 1e-9),
)
def drift_across_both_fields(method="boris"):
    """method : "boris", "trapezoid" or "collocation"."""
    rotations = [(z, n) for z, n in EQUAL_STEPS[method] if n > 1000]
    results = sound(
        run([
            charges([0, 0, 0], [0, 0, 0], equal_steps(method, z / GYRATION), n * z / GYRATION, field=1.5)
            for z, n in rotations
        ])
    )  # fmt: skip
    mean, heat = [], []
    for (z, _), result in zip(rotations, results, strict=True):
        v, r = plane(result.state["velocity"][0]), plane(result.state["position"][0])
        wide = 2 * max(1.0, z) * DRIFT_SPEED / GYRATION / result.time
        # v = -i E/B plus a rotating part of magnitude E/B, because the charge starts at rest.
        mean.append(abs(r / result.time + 1j * DRIFT_SPEED) / wide if wide < 1e-3 * DRIFT_SPEED else np.inf)
        heat.append(abs(abs(v + 1j * DRIFT_SPEED) / DRIFT_SPEED - 1))
    return max(mean), max(heat)
