"""Permanent magnets, which turn: torques against NumPy, closed forms of needles, conserved quantities."""

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

from tests.effects.contact.loads import WORLDS, balanced, close, fields_beside_the_core, loads, vector
from tests.effects.magnetic.magnets import Quadrupole, dipole_field, flux_density
from tests.scenes import by_id, fixed, scene, simulate
from tisim import InputError
from tisim.effects import DipoleDipole, InducedMoment, Magnetophoresis, NearField, PermanentMoment
from tisim.sources import MagneticField


def magnets(place, moment, effects, **more):
    """Permanent magnets of 1 kg and 1 m."""
    quantities = {"moment": moment, **more.pop("quantities", {})}
    options = {"radius": 1.0, "mass": 1.0, **more}
    place = np.asarray(place, float)
    velocity = options.pop("velocity", 0.0 * place)
    return scene(place, velocity, (*effects, PermanentMoment()), quantities=quantities, **options)


def felt(*field):
    """All that permanent moments feel, in some field."""
    return (*field, Magnetophoresis(), DipoleDipole())


def test_torques_are_those_of_the_fields_and_balance(rng):
    """T = m x B of the sources and of all others (L21 4.9); of the dipoles alone, sum r x F + T = 0."""
    scenes = []
    for k in range(WORLDS):
        strength = 1e-4 * (k % 2)
        field = (
            Quadrupole(constant=vector(rng, strength), scale=vector(rng, strength)),
            MagneticField(constant=vector(rng, strength)),
        )
        scenes.append(magnets(3 * rng.normal(size=(12, 3)), 1e3 * rng.normal(size=(12, 3)), felt(*field)))
    for k, (one, state) in enumerate(zip(scenes, loads(scenes), strict=True)):
        r, m = state["position"], state["moment"]
        b = flux_density(one.effects, r) + np.einsum("ijab,jb->ia", dipole_field(r), m)
        close(state["torque"], np.cross(m, b))
        if k % 2 == 0:
            assert np.abs(state["torque"].sum(axis=0)).max() > 1e-6 * np.abs(state["torque"]).max()
            balanced(state)


def needle(angle, moment=2.0, flux=3.0, **more):
    """A magnet in a uniform field along z, from rest, turned by an angle (rad)."""
    start = moment * np.array([[np.sin(angle), 0, np.cos(angle)]])
    return magnets([[0, 0, 0]], start, felt(MagneticField(constant=(0, 0, flux))), **more)


def test_a_compass_needle_swings_as_a_pendulum():
    """I theta'' = -m B sin theta, I = 2/5 m R^2: for small angles with the frequency sqrt(m B / I), for any
    with the period 4 K(sin^2 theta_0/2) / that."""
    radius, mass = 0.7, 5.0
    frequency = np.sqrt(2.0 * 3.0 / (0.4 * mass * radius**2))
    for angle in (1e-4, 1.0, 3.0):
        period = 4 * ellipk(np.sin(angle / 2) ** 2) / frequency
        setup = needle(angle, radius=radius, mass=mass, stepper=fixed(period / 4096), duration=period / 4)
        state = simulate([setup], capacity=4)[0].state
        # A quarter of a period later it is at 0, as fast as its energy says.
        swung = np.arctan2(state["moment"][0, 0], state["moment"][0, 2])
        assert abs(swung) < 3e-6 * angle
        assert state["spin"][0, 1] == pytest.approx(-2 * frequency * np.sin(angle / 2), rel=3e-6)
        np.testing.assert_array_equal(state["spin"][0, [0, 2]], 0.0)


def test_a_moment_turns_with_its_particle_and_keeps_its_magnitude(rng):
    """Without a field: by spin times time about the spin, in however large steps; its length stays, but for
    what 20 000 of them round."""
    moment, spin = rng.normal(size=(6, 3)), 3e3 * rng.normal(size=(6, 3))
    spin[0] = 0.0
    setup = magnets(
        20.0 * rng.normal(size=(6, 3)),
        1e-9 * moment,
        felt(MagneticField()),
        stepper=fixed(1e-3),
        duration=20.0,
        quantities={"spin": spin},
    )
    state = by_id(simulate([setup], capacity=8)[0])
    np.testing.assert_array_equal(state["moment"][0], 1e-9 * moment[0])
    size = np.linalg.norm(1e-9 * moment, axis=1)
    np.testing.assert_allclose(np.linalg.norm(state["moment"], axis=1), size, rtol=1e-11)
    expected = Rotation.from_rotvec(20.0 * state["spin"]).apply(1e-9 * moment)
    close(state["moment"], expected, 1e-9)


