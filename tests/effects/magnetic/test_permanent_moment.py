"""Permanent magnets, which rotate: torques against NumPy, closed forms of needles, conserved quantities."""

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

from tests.effects.contact.loads import WORLDS, balanced, close, fields_beside_the_core, loads, vector
from tests.effects.magnetic.magnets import Quadrupole, dipole_field, flux_density
from tests.scenes import by_id, fixed, scene, simulate
from tisim import Clump, InputError, Particles, Scene
from tisim.effects import (
    DipoleDipole,
    InducedMoment,
    Magnetophoresis,
    NearField,
    PermanentMoment,
    RigidClumps,
)
from tisim.sources import MagneticField
from tisim.steppers import Boris, Collocation, FixedStep, IterationControl, StageControl, Trapezoid


def magnets(place, moment, effects, **more):
    """Permanent magnets of 1 kg and 1 m."""
    quantities = {"moment": moment, **more.pop("quantities", {})}
    options = {"radius": 1.0, "mass": 1.0, **more}
    place = np.asarray(place, float)
    velocity = options.pop("velocity", 0.0 * place)
    return scene(place, velocity, (*effects, PermanentMoment()), quantities=quantities, **options)


def felt(*field):
    """Effects for all forces and torques on permanent moments, in some field."""
    return (*field, Magnetophoresis(), DipoleDipole())


def test_torques_follow_the_fields_and_balance(rng):
    """T = m x B, where B is the field of the sources and of all other moments (L21 4.9). For dipoles without
    a source, sum r x F + T = 0."""
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
    """A magnet in a uniform field along z, at rest, tilted by an angle (rad)."""
    start = moment * np.array([[np.sin(angle), 0, np.cos(angle)]])
    return magnets([[0, 0, 0]], start, felt(MagneticField(constant=(0, 0, flux))), **more)


@pytest.mark.long
def test_a_compass_needle_swings_as_a_pendulum():
    """I theta'' = -m B sin theta, I = 2/5 m R^2. For small angles the frequency is sqrt(m B / I); for any
    angle the period is 4 K(sin^2 theta_0/2) over that frequency."""
    radius, mass = 0.7, 5.0
    frequency = np.sqrt(2.0 * 3.0 / (0.4 * mass * radius**2))
    for angle in (1e-4, 1.0, 3.0):
        period = 4 * ellipk(np.sin(angle / 2) ** 2) / frequency
        setup = needle(angle, radius=radius, mass=mass, stepper=fixed(period / 4096), duration=period / 4)
        state = simulate([setup], capacity=8)[0].state
        # After a quarter of a period the angle is 0, and energy conservation gives the angular speed.
        swung = np.arctan2(state["moment"][0, 0], state["moment"][0, 2])
        assert abs(swung) < 3e-6 * angle
        assert state["spin"][0, 1] == pytest.approx(-2 * frequency * np.sin(angle / 2), rel=3e-6)
        np.testing.assert_array_equal(state["spin"][0, [0, 2]], 0.0)


@pytest.mark.long
def test_a_moment_turns_with_its_particle_and_keeps_its_magnitude(rng):
    """Without a field a moment rotates about the spin by the spin times the time, in steps of any size. Its
    length stays constant to the rounding of 20 000 rotations."""
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
"""N m^9, strength of a repulsion by 1/d^9."""


def swinging(steps):
    """Two magnets that swing about each other, kept apart by a steep repulsion; for 2 s."""
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
    """Kinetic and spin energy, and the energies of the two dipoles and of the repulsion in
    ``swinging``, J."""
    r, m = state["position"], state["moment"]
    motion = 0.5 * (state["velocity"] ** 2).sum() + 0.2 * (state["spin"] ** 2).sum()
    field = np.einsum("ijab,jb->ia", dipole_field(r), m)
    return motion - 0.5 * (m * field).sum() + STIFF / 8 / np.linalg.norm(r[1] - r[0]) ** 8


def angular_momentum(state):
    """Angular momentum, kg m^2/s, of bodies of 1 kg and 1 m."""
    return np.cross(state["position"], state["velocity"]).sum(axis=0) + 0.4 * state["spin"].sum(axis=0)


@pytest.mark.long
def test_two_free_magnets_conserve_energy_and_angular_momentum():
    """Energy to the order of Verlet in the step; momentum and angular momentum to rounding."""
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


