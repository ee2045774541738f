"""The parts of a contact law along the path of one contact, and in one impact, each against its
closed form."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import gamma

from tests.effects.contact.compositions import NEUTRAL, alone, along, grains, loaded
from tests.effects.contact.grains import run
from tests.scenes import by_id
from tisim.cases.granular_bench import closed_forms
from tisim.effects import SJKR, Granular, HertzMaterial

pytestmark = pytest.mark.long

K, YOUNG, POISSON = NEUTRAL["hooke"]["stiffness"], NEUTRAL["jkr"]["young"], NEUTRAL["jkr"]["poisson"]
E_STAR, G_STAR = YOUNG / (2 * (1 - POISSON**2)), YOUNG / (4 * (2 - POISSON) * (1 + POISSON))
PRESSED = 0.02
"""m."""
X, Y, Z = np.eye(3)


def held(n, value=PRESSED):
    """A path at constant overlap."""
    return np.full(n, value)


def at(n, *steps):
    """A path with displacements in its first steps, and none afterwards."""
    path = np.zeros((n, 3))
    path[: len(steps)] = steps
    return path


@pytest.mark.slow
def test_hooke_spring_and_constant_damping():
    """k delta; with constant damping gamma v, in addition to Hertz's force."""
    force, _, _ = along("hooke", np.linspace(0, 0.1, 5))
    np.testing.assert_allclose(force[:, 0], -K * np.linspace(0, 0.1, 5), rtol=1e-14)
    force, _, _ = along("dmt", held(1), at(1, 1e-5 * X), damping=30.0)
    assert force[0, 0] == pytest.approx(-4 / 3 * E_STAR * PRESSED**1.5 + 30.0, rel=1e-14)


def impacts(name, speeds, duration, steps, **first):
    """The restitution of head-on impacts of two grains, at each speed, with ``steps`` steps in a duration
    (s)."""
    made = [
        grains(
            name,
            [[0, 0, 0], [2, 0, 0]],
            [[v / 2, 0, 0], [-v / 2, 0, 0]],
            first={key: values[k] for key, values in first.items()},
            dt=duration(v) / steps,
            steps=3 * steps,
        )
        for k, v in enumerate(speeds)
    ]
    found = [by_id(result)["velocity"][:, 0] for result in run(made)]
    return np.array([after[1] - after[0] for after in found]) / speeds


@pytest.mark.slow
def test_restitution_with_hookes_spring():
    """From e = 0.01 to 1, to first order in the step."""
    e = np.array([0.01, 0.1, 0.5, 0.9, 1.0])
    for steps in (100, 400):
        found = impacts("hooke", np.ones(5), lambda v: np.pi * (0.5 / K) ** 0.5, steps, restitution=e)
        np.testing.assert_allclose(found, e, rtol=0, atol=3 / steps)


@pytest.mark.slow
def test_viscoelastic_restitution_falls_as_the_fifth_root_of_the_speed():
    """1 - C (3/2 A k^(2/5) v^(1/5)) + 3/5 (...)^2, k = 4/3 E* sqrt(R*) / m* (Ramirez and others 1999)."""
    speeds, lag = np.array([0.01, 0.1, 1.0]), 2e-4
    stiff = 4 / 3 * E_STAR * 0.5**0.5 / 0.5
    c = gamma(0.6) * np.pi**0.5 / (2**0.2 * 5**0.4 * gamma(2.1))
    small = 1.5 * c * lag * stiff**0.4 * speeds**0.2
    found = impacts("jkr", speeds, lambda v: 3.2 * stiff**-0.4 * v**-0.2, 1000, viscous_time=np.full(3, lag))
    assert c == pytest.approx(1.15344, abs=1e-5)
    np.testing.assert_allclose(1 - found, small - 0.6 * small**2, rtol=0.02)


