"""Velocity Verlet: its order, and the energy of orbits."""

import numpy as np
import pytest

from tests.scenes import by_id
from tests.throwaway import K_E, charges, run


def orbit(steps):
    """Opposite charges on a circle of radius 1 m each about their centre; one period in 2 pi seconds."""
    q = np.sqrt(4.0 / K_E)
    period = 2 * np.pi
    return charges(
        [[1, 0, 0], [-1, 0, 0]],
        [[0, 1, 0], [0, -1, 0]],
        [q, -q],
        {"stiffness": 0.0},
        dt=period / steps,
        steps=steps,
    )


def test_two_body_orbit_closes_at_second_order():
    """Velocity Verlet on a Kepler circle: the error after one period falls as dt^2."""
    steps = 2 ** np.arange(7, 12)
    results = run([orbit(int(n)) for n in steps])
    errors = np.array([np.abs(by_id(r)["position"] - [[1, 0, 0], [-1, 0, 0]]).max() for r in results])
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.02)
    assert errors[-1] < 1e-4
    for result, n in zip(results, steps, strict=True):
        assert result.work["steps"] == n
        np.testing.assert_allclose(result.state["velocity"].sum(axis=0), 0, atol=1e-14 * n)


def potential(state):
    gap = np.linalg.norm(state["position"][0] - state["position"][1])
    return 0.5 * (state["velocity"] ** 2).sum() + K_E * state["charge"].prod() / gap


def test_energy_of_an_eccentric_orbit_does_not_drift():
    """Twenty periods at e = 0.36: the energy error does not grow with time and falls as the square of the
    step."""
    q = np.sqrt(4.0 / K_E)
    results = run(
        [
            charges(
                [[1, 0, 0], [-1, 0, 0]],
                [[0, 0.8, 0], [0, -0.8, 0]],
                [q, -q],
                {"stiffness": 0.0},
                dt=2 * np.pi / n,
                steps=20 * n,
            )
            for n in (500, 1000)
        ]
    )
    coarse, fine = (abs(potential(r.state) / potential(r.start) - 1) for r in results)
    assert coarse < 1e-3
    assert fine < coarse / 3


def test_spring_under_a_force_that_depends_on_time():
    """Forced oscillator from rest, r = g (cos(omega t) - cos(w0 t)) / (w0^2 - omega^2), at second order."""
    stiffness, omega, shake, end = 4.0, 1.3, 0.7, 3.0
    steps = 2 ** np.arange(5, 10)
    scenes = [
        charges(
            [[0, 0, 0]],
            [[0, 0, 0]],
            [0.0],
            {"stiffness": stiffness, "shake": (shake, 0, 0), "omega": omega},
            dt=end / n,
            steps=int(n),
        )
        for n in steps
    ]
    w0 = np.sqrt(stiffness)
    expected = shake * (np.cos(omega * end) - np.cos(w0 * end)) / (w0**2 - omega**2)
    errors = np.array([abs(r.state["position"][0, 0] - expected) for r in run(scenes)])
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.05)
    assert errors[-1] < 1e-5
