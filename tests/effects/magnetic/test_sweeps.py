"""One sweep a step, as in L21: three touching spheres in an L after each of the first sweeps; and two spheres
whose moments diverge."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.effects.contact.loads import close
from tests.effects.magnetic.magnets import MU_0, dipole_field
from tests.effects.magnetic.test_dipole_dipole import induced
from tests.scenes import by_id, compiled, simulate
from tisim.effects import MutualInducedMoment
from tisim.steppers import Boris, Collocation, ErrorControl, FixedStep, Trapezoid, Verlet

L = np.array([[0, 0, 2.0], [0, 0, 0], [2.0, 0, 0]])
"""P1, P2 and P3 of L21, table 4.3: P2 touches P1, along the field, and P3, across it."""
ERRORS = [
    [-39.885, -36.526, 0.040],
    [-12.371, -12.515, -7.736],
    [-3.370, -3.321, 0.165],
    [-1.014, -1.082, -0.590],
    [-0.278, -0.286, 0.026],
]
"""Error of the force on each sphere, in percent of the final force, after 0, 1, ... sweeps from the moments
of isolated spheres, for infinite mu_r; computed with NumPy in plain loops."""


def force(m, place=L):
    """Force on each of the three spheres, over 3 mu_0 / (4 pi)."""
    total = np.zeros((3, 3))
    for i, j in np.argwhere(~np.eye(3, dtype=bool)):
        d = place[j] - place[i]
        n = d / np.linalg.norm(d)
        a, b = m[i] @ n, m[j] @ n
        total[i] -= (a * m[j] + b * m[i] + (m[i] @ m[j] - 5 * a * b) * n) / np.linalg.norm(d) ** 4
    return total


def test_each_sweep_equals_numpy():
    """One sweep a step, from zero moments: after k + 1 sweeps the error is that after k sweeps from isolated
    moments along the field. L21 prints -23.6, -22.9 and 17.0 %, then -0.66, -0.49 and 1.0 %, which differ
    from these: each sweep leaves 0.27 to 0.31 of the error, not 0.03."""
    law = MutualInducedMoment(susceptibility=1e12, sweeps=0, largest_change=2.0)
    simulation = compiled(induced(L, (0, 0, 1.0), law), capacity=4)
    simulation.load([induced(L, (0, 0, 1.0), law, steps=8, dt=1e-9)])
    gain, field, along = 4 * np.pi / MU_0, dipole_field(L), np.array([0, 0, 1.0])
    matrix = np.eye(9) - gain * field.transpose(0, 2, 1, 3).reshape(9, 9)
    final = np.linalg.solve(matrix, gain * np.tile(along, 3)).reshape(3, 3)
    # The sweep at the start gives the isolated moments.
    moments = [gain * np.tile(along, (3, 1))]
    for _ in range(4):
        simulation.run(steps=1)
        (result,) = simulation.results()
        moments.append(gain * (along + np.einsum("ijab,jb->ia", field, moments[-1])))
        close(by_id(result)["moment"], moments[-1], 1e-9)
    sizes = [np.linalg.norm(force(m), axis=1) for m in moments]
    percent = 100 * (np.array(sizes) / np.linalg.norm(force(final), axis=1) - 1)
    np.testing.assert_allclose(percent, ERRORS, rtol=0, atol=2e-3)
    change = np.linalg.norm(moments[-1] - moments[-2], axis=1).max()
    expected = change / np.linalg.norm(moments[-1], axis=1).max()
    assert result.measures["sweep_change"] == pytest.approx(expected, rel=1e-7)
    assert result.work["mutual_sweeps"] == 5


def pair(distance, steps=8, closing=0.0, **options):
    """Two spheres of 1 m with infinite mu_r, in line with the field, too heavy to be moved by it."""
    place = np.array([[0, 0, 0], [0, 0, distance]])
    law = MutualInducedMoment(susceptibility=1e12, sweeps=0, **options)
    setup = induced(place, (0, 0, 1.0), law, steps=steps, dt=1e-3)
    heavy = {"mass": (1e20,) * 2, "velocity": ((0, 0, closing), (0, 0, -closing))}
    return setup.model_copy(update={"particles": setup.particles.model_copy(update=heavy)})


def run(setup):
    simulation = compiled(setup, capacity=4)
    simulation.load([setup])
    simulation.run()
    (result,) = simulation.results()
    return result


def test_one_sweep_a_step_suffices_unless_moments_diverge():
    """Moments are 1 / (1 - L) times those of isolated spheres, with L = 2 R^3 / d^3, which is 1 at d = 1.26
    R. From zero moments sweeps continue to the tolerance; afterwards one a step is enough."""
    alone = 4 * np.pi / MU_0
    result = run(pair(1.27))
    assert result.status.ok, result.status.reason
    close(by_id(result)["moment"], [[0, 0, alone / (1 - 2 / 1.27**3)]] * 2, 1e-9)
    # With mixing, two sweeps suffice for one unknown; a third confirms it, and each of the 8 steps takes one.
    assert 10 < result.work["mutual_sweeps"] < 13
    result = run(pair(1.25))
    assert (
        "does not converge: a sweep multiplies the change by 1.02, by effects.mutual" in result.status.reason
    )
    assert result.measures["sweep_factor"] == pytest.approx(2 / 1.25**3, rel=1e-6)


def test_approaching_spheres_stop_when_their_moments_diverge():
    """They approach by 2e-4 R a step, from 1.35 R on."""
    result = run(pair(1.35, steps=1000, closing=0.1))
    assert "does not converge" in result.status.reason
    low, high = by_id(result)["position"][:, 2]
    assert high - low == pytest.approx(2 ** (1 / 3), abs=5e-3)
    # Without this limit, moments grow until the two fly apart; then the guard of explicit steps stops the
    # world.
    result = run(pair(1.35, steps=1000, closing=0.1, largest_change=1e300))
    assert "critical time step" in result.status.reason


COLLOIDS, RADIUS, MASS, FIELD = 2e-6 * L, 1e-6, 8e-15, (0.003, 0, 0.01)
"""Positions (m), radius (m), mass (kg) and the field (T) of three spheres of infinite permeability."""
TIME = 1.8e-5
"""s, in which they move by up to half a radius, and none touch."""


def colloids():
    """Their positions after TIME, from rest, with moments by a linear solve at each instant; m."""
    gain, alone = 4 * np.pi / MU_0 * RADIUS**3, 4 * np.pi / MU_0 * RADIUS**3 * np.tile(FIELD, 3)

    def rates(_t, y):
        place = y[:9].reshape(3, 3)
        matrix = np.eye(9) - gain * dipole_field(place).transpose(0, 2, 1, 3).reshape(9, 9)
        m = np.linalg.solve(matrix, alone).reshape(3, 3)
        return np.append(y[9:], 3 * MU_0 / (4 * np.pi) / MASS * force(m, place))

    start = np.append(COLLOIDS, np.zeros((3, 3)))
    return solve_ivp(rates, (0, TIME), start, method="DOP853", rtol=1e-10, atol=1e-18).y[:9, -1].reshape(3, 3)


STEPPERS = [
    pytest.param(Collocation(), 12, id="collocation"),
    pytest.param(Verlet(control=FixedStep(dt=1e-7)), 180, id="verlet", marks=pytest.mark.slow),
    pytest.param(Boris(control=FixedStep(dt=1e-7)), 180, id="boris", marks=pytest.mark.slow),
    pytest.param(
        Trapezoid(control=ErrorControl(error=1e-5, tolerance=1e-8)),
        200,
        id="trapezoid",
        marks=pytest.mark.slow,
    ),
]


@pytest.mark.long
@pytest.mark.parametrize(("stepper", "most"), STEPPERS)
def test_every_stepper_takes_moments_by_sweeps(stepper, most):
    """A stepper's own sweeps must not change the convergence of the sweeps for moments."""
    law = MutualInducedMoment(susceptibility=1e12, tolerance=1e-12)
    setup = induced(COLLOIDS, FIELD, law, radius=RADIUS, stepper=stepper, duration=TIME)
    heavy = setup.particles.model_copy(update={"mass": MASS})
    (result,) = simulate([setup.model_copy(update={"particles": heavy})], capacity=4)
    assert result.status.ok, result.status.reason
    moved = colloids() - COLLOIDS
    assert np.abs(moved).max() > 0.3 * RADIUS
    np.testing.assert_allclose(by_id(result)["position"] - COLLOIDS, moved, rtol=0, atol=3e-5 * RADIUS)
    assert result.work["steps"] <= most
    assert result.measures["sweep_change"] <= 1e-12
