"""Singular pairs.

Pairs whose force grows without bound as they meet, from a nanometre to coincidence.
"""

import numpy as np
from scipy.constants import e as elementary_charge
from scipy.constants import electron_mass
from scipy.integrate import quad

from tisim import Box, Scene, run
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.impacts import touching
from tisim.cases.hard.runs import by_id, ends, given, kinetic, missing, momentum, verlet
from tisim.cases.hard.springs import tight
from tisim.effects import Contact, Hertz, NearField
from tisim.steppers import ErrorControl, Trapezoid

COULOMB_CONSTANT = 8.9875517873681764e9
"""N m^2/C^2."""


@hard_case(
    "Two particles that attract by 1/d fall on each other from rest; the speed has no bound.",
    Criterion("kinetic energy until shortly before, relative error", 1e-4),
    Criterion("momentum, kg m/s", 1e-12),
    Criterion("words missing from the message at the singularity", 0, 0),
    Criterion("time of the last good state beyond the fall, over the fall", 1e-6),
)
def fall_into_a_singularity(stepper=tight):
    """stepper : function of the limits of its steps."""
    fall = np.sqrt(np.pi / 4)
    early, late = run([
        Scene(
            particles=given([[0, 0, 0], [1.0, 0, 0]], np.zeros((2, 3)), 1e-3, 1.0),
            effects=(NearField(alpha1=1.0),),
            # By default distances below a thousandth of a radius are not resolved; here all are.
            stepper=stepper(first=1e-3, longest=0.1, resolution=0.0),
            duration=end * fall,
        )
        for end in (0.99, 2.0)
    ])  # fmt: skip
    sound([early])
    energy, total = [], []
    for result in (early, late):
        state = by_id(result.state)
        distance = abs(state["position"][1, 0] - state["position"][0, 0])
        energy.append(abs(kinetic(state) / -np.log(distance) - 1))
        total.append(np.abs(momentum(state)).max())
    message = "cannot be solved even at the shortest step, by effects.near_field"
    return max(energy), max(total), missing(late, message), late.time / fall - 1


def electron_stepper(first):
    """Return the trapezoidal rule for six decades of distance; first : step, s."""
    return Trapezoid(
        control=ErrorControl(
            error=1e-5, tolerance=1e-7, iterations=20, first=first, longest=1e-3, shortest=1e-22
        )
    )


def electrons(stepper, gap=1e-9):
    """Return two electrons at rest at a distance (m) that fly apart to 1 mm, and their last speed (m/s)."""
    swiftest = np.sqrt(COULOMB_CONSTANT * elementary_charge**2 / gap / electron_mass)
    scene = Scene(
        particles=given(
            [[0, 0, 0], [gap, 0, 0]], np.zeros((2, 3)), 1e-10, electron_mass, charge=elementary_charge
        ),
        effects=(NearField(strength="charge", alpha2=COULOMB_CONSTANT),),
        stepper=stepper,
        duration=1e-3 / (2 * swiftest),
    )
    return scene, swiftest


@hard_case(
    "Two electrons released 1 nm apart fly to 1 mm; the first step is right, or 1e9 times too long.",
    Criterion("speed by the released energy, relative error", 1e-3),
    Criterion("distance at the end from 1 mm, relative", 1e-2),
    Criterion("momentum over that of one electron", 1e-12),
    Criterion("rejected steps after the long first step", least=4),
    figure="released",
)
def electrons_from_a_nanometre(stepper=electron_stepper, *, gap=1e-9):
    """stepper : function of the first step."""
    scenes, (swiftest, _) = zip(*(electrons(stepper(first), gap) for first in (1e-18, 1e-9)), strict=True)
    results = sound(run(list(scenes)))
    speed, far, drift = [], [], []
    for result in results:
        state = by_id(result.state)
        distance = np.linalg.norm(state["position"][1] - state["position"][0])
        expected = swiftest * np.sqrt(1 - gap / distance)
        speed.append(np.abs(np.abs(state["velocity"][:, 0]) / expected - 1).max())
        far.append(abs(distance / 1e-3 - 1))
        drift.append(np.abs(state["velocity"].sum(axis=0)).max() / swiftest)
    return max(speed), max(far), max(drift), results[1].work["rejections"]


