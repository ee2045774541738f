"""Checks of the blast: numbers of Z16, and comparisons of runs with closed forms."""

from collections.abc import Iterator

import numpy as np

from tisim import Result, run
from tisim.cases.blast.closed_forms import (
    chow_distance,
    displacement,
    distance_after,
    drag_rate,
    parity_flux,
    stokes_to_quadratic,
)
from tisim.cases.blast.scene import (
    AIR,
    DENSITY,
    ENERGY,
    FLUX,
    MIXED_FLUX,
    RADIUS,
    REST_FLUX,
    SIZES,
    SPECIFIC_CHARGE,
    SPEED,
    TAU,
    VISCOSITY,
    rays,
    resting_rays,
    scene,
)
from tisim.cases.blast.shape import AGES, ellipsoid, half_axes
from tisim.cases.case import Check
from tisim.cases.common.runs import sound
from tisim.effects import ChowDrag, ConstantDrag
from tisim.steppers import ErrorControl, IterationControl, Trapezoid

PAPER_STEP = 1e-4
"""Time step of explicit Euler in Z16 section 6.1, s."""
COEFFICIENT = 0.5
"""The constant drag coefficient that Z16 4.2 compares with Chow's."""
AFTERWARDS = 3e6
"""A time after which Chow's drag has stopped the particles, s: 14 relaxation times in air."""


def _speed(result: Result) -> float:
    return float(np.linalg.norm(result.state["velocity"], axis=1).mean())


def growth(phi: float, dt: float, duration: float) -> float:
    """Return the speed across the field at the end over the speed at the start, without drag, which is 1 in
    the exact solution.

    phi : weight of the end of a step; 0 for explicit Euler. dt : length of all steps, s. duration : s.
    """
    free = scene(number=50, duration=duration).without("chow_drag")
    stepper = Trapezoid(phi=phi, control=IterationControl(first=dt, longest=dt))
    result = run(free.model_copy(update={"stepper": stepper}))
    start, end = (np.linalg.norm(state["velocity"][:, 1:]) for state in (result.start, result.state))
    return float(end / start)


def growth_by_euler(dt: float, duration: float) -> float:
    """Return the same for explicit Euler in closed form.

    The force is across the velocity, so each step of dt (s) multiplies the speed by sqrt(1 + (w dt)^2), w = q
    B/m.
    """
    return float((1 + (SPECIFIC_CHARGE * FLUX * dt) ** 2) ** (duration / dt / 2))


def blast_radii() -> tuple[float, float]:
    """Return the distances (m) of a particle after AFTERWARDS with Chow's drag and with a constant C_D."""
    control = ErrorControl(error=1e-6, tolerance=1e-8, first=1.0, longest=1e5)
    laws = (ChowDrag(density=AIR, viscosity=VISCOSITY), ConstantDrag(density=AIR, coefficient=COEFFICIENT))
    scenes = [rays([(1, 0, 0)], (law,), AFTERWARDS, Trapezoid(control=control)) for law in laws]
    chow, constant = (float(sound([run(one)])[0].state["position"][0, 0]) for one in scenes)
    return chow, constant


def turns(result: Result) -> np.ndarray:
    """Return the angle by which each velocity has turned about x, radians, anticlockwise seen from +x."""
    (before, after) = (v[:, 1] + 1j * v[:, 2] for v in (result.start["velocity"], result.state["velocity"]))
    return np.angle(after * before.conj())


def miss(result: Result) -> float:
    """Return the largest distance of rays with Stokes drag from their closed form, over v tau."""
    v = result.start["velocity"]
    along, across = (displacement(result.time, 1.0, TAU, w) for w in (0.0, SPECIFIC_CHARGE * REST_FLUX))
    exact = (v[:, 1] + 1j * v[:, 2]) * across
    off = result.state["position"] - np.column_stack([v[:, 0] * along.real, exact.real, exact.imag])
    return float(np.linalg.norm(off, axis=1).max() / (SPEED * TAU))


def check() -> Iterator[Check]:
    """Yield the checks of numbers of Z16, of the initial energy, of the field's effect on the cloud, and of
    its rest."""
    yield from drags()
    yield from circles()
    (mixed,) = sound([run(scene(number=500, **SIZES["mixed"].scene))])
    angle = SPECIFIC_CHARGE * MIXED_FLUX * mixed.time
    for sign, sense in ((1, "clockwise"), (-1, "anticlockwise")):
        turned = -sign * turns(mixed)[np.sign(mixed.start["charge"]) == sign]
        name = f"mixed charges, sign {sign:+d}: largest deviation of a turn {sense} from w t, radians"
        yield Check(name, float(np.abs(turned - angle).max()), 0.0, 2e-4)
    yield from rest()


