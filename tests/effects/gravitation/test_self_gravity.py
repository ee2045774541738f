"""Gravity over all pairs: its NumPy reference, Newton's shells, Kepler's orbits, and conservation."""

import numpy as np
import pytest
from scipy.constants import G

from tests.effects.contact.loads import WORLDS, balanced, close, loads, pairs
from tests.effects.contact.loads import cloud as random_cloud
from tests.scenes import scene, simulate
from tisim import Box, InputError
from tisim.analysis import angular_momentum, gravitational_energy, virial_ratio
from tisim.effects import SelfGravity, SoftenedSelfGravity
from tisim.steppers import Collocation, StageControl

CAPACITY = 64
"""Capacity of all scenes, so that each law is compiled once."""


def reference(law, state):
    """F_i = G sum_j m_i m_j d / (d^2 + eps^2)^(3/2) n_ij."""
    n, d = pairs(state)
    soft = getattr(law, "softening_length", 0.0)
    size = G * np.outer(state["mass"], state["mass"]) * d / (d**2 + soft**2) ** 1.5
    return (size[..., None] * n).sum(axis=1)


@pytest.mark.parametrize("kind", [SelfGravity, pytest.param(SoftenedSelfGravity, marks=pytest.mark.slow)])
def test_forces_equal_the_reference_and_sum_to_zero(kind, rng):
    """Forces and torques sum to zero; and sum r.F is the energy (Clausius's virial)."""
    options = [{"softening_length": float(rng.uniform(0.1, 1))} for _ in range(WORLDS)]
    scenes = [random_cloud(rng, (kind(**one if kind is SoftenedSelfGravity else {}),)) for one in options]
    for one, state in zip(scenes, loads(scenes, capacity=CAPACITY), strict=True):
        close(state["force"], reference(one.effects[0], state))
        balanced(state)
        if kind is SelfGravity:
            virial = (state["position"] * state["force"]).sum()
            energy = gravitational_energy(state["position"], state["mass"])
            assert virial == pytest.approx(energy, rel=1e-12)


@pytest.mark.slow
def test_the_softened_force_is_the_gradient_of_the_softened_energy(rng):
    law = SoftenedSelfGravity(softening_length=0.5)
    (state,) = loads([random_cloud(rng, (law,), n=5)], capacity=CAPACITY)
    h, expected = 1e-5, np.zeros((5, 3))
    for i, a in np.ndindex(5, 3):
        step = np.zeros((5, 3))
        step[i, a] = h
        ahead, behind = (
            gravitational_energy(state["position"] + sign * step, state["mass"], 0.5) for sign in (1, -1)
        )
        expected[i, a] = -(ahead - behind) / (2 * h)
    close(state["force"], expected, 1e-8)


@pytest.mark.slow
def test_coincident_particles_attract_only_without_softening():
    """Without softening the force is not finite, and the world stops with a message."""
    law = SoftenedSelfGravity(softening_length=0.5)
    setup = scene(np.zeros((2, 3)), np.zeros((2, 3)), (law,), mass=1e9)
    assert (loads([setup], capacity=CAPACITY)[0]["force"] == 0).all()
    (result,) = simulate([setup.model_copy(update={"effects": (SelfGravity(),)})], capacity=16)
    assert not result.status.ok
    assert "effects.self_gravity" in result.status.reason


@pytest.mark.slow
def test_the_nearest_image_acts_in_a_periodic_box():
    box = Box(low=(0, 0, 0), high=(1, 1, 1))
    setup = scene(
        [[0.1, 0.5, 0.5], [0.9, 0.5, 0.5]],
        np.zeros((2, 3)),
        (SelfGravity(),),
        radius=0.01,
        mass=1e5,
        domain=box,
    )
    force = G * 1e10 / 0.2**2
    np.testing.assert_allclose(loads([setup])[0]["force"], [[-force, 0, 0], [force, 0, 0]], rtol=1e-12)


def shell(radius):
    """The corners of an icosahedron: they represent a uniform shell up to the fifth power of r/R."""
    a, b = 1.0, (1 + 5**0.5) / 2
    corners = [(0, s * a, t * b) for s in (1, -1) for t in (1, -1)]
    every = np.array([np.roll(corner, k) for corner in corners for k in range(3)])
    return radius * every / np.linalg.norm(every[0])


