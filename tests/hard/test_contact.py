"""Extreme cases of the Z16 contact: fast, grazing, long at rest, sliding, spinning, hot and cold."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from tests.hard.grains import (
    SPRING,
    R,
    angular_momentum,
    area,
    grains,
    kinetic,
    push,
    stored_energy,
    watched,
)


def column(n=10, g=10.0):
    """Positions of n grains at rest on each other under gravity, from the anchored one up, and its anchor."""
    gaps = [brentq(lambda d, load=g * (n - k): push(d) - load, R, 2 * R, xtol=1e-16) for k in range(1, n)]
    place = np.zeros((n, 3))
    place[1:, 2] = np.cumsum(gaps)
    anchor = place.copy()
    anchor[0, 2] = n * g / SPRING
    return place, anchor


@pytest.mark.long
def test_a_tall_column_rests():
    """Ten grains for 300 times the period of the softest contact.

    A column that starts in balance stays at rest, without creep or heat, also undamped. A column that starts
    off balance conserves its energy, and comes to rest with dissipation.
    """
    place, anchor = column()
    more = {"anchor": anchor, "gravity": 10.0, "held": 1}
    off = place.copy()
    off[5:, 2] += 1e-4 * R
    still = np.zeros_like(place)
    scenes = [
        grains(place, still, 1e-3, 20_000, **more),
        grains(place, still, 1e-3, 20_000, friction=(1e5, 0.5, 0.4), damping=100.0, **more),
        grains(off, still, 1e-3, 20_000, **more),
        grains(off, still, 1e-3, 20_000, damping=100.0, **more),
    ]
    results, states_by_world = watched(scenes, looks=40)
    assert all(result.status.ok for result in results)

    def energy(state):
        z = state["position"][:, 2]
        anchored = 0.5 * SPRING * (z[0] - anchor[0, 2]) ** 2
        return kinetic(state) + sum(map(stored_energy, np.diff(z))) + 10.0 * z.sum() + anchored

    rest = energy(states_by_world[0][0])
    scale = energy(states_by_world[2][0]) - rest
    for states in states_by_world[:2]:
        for state in states:
            np.testing.assert_allclose(state["position"], place, rtol=0, atol=1e-12)
            assert kinetic(state) < 1e-20
    free, damped = ([(energy(state) - rest) / scale for state in states] for states in states_by_world[2:])
    np.testing.assert_allclose(free, 1.0, atol=3e-3)
    assert np.diff(damped).max() < 0
    assert damped[-1] < 1e-3


def test_friction_just_below_and_just_above_its_angle():
    """A grain pressed between two fixed ones is pulled sideways by 0.99 and by 1.01 of the static friction
    limit.

    Below the limit it creeps at the speed at which the regularised stick of Z16, K_f A dt u, carries the load
    (7.13). Above the limit it slips and accelerates by the pull minus the dynamic friction.
    """
    d, dt, steps = 1.9 * R, 1e-5, 1000
    normal, k_f, mu_s, mu_d = push(d), 5e9, 0.5, 0.3
    hold, grip = 2 * mu_s * normal, 2 * k_f * area(d) * dt
    # Two grains of such mass stay where they are and do not rotate.
    place, masses, more = (
        [[0, 0, -d], [0, 0, d], [0, 0, 0]],
        [1e12, 1e12, 1.0],
        {"held": 2, "friction": (k_f, mu_s, mu_d)},
    )
    scenes = [
        grains(place, np.zeros((3, 3)), dt, steps, masses, pull=(f * hold, 0, 0), **more)
        for f in (0.99, 1.01)
    ]
    results, (below, above) = watched(scenes, looks=4)
    assert all(result.status.ok for result in results)
    for state in below[1:]:
        assert state["velocity"][2, 0] == pytest.approx(0.99 * hold / grip, rel=1e-3)
    final = above[-1]["velocity"][2]
    assert final[0] == pytest.approx((1.01 * hold - 2 * mu_d * normal) * dt * steps, rel=2e-2)
    np.testing.assert_allclose(final[1:], 0, atol=1e-9)


def spinning(position, spin, velocity=0.0, **more):
    still = np.broadcast_to(np.asarray(velocity, float), (2, 3))
    return grains(position, still, 1e-5, 40_000, spin=spin, **more)


BONDED = {"bond": (1e5, 0.0, 0.05)}
DEEP = 1.8 * R
"""Overlap at which bond and contact balance: K E^2 = K_nb E at E = 0.1."""


def test_a_spinning_pair_never_gains_energy():
    """Bonded grains that rub, roll and twist.

    The energy, with rotation and with the energy stored in contact and bond, does not rise between samples,
    and the angular momentum is conserved.
    """
    place = [[-DEEP / 2, 0.1, 0], [DEEP / 2, 0.1, 0]]
    scenes = [
        spinning(place, spin, friction=(1e6, 0.5, 0.3), **BONDED)
        for spin in ([[0, 0, 5.0], [0, 0, 5.0]], [[0, 0, 5.0], [0, 0, -5.0]], [[3.0, 4, 1], [-2, 1, 7]])
    ]
    results, states_by_world = watched(scenes, looks=40)

    def energy(state):
        d = np.linalg.norm(state["position"][1] - state["position"][0])
        pull, _ = quad(lambda x: 1e5 * (1 - x / (2 * R)) * area(x), d, DEEP)
        return kinetic(state) + stored_energy(d) - stored_energy(DEEP) - pull

    for result, states in zip(results, states_by_world, strict=True):
        assert result.status.ok
        energies = np.array([energy(state) for state in states])
        assert np.diff(energies).max() < 1e-9 * energies[0]
        momenta = np.array([angular_momentum(state) for state in states])
        np.testing.assert_allclose(momenta, momenta[:1] + 0 * momenta, atol=1e-11)
    rubbed, rolled, _ = (energy(states[-1]) for states in states_by_world)
    assert rubbed < 0.4 * energy(states_by_world[0][0])
    assert rolled == pytest.approx(energy(states_by_world[1][0]), rel=1e-12)


def test_a_bonded_pair_under_torsion():
    """Twisting meets no resistance; bending decays into a rigid rotation.

    Spins along the line of centres cause no slip, on which the grip of Z16 acts. Equal spins across it decay
    into a rigid rotation of the pair with the same angular momentum.
    """
    place = [[-DEEP / 2, 0, 0], [DEEP / 2, 0, 0]]
    grip = {"bond": (1e5, 1e6, 0.05)}
    scenes = [
        spinning(place, [[2.0, 0, 0], [-2.0, 0, 0]], **grip),
        spinning(place, [[0, 0, 1.0], [0, 0, 1.0]], **grip),
    ]
    results, (twist, shear) = watched(scenes, looks=8)
    assert all(result.status.ok for result in results)
    np.testing.assert_allclose(twist[-1]["spin"], [[2, 0, 0], [-2, 0, 0]], rtol=1e-12)
    np.testing.assert_allclose(twist[-1]["position"], place, rtol=0, atol=1e-12)
    inertia = 0.4 * R**2
    rigid = inertia / (inertia + DEEP**2 / 4)
    rate = 1e6 * area(DEEP) * 1e-5 * (2 + DEEP**2 / (2 * inertia))
    for k, state in enumerate(shear):
        spin = rigid + (1 - rigid) * np.exp(-rate * k * 0.05)
        np.testing.assert_allclose(state["spin"][:, 2], spin, rtol=2e-3)
    ends = shear[-1]
    np.testing.assert_allclose(ends["velocity"], np.cross([0, 0, rigid], ends["position"]), atol=2e-2 * rigid)
    np.testing.assert_allclose(angular_momentum(ends), [0, 0, 2 * inertia], atol=1e-12)


def test_softening_from_absolute_zero_to_a_thousand_times_hotter():
    """At a = 1e3 the factor exp(-a (T/T* - 1)) overflows for cold grains, and the message says so; hot grains
    do not repel each other."""
    place, still = [[0, 0, 0], [1.8 * R, 0, 0]], np.zeros((2, 3))
    scenes = [grains(place, still, 1e-6, 10, sensitivity=1e3, temperature=t) for t in (0.0, 300.0, 3e5)]
    (cold, warm, hot), _ = watched(scenes)
    assert "effects.contact, at particle 0" in cold.status.reason
    np.testing.assert_array_equal(cold.state["velocity"], 0.0)
    np.testing.assert_array_equal(hot.state["velocity"], 0.0)
    assert warm.state["velocity"][1, 0] == pytest.approx(push(1.8 * R) * 1e-5, rel=1e-3)