def drags() -> Iterator[Check]:
    """Yield the ratios of forces of Z16, and the blast radius with Chow's drag."""
    rate = drag_rate(1.0, AIR, DENSITY, RADIUS)
    ratio = FLUX / float(parity_flux(rate, SPEED, SPECIFIC_CHARGE))
    yield Check("magnetic force over drag, C_D = 1 (printed: 56504.7)", ratio, 46126.3, 0.1)
    ratio = float(stokes_to_quadratic(VISCOSITY, AIR, COEFFICIENT, 1.0, 1.0))
    yield Check(
        "Stokes drag over drag of C_D = 0.5, times R v, m^2/s (printed: 0.0004)", ratio, 3.527e-4, 1e-7
    )
    (chow, constant), rate = blast_radii(), drag_rate(COEFFICIENT, AIR, DENSITY, RADIUS)
    exact = float(chow_distance(SPEED, AIR, VISCOSITY, DENSITY, RADIUS))
    yield Check("distance to rest with Chow's drag over closed form", chow / exact, 1.0, 1e-4)
    exact /= float(distance_after(AFTERWARDS, SPEED, rate))
    name = "blast radius with Chow's drag over C_D = 0.5, 3e6 s (Z16 4.2: larger)"
    yield Check(name, chow / constant, exact, 1e-4)


def rest() -> Iterator[Check]:
    """Yield the deviations of particles and of the cloud with Stokes drag from their closed forms."""
    for time in (TAU, AGES * TAU):
        (rested,) = sound([run(resting_rays(time))])
        yield Check(
            f"Stokes drag and field, {time:g} s: largest error of a place over v tau",
            miss(rested),
            0.0,
            1e-11,
        )
    (cloud,) = sound([run(scene(**SIZES["rest"].scene))])
    start, w = float(half_axes(cloud.start).mean()), np.array([REST_FLUX, 0.0, 0.0])
    exact = np.sqrt(5 * np.diag(ellipsoid(w, cloud.time, start, TAU)))
    off = float(np.abs(half_axes(cloud.state) / exact - 1).max())
    yield Check("half axes at rest over closed form: largest deviation from 1", off, 0.0, 2e-2)
    yield Check("speed at rest over speed at the start", _speed(cloud) / SPEED, np.exp(-10.0), 1e-6)


def circles() -> Iterator[Check]:
    """Yield the initial energy, and the shapes of the cloud with and without the field."""
    duration = 0.52
    still, field = (run(scene(flux, duration=duration)) for flux in (0.0, FLUX))
    kinetic = 0.5 * float((field.start["mass"] * (field.start["velocity"] ** 2).sum(axis=1)).sum())
    yield Check("kinetic energy at the start, J", kinetic, ENERGY, 1e-8 * ENERGY)
    a, b = half_axes(still.state), half_axes(field.state)
    yield Check("no field: longest axis over shortest", float(a.max() / a.min()), 1.0, 0.05)
    # Drag reduces the speed by about 1 part in 1000 in this time.
    yield Check("half axis along the field, with field over without", float(b[0] / a[0]), 1.0, 2e-3)
    # The chord of a circle of radius v/w, w = q B/m, that subtends the angle w t.
    rate = SPECIFIC_CHARGE * FLUX
    chord = 2 * SPEED / rate * abs(np.sin(rate * duration / 2))
    w, start = np.array([FLUX, 0.0, 0.0]), float(half_axes(field.start).mean())
    exact = np.sqrt(5 * np.diag(ellipsoid(w, duration, start)))
    yield Check(
        "half axes over closed form: largest deviation from 1", float(np.abs(b / exact - 1).max()), 0.0, 5e-3
    )
    reach = np.linalg.norm((field.state["position"] - field.start["position"])[:, 1:], axis=1).max()
    yield Check("largest displacement across the field over its chord", float(reach / chord), 1.0, 5e-3)
    speed = np.linalg.norm(field.state["velocity"], axis=1)
    touching = run(scene(contact=True, duration=0.1))
    free = run(scene(duration=0.1))
    minimal = half_axes(touching.state) / half_axes(free.state)
    yield Check(
        "half axes with contact over without: deviation from 1", float(np.abs(minimal - 1).max()), 0.0, 1e-3
    )
    yield Check("final speed with field over without", float(speed.mean() / _speed(still)), 1.0, 1e-3)
    euler, exact = growth(0.0, PAPER_STEP, 1.0), growth_by_euler(PAPER_STEP, 1.0)
    yield Check(
        "speed across the field by Z16's explicit Euler, 1e-4 s, after 1 s over start", euler, exact, 1e-9
    )
    yield Check("the same by the trapezoidal rule", growth(0.5, PAPER_STEP, 1.0), 1.0, 1e-9)