STIFF = 8.0 * 2.0**9
"""N m^9, of a repulsion by 1/d^9."""


def swinging(steps):
    """Two magnets that swing about each other, held apart by a steep repulsion; for 2 s."""
    push = NearField(alpha1=0.0, alpha2=STIFF, beta2=9)
    return magnets(
        [[0, 0, 0], [2.0, 0.3, 0.1]],
        [[9e3, 5e3, -3e3], [1e4, -8e3, 4e3]],
        (*felt(MagneticField()), push),
        velocity=[[0.1, 0.2, 0], [-0.3, 0, 0.1]],
        quantities={"spin": [[0.3, -0.5, 0.2], [-0.4, 0.1, 0.6]]},
        stepper=fixed(2.0 / steps),
        duration=2.0,
    )


def energy(state):
    """Kinetic, of spins, of two dipoles and of the repulsion of ``swinging``, J."""
    r, m = state["position"], state["moment"]
    motion = 0.5 * (state["velocity"] ** 2).sum() + 0.2 * (state["spin"] ** 2).sum()
    field = np.einsum("ijab,jb->ia", dipole_field(r), m)
    return motion - 0.5 * (m * field).sum() + STIFF / 8 / np.linalg.norm(r[1] - r[0]) ** 8


def angular_momentum(state):
    """kg m^2/s, of bodies of 1 kg and 1 m."""
    return np.cross(state["position"], state["velocity"]).sum(axis=0) + 0.4 * state["spin"].sum(axis=0)


def test_two_free_magnets_conserve_energy_and_angular_momentum():
    """Energy to the order of Verlet, in the step; momentum and angular momentum to rounding."""
    errors = []
    for steps in (1000, 2000):
        result = simulate([swinging(steps)], capacity=8)[0]
        start, end = result.start, by_id(result)
        np.testing.assert_allclose(end["velocity"].sum(axis=0), start["velocity"].sum(axis=0), atol=1e-12)
        np.testing.assert_allclose(angular_momentum(end), angular_momentum(start), rtol=0, atol=1e-11)
        assert np.abs(end["spin"] - start["spin"]).max() > 0.5
        errors.append(abs(energy(end) - energy(start)))
    assert errors[0] < 1e-4 * abs(energy(start))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_directions_are_drawn_evenly_by_the_seed():
    """M V, the same for the same seed; the first of many are those of few."""
    rng = np.random.default_rng(1)
    place, radius = 100 * rng.normal(size=(2000, 3)), rng.uniform(0.5, 1.0, 2000)
    law = PermanentMoment(magnetisation=1190.0)

    def moments(n, seed):
        made = scene(place[:n], 0 * place[:n], (law,), radius=radius[:n], mass=1.0, seed=seed)
        return made.start()["moment"]

    many = moments(2000, 5)
    np.testing.assert_allclose(np.linalg.norm(many, axis=1), 1190.0 * 4 / 3 * np.pi * radius**3, rtol=1e-14)
    np.testing.assert_array_equal(moments(7, 5), many[:7])
    assert np.abs(moments(7, 6) - many[:7]).min() > 0
    direction = many / np.linalg.norm(many, axis=1, keepdims=True)
    for axis in range(3):
        # The projection of an even direction on any axis is uniform (Archimedes).
        assert stats.kstest(direction[:, axis], "uniform", args=(-1, 2)).pvalue > 1e-3


def test_only_what_is_needed_is_allocated():
    """Torques are a matter of permanent moments alone: soft ones cost no spin."""
    field = MagneticField(constant=(0, 0, 1))
    hard = needle(0.1)
    assert fields_beside_the_core(hard) == {"moment", "spin", "force", "torque"}
    soft = (field, InducedMoment(susceptibility=1.0), Magnetophoresis(), DipoleDipole())
    assert fields_beside_the_core(scene([[0, 0, 0]], [[0, 0, 0]], soft)) == {"moment", "force"}


def test_what_is_wrong_is_named():
    with pytest.raises(InputError) as fault:
        magnets([[0, 0, 0]], [[0, 0, 1.0]], (MagneticField(), InducedMoment(susceptibility=1.0)))
    assert "induced_moment" in str(fault.value)
    assert "permanent_moment" in str(fault.value)
    twice = scene(
        [[0, 0, 0]],
        [[0, 0, 0]],
        (PermanentMoment(magnetisation=1.0),),
        quantities={"moment": [[0, 0, 1.0]]},
    )
    rule = "particles.moment must be left out, as effects.permanent_moment.magnetisation gives it"
    with pytest.raises(InputError, match=rule):
        twice.start()