def test_newtons_shell_theorem():
    """Shells of equal mass with radii 1, 10, 100, ...: between two of them only the inner shells attract, as
    if from the centre. The corners of the outer ones leave a rest below 7 (r/R)^6 of the field of one shell.
    """
    radii, mass = 10.0 ** np.arange(4), 1e9
    places = np.concatenate([shell(r) for r in radii])
    n = len(places)
    probes = np.array([[0.0, 0.0, 10.0 ** (k - 0.5)] for k in range(5)])
    direction = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    probes = probes[:, 2:] * direction
    setup = scene(
        np.concatenate([places, probes]),
        np.zeros((n + 5, 3)),
        (SelfGravity(),),
        mass=np.concatenate([np.full(n, mass / 12), np.full(5, 1e-20)]),
    )
    force = loads([setup], capacity=CAPACITY)[0]["force"][n:] / 1e-20
    r = np.linalg.norm(probes, axis=1)
    unit = G * mass / r**2
    within = np.arange(5.0)
    np.testing.assert_allclose(force @ -direction / unit, within, atol=0.01)
    across = force - (force @ direction)[:, None] * direction
    assert (np.linalg.norm(across, axis=1) < 0.01 * unit).all()


def orbit(eccentricity, periods, control):
    """Two bodies of unlike masses from periapsis, with semi-major axis 1 m."""
    mass = np.array([3e9, 1e9])
    total = mass.sum()
    period = 2 * np.pi / np.sqrt(G * total)
    apart = np.array([1 - eccentricity, 0, 0])
    speed = np.array([0, np.sqrt(G * total * (1 + eccentricity) / (1 - eccentricity)), 0])
    share = np.array([[-mass[1]], [mass[0]]]) / total
    return scene(
        share * apart,
        share * speed,
        (SelfGravity(),),
        mass=mass,
        stepper=Collocation(control=control),
        duration=periods * period,
    )


@pytest.mark.slow
def test_kepler():
    """After whole periods 2 pi sqrt(a^3 / (G M)) both are at their initial positions; half a period later the
    distance is a (1 + e). The energy is -G m_1 m_2 / (2 a). Energy and angular momentum are conserved."""
    control, e = StageControl(error=1e-10, per="run"), 0.6
    for periods, distance in ((5.0, 1 - e), (5.5, 1 + e)):
        (result,) = simulate([orbit(e, periods, control)], capacity=2)
        assert result.status.ok, result.status.reason
        start, end = result.start, result.state
        apart = end["position"][1] - end["position"][0]
        np.testing.assert_allclose(apart, [np.sign(1 - distance) * distance, 0, 0], atol=2e-7)
        for state in (start, end):
            kinetic = 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1)).sum()
            energy = kinetic + gravitational_energy(state["position"], state["mass"])
            assert energy == pytest.approx(-G * 3e18 / 2, rel=1e-8)
        momenta = [
            angular_momentum(state["position"], state["velocity"], state["mass"]) for state in (start, end)
        ]
        np.testing.assert_allclose(momenta[1], momenta[0], rtol=1e-9, atol=1e-9 * momenta[0][2])


@pytest.mark.slow
def test_momenta_are_conserved_to_rounding_and_energy_to_the_step(rng):
    """Twenty bodies with softening through half a collapse, by Verlet: forces are central, equal and
    opposite."""
    n = 20
    position = rng.normal(size=(n, 3))
    setup = scene(
        position,
        0.02 * np.cross([0, 0, 1.0], position),
        (SoftenedSelfGravity(softening_length=0.3),),
        mass=rng.uniform(0.5, 1.5, n) * 1e8,
        dt=0.02,
        steps=1000,
    )
    (result,) = simulate([setup], capacity=20)
    start, end = result.start, result.state
    scale = (end["mass"] * np.linalg.norm(end["velocity"], axis=1)).sum()
    for state in (start, end):
        state["total"] = (state["mass"][:, None] * state["velocity"]).sum(axis=0)
    np.testing.assert_allclose(end["total"], start["total"], rtol=0, atol=1e-13 * scale)
    turn = [angular_momentum(s["position"], s["velocity"], s["mass"]) for s in (start, end)]
    np.testing.assert_allclose(turn[1], turn[0], rtol=0, atol=1e-12 * scale)
    energy = [
        0.5 * (s["mass"] * (s["velocity"] ** 2).sum(axis=1)).sum()
        + gravitational_energy(s["position"], s["mass"], 0.3)
        for s in (start, end)
    ]
    assert virial_ratio(start["position"], start["velocity"], start["mass"]) < 0.1
    assert virial_ratio(end["position"], end["velocity"], end["mass"]) > 0.3
    assert energy[1] == pytest.approx(energy[0], rel=2e-3)


def test_invalid_values_are_refused():
    with pytest.raises(InputError) as fault:
        SoftenedSelfGravity(softening_length=0)
    assert str(fault.value) == "softened_self_gravity.softening_length must be greater than 0.0; received 0"
