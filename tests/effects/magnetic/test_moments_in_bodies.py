"""Permanent moments are fixed in their body: a clump, or a group with prescribed motion."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from tests.effects.magnetic.magnets import dipole_field
from tests.scenes import by_id, compiled
from tisim import Clump, Particles, Scene
from tisim.effects import (
    DipoleDipole,
    Magnetophoresis,
    PermanentMoment,
    PrescribedMotion,
    RigidClumps,
    Rotation,
)
from tisim.sources import MagneticField
from tisim.steppers import FixedStep, Verlet

pytestmark = pytest.mark.slow

CENTRES = np.array([(0, 0, 0), (1.4e-3, 0, 0), (0.3e-3, 1.2e-3, 0)])
"""m."""
BODY = Clump(centres=CENTRES, radii=[1e-3, 0.8e-3, 0.6e-3], density=4000.0)
MOMENT = 1e-4 * np.array([1, 0.3, -0.2])
"""A m^2, for each of the three spheres of the clump."""
FIELD = np.array([0, 0.05, 0.1])
"""T."""
GROUP_RATE = np.array([3.0, -20.0, 11.0])
"""rad/s, of the magnet with prescribed motion."""


def magnets(field, spin, dt, duration):
    """A clump of three magnets, and a distant one on a circle."""
    far = Particles(position=[(5.0, 0, 0)], velocity=[(0, 0, 0)], radius=1e-3, density=4000.0,
                    quantities={"group": [1], "moment": [MOMENT]})  # fmt: skip
    return Scene(
        particles=Particles.of_clumps(BODY, position=[(0, 0, 0)], angular_velocity=[spin], spheres=far,
                                      quantities={"moment": [MOMENT]}),
        effects=(
            RigidClumps(),
            PrescribedMotion(group=1, motion=Rotation(rate=tuple(GROUP_RATE), centre=(5.0, 0, 0))),
            PermanentMoment(),
            MagneticField(constant=tuple(field)),
            Magnetophoresis(),
            DipoleDipole(),
        ),
        stepper=Verlet(control=FixedStep(dt=dt)),
        duration=duration,
    )  # fmt: skip


def ended(scenes):
    simulation = compiled(scenes[0], 8, 8)
    simulation.load(scenes)
    simulation.run()
    for result in simulation.results():
        assert result.status.ok, result.status.reason
        yield result


def in_body(state):
    """Moments of the clump in the body frame."""
    turn = Turn.from_quat(np.roll(state["clump_orientation"][0], -1))
    return turn.inv().apply(state["moment"][:3])


def energy(state):
    """Energy of the motion of the clump, of its magnets in the field, and of the magnets in each other's
    field, J."""
    turn = Turn.from_quat(np.roll(state["clump_orientation"][0], -1))
    momentum = state["clump_angular_momentum"][0]
    spin = turn.apply(turn.inv().apply(momentum) / state["clump_inertia"][0])
    mass, velocity = state["body_mass"][0], state["clump_velocity"][0]
    m, r = state["moment"][:3], state["position"][:3]
    others = np.einsum("ijab,jb->ia", dipole_field(r), m)
    moving = (spin @ momentum + mass * velocity @ velocity) / 2
    return moving - (m @ FIELD).sum() - (m * others).sum() / 2


def test_a_moment_is_fixed_in_a_torque_free_body():
    """The clump tumbles, and the forces of its magnets on each other sum to zero: for 100 turns, in steps of
    up to an eighth of a radian, the moment is constant in the body frame to rounding. The moment of a driven
    magnet rotates with its group."""
    spin = np.array([50.0, -30.0, 20.0])
    turn = 2 * np.pi / np.linalg.norm(spin)
    for steps, result in zip((50, 200), ended([magnets((0, 0, 0), spin, turn / n, 100 * turn) for n in
                                               (50, 200)]), strict=True):  # fmt: skip
        start, state = result.start, by_id(result)
        size = np.abs(MOMENT).max()
        np.testing.assert_allclose(in_body(state), in_body(start), rtol=0, atol=1e-11 * size)
        assert np.abs(state["moment"][:3] - start["moment"][:3]).max() > 0.1 * size, steps
        moved = Turn.from_rotvec(GROUP_RATE * 100 * turn).apply(MOMENT)
        np.testing.assert_allclose(state["moment"][3], moved, rtol=0, atol=1e-9 * size)


def test_a_clump_of_magnets_that_swings_keeps_its_energy_to_second_order():
    """Kinetic, field and mutual energy: the error is bounded, and proportional to the square of the step."""
    spin, period = np.array([5.0, -3.0, 2.0]), 3.9e-3
    strength = 3 * np.linalg.norm(MOMENT) * np.linalg.norm(FIELD)
    divisions, errors = (100, 200, 400), []
    for periods in (3, 30):
        made = [magnets(FIELD, spin, period / n, periods * period) for n in divisions]
        errors.append([abs(energy(by_id(one)) - energy(one.start)) / strength for one in ended(made)])
    assert np.max(errors) < 2e-3
    assert max(errors[0][-1], errors[1][-1]) < 1e-4


def test_a_clump_of_magnets_swings_to_second_order():
    """Positions of moments after some swings, with one step, half of it and a quarter."""
    spin, period = np.array([5.0, -3.0, 2.0]), 3.9e-3
    made = [magnets(FIELD, spin, period / n, 2 * period) for n in (100, 200, 400, 800)]
    ends = [by_id(one)["moment"][:3] for one in ended(made)]
    far = [np.abs(a - b).max() for a, b in pairwise(ends)]
    assert far[0] > 1e-8
    assert far[0] / far[1] == pytest.approx(4, rel=0.15)
    assert far[1] / far[2] == pytest.approx(4, rel=0.1)