STEPPERS = {
    "boris": Boris(control=FixedStep(dt=5e-4)),
    "trapezoid": Trapezoid(control=IterationControl(first=5e-4, longest=5e-4)),
    "collocation": Collocation(control=StageControl(error=1e-9, first=5e-4, longest=5e-4)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STEPPERS)
def test_a_needle_swings_under_every_stepper_that_turns(name):
    """A quarter of a period, to first order in the step, because operators act at the end of a step."""
    stepper, frequency = STEPPERS[name], np.sqrt(2.0 * 3.0 / 0.4)
    setup = needle(0.01, stepper=stepper, velocity=[[0.1, 0, 0]], duration=np.pi / 2 / frequency)
    (result,) = simulate([setup], capacity=8)
    assert result.status.ok, result.status.reason
    state = result.state
    swung = np.arctan2(state["moment"][0, 0], state["moment"][0, 2])
    assert abs(swung) < 0.01 * frequency * 1e-3
    assert state["spin"][0, 1] == pytest.approx(-frequency * 0.01, rel=2e-3)


@pytest.mark.slow
def test_a_clump_of_magnets_swings_as_one():
    """Two magnets in one rigid body: I theta'' = -(m_1 + m_2) B theta. I is taken about a transverse axis."""
    clump = Clump(centres=[(0, 0, -1.0), (0, 0, 1.0)], radii=[1.0, 1.0], density=1.0)
    moments = np.array([[0, 0, 3.0], [0, 0, 5.0]])
    inertia = clump.body.moments.max()
    frequency, angle = np.sqrt(8.0 * 2.0 / inertia), 1e-3
    turn = Rotation.from_euler("y", angle)
    start = Particles.of_clumps(
        clump,
        [(0.0, 0.0, 0.0)],
        orientation=np.roll(turn.as_quat(), 1)[None],
        quantities={"moment": [[0.0, 0.0, 1.0]]},
    )
    quantities = {**start.quantities, "moment": turn.apply(moments)}
    setup = Scene(
        particles=start.model_copy(update={"quantities": quantities}),
        effects=(
            RigidClumps(),
            MagneticField(constant=(0, 0, 2.0)),
            Magnetophoresis(),
            PermanentMoment(),
        ),
        stepper=fixed(np.pi / 2 / frequency / 1000),
        duration=np.pi / 2 / frequency,
    )
    state = by_id(simulate([setup], capacity=8)[0])
    np.testing.assert_allclose(state["moment"], moments, rtol=0, atol=5e-6 * angle * 5.0 + 5 * angle**2)
    np.testing.assert_allclose(state["spin"][:, 1], -frequency * angle, rtol=1e-5)


def dragged():
    """Lengths and directions of moments after 20 000 rotations, and the swing of a needle; in any
    precision."""
    spin = [[3e3, -2e3, 1e3], [1.0, 0.5, -2.0]]
    setup = magnets(
        [[0, 0, 0], [50.0, 0, 0]],
        [[1e-18, 2e-18, 2e-18], [3e-10, 0, 4e-10]],
        felt(MagneticField()),
        stepper=fixed(1e-3),
        duration=20.0,
        quantities={"spin": spin},
    )
    state = by_id(simulate([setup], capacity=8)[0])
    lengths = np.linalg.norm(state["moment"].astype(float), axis=1)
    frequency = np.sqrt(2.0 * 3.0 / 0.4)
    swing = needle(1.0, stepper=fixed(np.pi / frequency / 2000), duration=np.pi / frequency)
    return [(lengths / [3e-18, 5e-10]).tolist(), simulate([swing], capacity=8)[0].state["moment"][0].tolist()]


@pytest.mark.slow
def test_single_precision_keeps_magnitudes_and_swings_as_double(single):
    """Lengths to the rounding of 20 000 rotations, whose errors do not all have one sign."""
    rough, fine = single("effects.magnetic.test_permanent_moment", "dragged"), dragged()
    np.testing.assert_allclose(fine[0], 1.0, rtol=0, atol=1e-11)
    np.testing.assert_allclose(rough[0], 1.0, rtol=0, atol=3e-5)
    np.testing.assert_allclose(rough[1], fine[1], rtol=0, atol=1e-3)


def test_directions_are_drawn_evenly_by_the_seed():
    """Moments are M V, and equal for the same seed; the first particles do not depend on the number of
    particles."""
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
        # The projection of a uniformly distributed direction on any axis is uniform (Archimedes).
        assert stats.kstest(direction[:, axis], "uniform", args=(-1, 2)).pvalue > 1e-3


def test_only_needed_fields_are_allocated():
    """Only permanent moments have torques; with soft moments no spin is allocated."""
    field = MagneticField(constant=(0, 0, 1))
    hard = needle(0.1)
    assert fields_beside_the_core(hard) == {"moment", "spin", "force", "torque"}
    soft = (field, InducedMoment(susceptibility=1.0), Magnetophoresis(), DipoleDipole())
    assert fields_beside_the_core(scene([[0, 0, 0]], [[0, 0, 0]], soft)) == {"moment", "force"}


def test_invalid_values_are_refused():
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