@hard_case(
    "Two of three particles are in one place, at which the force is 0/0; in another scene they are 1e-12 "
    "radii apart.",
    Criterion("in one place: words missing from the message", 0, 0),
    Criterion("in one place: change of the state kept", 0, 0),
    Criterion("1e-12 radii apart: force, relative error", 1e-12),
)
def coincident_particles():
    place, n = np.array([[0, 0, 0], [1, 1, 1], [1, 1, 1]], float), np.array([2.0, -3.0, 6.0]) / 7
    law = NearField(alpha1=2.0, alpha2=1e-13)

    def at(position, effect, dt):
        particles = given(position, 0 * position, 0.1, 1.0)
        return Scene(particles=particles, effects=(effect,), stepper=verlet(dt), duration=dt)

    # Also with zero strength the direction is undefined.
    *bad, good = run([
        at(place, law, 1e-9), at(place, NearField(), 1e-9),
        at(np.array([0 * n, 1e-13 * n]), law, 1e-30),
    ])  # fmt: skip
    sound([good])
    words = ("at t = 0 s", "effects.near_field", "particle 1", "not finite")
    change = max(
        np.abs(one.state[name] - one.start[name]).max() for one in bad for name in ("position", "velocity")
    )
    expected = np.outer([1, -1], (2.0 / 1e-13 - 1e-13 / 1e-26) * n)
    force = by_id(good.state)["force"]
    return (
        sum(missing(one, *words) for one in bad),
        change,
        np.abs(force - expected).max() / np.abs(expected).max(),
    )


@hard_case(
    "Hard spheres whose centres are 1e-300, 1e-12 and 1e-6 radii apart: the square of the distance "
    "underflows.",
    Criterion("numbers that are not finite", 0, 0),
    Criterion("momentum, relative change", 1e-14),
    Criterion("kinetic energy gained, relative", 1e-14),
    Criterion("impacts at 1e-12 and 1e-6 radii", 2, 2),
)
def nearly_coincident_spheres():
    results = sound(run([touching(part * 1e-3, 1.0) for part in (1e-300, 1e-12, 1e-6)]))
    lost = sum((~np.isfinite(values)).sum() for result in results for values in result.state.values())
    moved = max(np.abs(momentum(result.state) / momentum(result.start) - 1).max() for result in results)
    gain = max(kinetic(result.state) / kinetic(result.start) - 1 for result in results)
    return lost, moved, gain, sum(result.work["impacts"] for result in results[1:])


PRESSED_STIFFNESS = 1e3
"""Stiffness (N/m^2) of the contact of Z16, and Young's modulus (Pa), of overlapping spheres."""


def overlap_energy(d, a, b):
    """Return the energy (J) of spheres of radii a and b (m) at a distance d (m) under ``Contact`` and
    ``Hertz``, by quadrature."""

    def push(x):
        overlap = a + b - x
        area = np.pi * max(a**2 - (0.5 * (x - (b**2 - a**2) / x)) ** 2, 0.0)
        modulus = PRESSED_STIFFNESS / (2 * (1 - 0.25**2))
        return (
            PRESSED_STIFFNESS * (overlap / (a + b)) ** 2 * area
            + 4 / 3 * modulus * np.sqrt(a * b / (a + b)) * overlap**1.5
        )

    return quad(push, d, a + b)[0] if d < a + b else 0.0


def overlapping(position, radius, mass, dt, steps):
    """Return spheres at rest in a periodic box of 1 m, under both contact laws."""
    return Scene(
        particles=given(position, np.zeros((len(position), 3)), radius, mass),
        effects=(Contact(stiffness=PRESSED_STIFFNESS), Hertz(young=PRESSED_STIFFNESS, poisson=0.25)),
        domain=Box(low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0)),
        stepper=verlet(dt),
        duration=dt * steps,
    )


@hard_case(
    "Spheres are released from an overlap of 10 %, and from centres 1e-12 radii apart, across a periodic "
    "face.",
    Criterion("energy released over energy stored, relative error", 1e-6),
    Criterion("momentum, kg m/s", 1e-12),
)
def released_overlaps():
    radius, gaps = 0.125, (1.8 * 0.125, 1e-12 * 0.125)
    scenes = [overlapping([[0, 0.5, 0.5], [d, 0.5, 0.5]], radius, 1.0, 2e-5, 10_000) for d in gaps]
    energy, total = [], []
    for gap, state in zip(gaps, ends(scenes), strict=True):
        d = state["position"][1] - state["position"][0]
        left = overlap_energy(np.linalg.norm(d - np.round(d)), radius, radius)
        before = overlap_energy(gap, radius, radius)
        # Much of it must have been released.
        energy.append(abs((kinetic(state) + left) / before - 1) if left < 0.5 * before else np.inf)
        total.append(np.abs(momentum(state)).max())
    return max(energy), max(total)
