"""Extreme cases of charged particles: long rotation, long steps, drift, release, and time reversal.

In uniform fields the steppers have closed forms. Boris' method and the trapezoidal rule are Lobatto
collocation with two stages. With s stages a step of w dt = z rotates the velocity by the phase of the
diagonal Pade approximant of exp(iz) of degree s - 1 and keeps the speed. All of these methods conserve v + w
b x r, and therefore the radius.
"""

from math import factorial

import numpy as np
import pytest

from tests.scenes import by_id, scene, simulate
from tests.throwaway import K_E
from tisim.effects import Lorentz, NearField
from tisim.sources import ElectricField, MagneticField
from tisim.steppers import Boris, Collocation, ErrorControl, FixedStep, StageControl, Trapezoid

WORLDS = 8
W, DRIFT = 3.0, 0.75
"""Gyration frequency (1/s) and drift speed (m/s) for 3 C and 2 kg in 2 T and 1.5 V/m."""
DEGREES = {"boris": 1, "trapezoid": 1, "collocation": 4}
ROTATIONS = {
    # w dt and number of steps: ten thousand periods; steps far longer than a period; an end within a step.
    "boris": [(0.3, 209_440), (20.0, 10_000), (2e3, 10_000), (0.3, 10.37), (0.3, 0.37)],
    "trapezoid": [(0.3, 209_440), (20.0, 10_000), (2e3, 10_000), (0.3, 10.37), (0.3, 0.37)],
    "collocation": [(2.0, 31_416), (1.0, 10.37), (1.0, 0.37)],
}
NAMES = ["boris", "trapezoid", pytest.param("collocation", marks=pytest.mark.slow)]
ELECTRON = {"charge": 1.602e-19, "mass": 9.109e-31}


def equal_steps(name, dt):
    """A stepper with steps of one length, solved to the last digits."""
    limits = {"first": dt, "longest": dt, "shortest": dt}
    return {
        "boris": lambda: Boris(control=FixedStep(dt=dt)),
        "trapezoid": lambda: Trapezoid(
            control=ErrorControl(error=1e3, tolerance=1e-14, iterations=20, **limits)
        ),
        "collocation": lambda: Collocation(control=StageControl(error=1e3, part=1e-17, sweeps=40, **limits)),
    }[name]()


def charges(position, velocity, stepper, duration, charge=3.0, mass=2.0, flux=2.0, field=0.0, **more):
    """Interacting charges in B along z and E along x."""
    effects = (
        Lorentz(),
        ElectricField(constant=(field, 0, 0)),
        MagneticField(constant=(0, 0, flux)),
        NearField(strength="charge", alpha2=K_E),
    )
    return scene(
        position,
        velocity,
        effects,
        mass=mass,
        quantities={"charge": charge},
        stepper=stepper,
        duration=duration,
        **more,
    )


def run(scenes):
    results = simulate(scenes, worlds=WORLDS, capacity=2)
    for result in results:
        assert result.status.ok, result.status.reason
    return results


def angle(z, degree):
    """Rotation (rad) in a step of w dt = z: twice the phase of the numerator of the Pade approximant."""
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
    """The complex number x + i y."""
    return vector[..., 0] + 1j * vector[..., 1]


@pytest.fixture(scope="module", params=NAMES)
def rotations(request):
    """One charge in B, and one in E and B that starts at rest, with the same steps.

    Returns the name of the stepper and the results by electric field.
    """
    name = request.param
    scenes = []
    for z, steps in ROTATIONS[name]:
        stepper, duration = equal_steps(name, z / W), steps * z / W
        scenes.append(charges([[0, 0, 0]], [[0.6, -0.8, 0.5]], stepper, duration))
        if steps > 1000:
            scenes.append(charges([[0, 0, 0]], [[0, 0, 0]], stepper, duration, field=1.5))
    results = run(scenes)
    kinds = {0.0: [], 1.5: []}
    for result in results:
        kinds[result.scene.effects[1].constant[0]].append(result)
    return name, kinds


@pytest.mark.long
def test_rotation_for_ten_thousand_periods_and_in_long_steps(rotations):
    """Speed and radius are right to 1e-9, the phase equals the phase of the method, and the run ends at the
    duration asked for."""
    name, kinds = rotations
    for (z, steps), result in zip(ROTATIONS[name], kinds[0.0], strict=True):
        v, r = result.state["velocity"][0], result.state["position"][0]
        whole = int(steps)
        turned = whole * angle(z, DEGREES[name]) + angle((steps - whole) * z, DEGREES[name])
        assert result.work["steps"] == np.ceil(steps)
        assert result.time == result.scene.duration
        # The centre of the circle, from the start; B along z turns a positive charge clockwise.
        start = 0.6 - 0.8j
        centre = start / (1j * W)
        assert abs(plane(v)) == pytest.approx(1.0, rel=1e-9)
        assert abs(plane(r) - centre) == pytest.approx(1 / W, rel=1e-9 * max(1, z))
        assert abs(plane(v) - start * np.exp(-1j * turned)) < 1e-8
        assert v[2] == 0.5
        assert r[2] == pytest.approx(0.5 * result.time, rel=1e-10)


