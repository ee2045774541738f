"""Every closed form of Z13 section 3 over a sweep of parameters, with each stepper."""

import numpy as np
import pytest

from tests.scenes import simulate
from tests.steppers.charged import PUSH, W, accurate, boris, charged, equal_steps, final, order
from tests.steppers.closed_forms import driven, static_field, tethered

DURATION = 4.0
GRID = [(b, k) for b in (0.5, 2.0) for k in (0.7, 8.0)]
STEPPERS = {"trapezoid": lambda n: equal_steps(DURATION / n), "boris": lambda n: boris(DURATION / n)}


def rates(flux, stiffness):
    """w = q B/m and k/m."""
    return 3.0 * flux / 2.0, stiffness / 2.0


def forms():
    """Each closed form: its name, the parts of the scene besides B, and the final velocity."""
    for flux, k in GRID:
        w, k_m = rates(flux, k)
        yield f"static {flux}", {"flux": flux, "constant": 1.5}, static_field(DURATION, w, 1.5 / flux)
        settings = {"flux": flux, "stiffness": k, "constant": 1.5}
        yield f"tethered {flux} {k}", settings, tethered(DURATION, w, k_m, 1.5 * PUSH)
        gamma = np.sqrt(w**2 + k_m)
        for ratio in (0.3, 0.9, 1.0, 1.7):
            settings = {"flux": flux, "stiffness": k, "amplitude": 1.5, "omega": ratio * gamma}
            yield f"driven {flux} {k} {ratio}", settings, driven(DURATION, w, k_m, 1.5 * PUSH, ratio * gamma)
        start = {"flux": flux, "velocity": (0.6, -0.8, 0.5)}
        yield f"circle {flux}", start, turned((0.6, -0.8), w * DURATION)


def turned(v, angle):
    """Velocity rotated by B along z through an angle, clockwise for a positive charge."""
    c, s = np.cos(angle), np.sin(angle)
    return c * v[0] + s * v[1], -s * v[0] + c * v[1]


@pytest.mark.long
@pytest.mark.parametrize("name", STEPPERS)
def test_error_falls_as_the_square_of_the_step(name):
    """All forms at once with four step lengths each: order 2, also at resonance."""
    steps = 2 ** np.arange(7, 11)
    named, scenes, expected = [], [], []
    for what, settings, velocity in forms():
        named.append(what)
        expected.append(velocity)
        scenes += [charged(STEPPERS[name](int(n)), DURATION, **settings) for n in steps]
    results = simulate(scenes, worlds=len(scenes), capacity=1)
    for k, (what, velocity) in enumerate(zip(named, expected, strict=True)):
        velocities = [final(r)[:2] for r in results[len(steps) * k : len(steps) * (k + 1)]]
        errors = np.linalg.norm(np.array(velocities) - velocity, axis=1)
        assert order(steps, errors) == pytest.approx(2.0, abs=0.06), what
        assert errors[-1] < 1e-3, what


@pytest.mark.slow
@pytest.mark.parametrize(("phi", "expected"), [(1.0, 1.0), (0.0, 1.0), (0.5, 2.0)])
def test_order_of_the_implicit_stepper(phi, expected):
    """phi = 1/2 is of second order; implicit and explicit Euler are of first."""
    steps = 2 ** np.arange(9, 14)
    scenes = [
        charged(equal_steps(1.0 / n, phi), 1.0, stiffness=8.0, amplitude=1.5, omega=2.0)
        for n in steps.tolist()
    ]
    velocity = driven(1.0, W, 4.0, 1.5 * PUSH, 2.0)
    errors = [
        np.linalg.norm(final(r)[:2] - velocity) for r in simulate(scenes, worlds=len(scenes), capacity=1)
    ]
    assert order(steps, errors) == pytest.approx(expected, abs=0.03)


@pytest.mark.slow
def test_the_requested_error_is_met_with_more_work():
    """Over five decades the error decreases with the requested one, and the work increases."""
    tolerances = 10.0 ** -np.arange(3, 8)
    scenes = [charged(accurate(e), DURATION, stiffness=8.0, amplitude=1.5, omega=2.0) for e in tolerances]
    results = simulate(scenes, worlds=len(scenes), capacity=1)
    velocity = np.array(driven(DURATION, W, 4.0, 1.5 * PUSH, 2.0))
    errors = np.array([np.linalg.norm(final(r)[:2] - velocity) for r in results]) / np.linalg.norm(velocity)
    work = np.array([r.work["force_evaluations"] for r in results])
    assert (np.diff(errors) < 0).all()
    assert (np.diff(work) > 0).all()
    # A second-order rule: a hundredth of the error for ten times the steps, within the variation of
    # iterations.
    assert (errors < 30 * tolerances).all()
    assert errors[-1] < errors[0] * 1e-3