def test_a_linear_spring_has_history_and_slides():
    """0.4 k xi, up to mu N; it decreases at once when the motion reverses."""
    moved = np.concatenate([np.tile(1e-3 * Y, (10, 1)), np.tile(-1e-4 * Y, (5, 1))])
    force, _, _ = along("hooke", held(15), moved, friction=0.2)
    limit = 0.2 * K * PRESSED
    drawn = 0.4 * K * 1e-3 * np.arange(1, 11)
    np.testing.assert_allclose(force[:10, 1], np.minimum(drawn, limit), rtol=1e-13)
    np.testing.assert_allclose(force[10:, 1], limit - 0.4 * K * 1e-4 * np.arange(1, 6), rtol=1e-12)


@pytest.mark.slow
def test_mindlins_spring_stores_its_displacement():
    """8 G* a xi; if pressed further at a constant displacement, the force grows."""
    overlap = np.array([0.01, 0.01, 0.04, 0.0025])
    force, _, _ = along("jkr", overlap, at(4, 0 * Y, 1e-6 * Y), friction=1e6)
    np.testing.assert_allclose(force[1:, 1], 8 * G_STAR * np.sqrt(overlap[1:]) * 1e-6, rtol=1e-9)


@pytest.mark.slow
def test_viscous_friction_has_no_history():
    """x gamma u up to mu N, and zero at rest."""
    moved = np.array([[0, 1e-7, 0], [0, 1, 0], [0, 0, 0]])
    force, _, _ = along("dmt", held(3), moved, friction=0.3, damping=30.0)
    expected = [0.7 * 30.0 * 1e-2, 0.3 * 4 / 3 * E_STAR * PRESSED**1.5, 0]
    np.testing.assert_allclose(force[:, 1], expected, rtol=1e-13)


