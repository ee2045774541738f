"""Checks of the blast: numbers of Z16, and comparisons of runs with closed forms."""

from collections.abc import Iterator

import numpy as np

from tisim import Result, run
from tisim.cases.blast.scene import AIR, ENERGY, FLUX, MASS, RADIUS, SPECIFIC_CHARGE, SPEED, scene
from tisim.cases.blast.shape import ellipsoid, half_axes
from tisim.cases.case import Check
from tisim.steppers import IterationControl, Trapezoid

PAPER_STEP = 1e-4
"""Time step of explicit Euler in Z16 section 6.1, s."""


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


def check() -> Iterator[Check]:
    """Yield the checks of numbers of Z16, of the initial energy, and of the field's effect on the cloud."""
    drag = 0.5 * AIR * 1.0 * SPEED * np.pi * RADIUS**2
    ratio = SPECIFIC_CHARGE * MASS * FLUX / drag
    yield Check("magnetic force over drag, C_D = 1 (printed: 56504.7)", float(ratio), 46126.3, 0.1)
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