@pytest.mark.long
def test_drift_across_both_fields(rotations):
    """The mean velocity is E/B within the circle's width over the time; gyration does not heat."""
    name, kinds = rotations
    assert kinds[1.5]
    for (z, _), result in zip(ROTATIONS[name], kinds[1.5], strict=False):
        v, r = plane(result.state["velocity"][0]), plane(result.state["position"][0])
        mean = r / result.time
        wide = max(1.0, z) * DRIFT / W
        assert abs(mean + 1j * DRIFT) <= 2 * wide / result.time
        assert 2 * wide / result.time < 1e-3 * DRIFT
        # v = -i E/B plus a rotating part of magnitude E/B, because the charge starts at rest.
        assert abs(v + 1j * DRIFT) == pytest.approx(DRIFT, rel=1e-9)


@pytest.mark.slow
def test_sweeps_that_do_not_converge_fail_clearly():
    """Five stages at w dt = 20 give a failure that keeps the start state, not a wrong number."""
    setup = charges([[0, 0, 0]], [[0.6, -0.8, 0.5]], equal_steps("collocation", 20.0 / W), 100.0)
    (result,) = simulate([setup], worlds=WORLDS, capacity=2)
    assert "cannot be solved even at the shortest step, by effects.lorentz" in result.status.reason
    np.testing.assert_array_equal(result.state["velocity"], result.start["velocity"])


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_reversed_time_returns_to_the_start(name):
    """Two like charges confined by B return to the start after a thousand steps forwards and a thousand with
    velocities and B reversed."""
    charge = np.sqrt(4.0 / K_E)
    place, speed = np.array([[1.0, 0, 0], [-1, 0, 0]]), np.array([[0, 0.7, 0.1], [0, -0.7, 0.2]])
    flux, more = 3.0 / charge, {"charge": charge, "mass": 1.0}
    (there,) = run([charges(place, speed, equal_steps(name, 0.01), 10.0, flux=flux, **more)])
    half = by_id(there)
    assert np.abs(half["position"] - place).max() > 0.5
    (back,) = run(
        [charges(half["position"], -half["velocity"], equal_steps(name, 0.01), 10.0, flux=-flux, **more)]
    )
    home = by_id(back)
    np.testing.assert_allclose(home["position"], place, rtol=0, atol=1e-10)
    np.testing.assert_allclose(home["velocity"], -speed, rtol=0, atol=1e-10)


ADAPTIVE = {
    "trapezoid": lambda first: Trapezoid(
        control=ErrorControl(
            error=1e-5, tolerance=1e-7, iterations=20, first=first, longest=1e-3, shortest=1e-22
        )
    ),
    "collocation": lambda first: Collocation(
        control=StageControl(error=1e-9, sweeps=40, first=first, longest=1e-3, shortest=1e-22)
    ),
}


@pytest.mark.parametrize(
    ("name", "bound"), [("trapezoid", 1e-3), pytest.param("collocation", 1e-8, marks=pytest.mark.slow)]
)
def test_like_charges_from_a_nanometre(name, bound):
    """Two electrons released at rest convert k q^2/d into kinetic energy, through six decades of distance.

    This also holds if the first step is a million times too long for the start.
    """
    q, m, gap = ELECTRON["charge"], ELECTRON["mass"], 1e-9
    energy = K_E * q * q / gap
    swiftest = np.sqrt(energy / m)
    duration = 1e-3 / (2 * swiftest)
    scenes = [
        charges(
            [[0, 0, 0], [gap, 0, 0]],
            np.zeros((2, 3)),
            ADAPTIVE[name](first),
            duration,
            flux=0.0,
            radius=1e-10,
            **ELECTRON,
        )
        for first in (1e-18, 1e-9)
    ]
    for result in run(scenes):
        state = by_id(result)
        distance = np.linalg.norm(state["position"][1] - state["position"][0])
        expected = swiftest * np.sqrt(1 - gap / distance)
        np.testing.assert_allclose(np.abs(state["velocity"][:, 0]), expected, rtol=bound)
        assert distance == pytest.approx(1e-3, rel=1e-2)
        np.testing.assert_allclose(state["velocity"].sum(axis=0), 0, atol=1e-12 * swiftest)
    assert scenes[1].stepper.control.first > 1e5 * gap / swiftest
    assert result.work["rejections"] > 3