ROLLS = {
    "hooke": ({"rolling_friction": 0.1, "rolling_stiffness": 5e3}, 5e3, K * PRESSED),
    "jkr": (
        {"rolling_friction": 0.1},
        2.25 * 0.01 * 2 * E_STAR * PRESSED**0.5,
        4 / 3 * E_STAR * PRESSED**1.5,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ROLLS)
def test_a_rolling_spring_slips_at_its_limit(name):
    """k_r R* theta, up to mu_r R* N, perpendicular to the normal; it has no component along the normal."""
    first, spring, push = ROLLS[name]
    limit = 0.1 * push
    reached = limit / spring
    turned = np.concatenate(
        [np.tile(0.1 * reached * Z + 7 * X, (20, 1)), np.tile(-0.01 * reached * Z, (9, 1))]
    )
    # "hooke" has no rolling damping.
    mass_drag = 0.0 if name == "hooke" else 2 * 0.2 * spring**0.5 / 1e-5
    _, couple, _ = along(name, held(29), 0.0, turned, **first)
    np.testing.assert_array_equal(couple[:, :2], 0)
    rising = spring * 0.1 * reached * np.arange(1, 21) + mass_drag * 0.1 * reached
    np.testing.assert_allclose(couple[:20, 2], np.minimum(rising, limit), rtol=1e-9)
    if name == "hooke":
        np.testing.assert_allclose(couple[20:, 2], limit * (1 - 0.01 * np.arange(1, 10)), rtol=1e-11)


@pytest.mark.slow
def test_a_constant_torque_holds_back_rolling_at_any_speed():
    turned = np.array([[0, 0, 1e-9], [0, 0, -1.0], [0, 0, 0], [5, 0, 0], [0, 0.3, 0.4]])
    _, couple, _ = along("dmt", held(5), 0.0, turned, rolling_friction=0.1)
    limit = 0.1 * 4 / 3 * E_STAR * PRESSED**1.5
    expected = limit * np.array([[0, 0, 1], [0, 0, -1], [0, 0, 0], [0, 0, 0], [0, 0.6, 0.8]])
    np.testing.assert_allclose(couple, expected, rtol=1e-12, atol=1e-12)


TWISTS = {
    "hooke": ({"twisting_friction": 0.05, "twisting_stiffness": 70.0}, 70.0, 0.05 * K * PRESSED),
    "jkr": (
        {"friction": 0.3},
        8 * G_STAR * PRESSED**1.5 / 2,
        2 / 3 * PRESSED**0.5 * 0.3 * 4 / 3 * E_STAR * PRESSED**1.5,
    ),
}


@pytest.mark.parametrize("name", ["hooke", pytest.param("jkr", marks=pytest.mark.slow)])
def test_a_twisting_spring_slips_at_its_limit(name):
    first, spring, limit = TWISTS[name]
    turned = np.concatenate(
        [np.tile(-0.1 * limit / spring * X, (20, 1)), np.tile(0.01 * limit / spring * X, (9, 1))]
    )
    _, couple, _ = along(name, held(29), 0.0, turned, **first)
    expected = -limit * np.concatenate([np.minimum(0.1 * np.arange(1, 21), 1), 1 - 0.01 * np.arange(1, 10)])
    np.testing.assert_allclose(couple, expected[:, None] * X, rtol=1e-9, atol=1e-9 * limit)


@pytest.mark.slow
def test_a_closed_path_with_twisting_gains_no_work():
    """In twisting, half of the loss of stiffness times the square of the angle is dissipated."""
    n, angle = 500, 1e-4
    still, down = np.zeros(n), np.linspace(PRESSED, 0.005, n)
    overlap = np.concatenate([still + PRESSED, down, still + 0.005, down[::-1]])
    ways = np.concatenate([still + angle / n, still, still - angle / n, still])
    circle = np.sqrt([PRESSED, 0.005])
    springs = {0: 8 * G_STAR * circle**3 / 2}
    for axis, stiffness in springs.items():
        _, couple, _ = along("jkr", overlap, 0.0, ways[:, None] * np.eye(3)[axis], friction=1e6)
        middle = couple[:, axis] - 0.5 * np.diff(couple[:, axis], prepend=0)
        lost = 0.5 * (stiffness[0] - stiffness[1]) * angle**2
        assert (middle * ways).sum() == pytest.approx(lost, rel=1e-3)


def test_cohesion_pulls_while_surfaces_touch():
    """SJKR k_c 2 pi R* delta; DMT 4 pi gamma R*, which carries friction of mu times that at zero load."""
    overlap = np.array([-1e-9, 0.0, PRESSED])
    force, _, lasts = along("hooke", overlap, cohesion_energy_density=2e3)
    np.testing.assert_allclose(force[:, 0], (4e3 * np.pi - K) * np.maximum(overlap, 0), rtol=1e-14)
    most = K / (2 * np.pi)
    for part in (0.999, 1.001):
        force, _, _ = along("hooke", held(1), cohesion_energy_density=part * most)
        # Above this cohesion nothing keeps the grains apart, and the world stops.
        assert np.isfinite(force).all() == (part < 1)
    force, _, lasts = along("dmt", overlap, surface_energy=5.0)
    np.testing.assert_array_equal(lasts, [0, 1, 1])
    hertz = 4 / 3 * E_STAR * PRESSED**1.5
    np.testing.assert_allclose(force[:, 0], [0, 20 * np.pi, 20 * np.pi - hertz], rtol=1e-13)
    force, _, _ = along("dmt", held(1, 0.0), at(1, 0.1 * Y), surface_energy=5.0, friction=0.3, damping=1e3)
    assert force[0, 1] == pytest.approx(0.3 * 20 * np.pi, rel=1e-13)


@pytest.mark.slow
def test_sjkr_beside_hertz_has_an_equilibrium():
    """(3 pi k_c / (2 E*))^2 R* for R* = 1 m, also found in NumPy; up to k_c = 2 E* / (3 pi), at which it is
    R*."""
    law = Granular(normal=HertzMaterial(), cohesion=SJKR())
    elastic, most = {"young": YOUNG, "poisson": POISSON}, 2 * E_STAR / (3 * np.pi)
    for part in (0.05, 0.5, 0.999):
        density = part * most
        rest = brentq(lambda d, k=density: 4 / 3 * E_STAR * d**1.5 - k * 2 * np.pi * d, 1e-6, 2, xtol=1e-15)
        assert rest == pytest.approx((1.5 * np.pi * density / E_STAR) ** 2, rel=1e-10)
        assert rest == pytest.approx(part**2, rel=1e-10)
        # The force is attractive at smaller overlap, and repulsive at larger.
        near = rest * np.array([0.9, 1.0, 1.1])
        force = alone(law, near, **elastic, cohesion_energy_density=density)
        assert force[0, 0] > 0 > force[2, 0]
        assert force[1, 0] == pytest.approx(0.0, abs=1e-9 * force[0, 0])
    assert np.isnan(alone(law, held(1), **elastic, cohesion_energy_density=1.001 * most)[:, 0]).all()


GAMMA = 20.0
"""J/m^2; for soft and strongly adhesive grains."""
PARTS = closed_forms.jkr_pull_off(GAMMA, 1.0)
"""N; the pull-off force for R* = 1 m."""
STRETCH = closed_forms.jkr_stretch(GAMMA, 1.0, E_STAR)
"""m; the gap to which they stretch."""


def jkr_force(overlap):
    """The stable branch of the force (N) for R* = 1 m."""
    return closed_forms.jkr_force(overlap, GAMMA, 1.0, E_STAR)


def test_jkr_force_from_contact_to_pull_off():
    """-8/9 of that at the first touch and -5/9 at the end of the contact; no force before the first touch."""
    ways = np.concatenate([[-0.1 * STRETCH, 0.0, 0.03], np.linspace(0.03, -0.999999 * STRETCH, 300)])
    force, _, lasts = along("jkr", [*ways, -1.000001 * STRETCH, -0.5 * STRETCH], surface_energy=GAMMA)
    np.testing.assert_array_equal(lasts, [0, *[1] * 302, 0, 0])
    np.testing.assert_array_equal(force[lasts == 0], 0)
    assert force[1, 0] == pytest.approx(8 / 9 * PARTS, rel=1e-13)
    assert force[:, 0].max() == pytest.approx(PARTS, rel=1e-4)
    assert force[302, 0] == pytest.approx(5 / 9 * PARTS, rel=2e-3)
    np.testing.assert_allclose(
        force[2:303, 0], [-jkr_force(d) for d in ways[2:]], rtol=1e-6, atol=1e-9 * PARTS
    )


def test_friction_of_adhesive_grains_includes_pull_off():
    """mu |F_n + 2 F_c|: 10/9 mu F_c at the first touch."""
    force, _, _ = along("jkr", held(1, 0.0), at(1, 0.1 * Y), surface_energy=GAMMA, friction=0.3)
    assert force[0, 1] == pytest.approx(0.3 * 10 / 9 * PARTS, rel=1e-12)


@pytest.mark.slow
def test_parting_takes_the_work_of_adhesion():
    """7.09 (W^5 R*^4 / E*^2)^(1/3), W = 2 gamma, for pairs with sufficient speed; slower ones stay
    together."""
    work = quad(lambda d: -jkr_force(d), -STRETCH, 0, limit=200)[0]
    assert work == pytest.approx(7.09 * ((2 * GAMMA) ** 5 / E_STAR**2) ** (1 / 3), rel=1e-3)
    least = (2 * work) ** 0.5
    speeds = least * np.array([0.9, 1.1, 2.0])
    made = [
        grains(
            "jkr",
            [[0, 0, 0], [4, 0, 0]],
            [[v / 2, 0, 0], [-v / 2, 0, 0]],
            radius=2.0,
            mass=2.0,
            first={"surface_energy": GAMMA},
            dt=2e-5,
            steps=30000,
        )
        for v in speeds
    ]
    simulation = loaded(made)
    simulation.run()
    stays, *leave = (by_id(result) for result in simulation.results())
    assert np.ptp(stays["position"][:, 0]) < 4 + STRETCH
    for v, state in zip(speeds[1:], leave, strict=True):
        after = np.diff(state["velocity"][:, 0])[0]
        assert after**2 == pytest.approx(v**2 - 2 * work, rel=2e-3)
