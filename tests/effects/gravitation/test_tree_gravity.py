"""Gravity by a tree of cells: against the sum over all pairs, its error bound, conservation, hard cases."""

import numpy as np
import pytest
from scipy.constants import G

from tests.effects.gravitation.clouds import CAPACITY, THETAS, ball, loads_of, pair_forces, relative_error
from tests.scenes import compiled, scene, simulate
from tisim import Box, InputError
from tisim.effects import SelfGravity, SoftenedSelfGravity, TreeGravity
from tisim.effects.gravitation.self_gravity import OPENING_ANGLES
from tisim.steppers import Collocation, StageControl


@pytest.mark.parametrize("softening", [0.0, 0.2])
def test_with_all_cells_opened_it_sums_all_pairs(softening, rng):
    """Unlike masses in a ball, on a line, in a plane, and in distant clumps; for various numbers of
    particles."""
    places = [
        *(ball(rng, n) for n in (1, 2, 16, 17, 129)),
        ball(rng, 100) * [1, 0, 0],
        ball(rng, 100) * [1, 1e-9, 1] + 5.0,
        np.concatenate([ball(rng, 50), 1e-3 * ball(rng, 50) + 300.0]),
    ]
    scenes = [
        scene(
            r,
            0 * r,
            (TreeGravity(opening_angle=1e-6, softening_length=softening),),
            mass=rng.uniform(1, 2, len(r)),
        )
        for r in places
    ]
    for one, force in zip(scenes, loads_of(scenes), strict=True):
        exact = pair_forces(one, softening)
        np.testing.assert_allclose(force, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


def test_the_error_falls_as_the_third_power_of_the_opening_angle(rng):
    """Worlds with the same ball and different theta: relative to the mean force, the root mean square error
    is below 0.012 theta^3 and the largest below 0.2 theta^3; softening does not increase them."""
    place, mass = ball(rng, 1200), rng.uniform(1, 2, 1200)
    for softening in (0.0, 0.05):
        scenes = [
            scene(place, 0 * place, (TreeGravity(opening_angle=a, softening_length=softening),), mass=mass)
            for a in THETAS
        ]
        rms, most = relative_error(loads_of(scenes), pair_forces(scenes[0], softening))
        assert (rms < 0.012 * THETAS**3).all(), rms
        assert (most < 0.2 * THETAS**3).all(), most
        assert (np.diff(rms) > 0).all()
        order = np.polyfit(np.log(THETAS[1:]), np.log(rms[1:]), 1)[0]
        assert order > 2.5


def test_a_far_cell_is_within_the_bound_of_salmon_and_warren(rng):
    """A leaf of 16 with an outlier, and a particle just far enough away for the leaf to act as one cell."""
    scenes = []
    for a in THETAS:
        leaf, mass = 0.3 * ball(rng, 16), rng.uniform(0.5, 1, 16)
        leaf[0] = 1.0
        centre = mass @ leaf / mass.sum()
        b = np.linalg.norm(leaf - centre, axis=1).max()
        probe = centre - 1.001 * b / a / 3**0.5
        # They come first on the curve, so that they form a leaf of their own.
        assert (probe < leaf).all()
        place = np.concatenate([leaf, probe - 1e-9 * rng.uniform(0, 1, (16, 3))])
        law = TreeGravity(opening_angle=float(a))
        scenes.append(scene(place, 0 * place, (law,), mass=np.concatenate([mass, np.full(16, 1e-12)])))
    for one, force, a in zip(scenes, loads_of(scenes), THETAS, strict=True):
        leaf, mass, probe = one.particles.position[:16], one.particles.mass[:16], one.particles.position[16]
        d = np.linalg.norm(mass @ leaf / mass.sum() - probe)
        bound = (4 * a**3 - 3 * a**4) / (1 - a) ** 2 * G * mass.sum() * 1e-12 / d**2
        error = np.linalg.norm(force - pair_forces(one), axis=1)[16:]
        assert (error < bound).all()
        assert (error > 1e-3 * bound).all()


def test_a_distant_particle_does_not_reduce_accuracy(rng):
    """The others then share a few of the 2^48 cells of the curve's cube, and are still sorted correctly."""
    near = ball(rng, 400)
    place = np.concatenate([near, [[1e3, 2e3, -1e3]]])
    setup = scene(place, 0 * place, (TreeGravity(opening_angle=0.5),), mass=1.0)
    rms, _ = relative_error(loads_of([setup]), pair_forces(setup))
    assert rms[0] < 0.012 * 0.5**3


@pytest.mark.slow
def test_momentum_is_conserved_to_the_error_of_the_forces(rng):
    place, mass = ball(rng, 1200), rng.uniform(1, 2, 1200)
    scenes = [scene(place, 0 * place, (TreeGravity(opening_angle=a),), mass=mass) for a in THETAS]
    exact = pair_forces(scenes[0])
    size, turn = np.linalg.norm(exact, axis=1).sum(), np.linalg.norm(np.cross(place, exact), axis=1).sum()
    for a, force in zip(THETAS, loads_of(scenes), strict=True):
        total, torque = force.sum(axis=0), np.cross(place, force).sum(axis=0)
        assert 0 < np.linalg.norm(total) < 2e-3 * a**3 * size
        assert np.linalg.norm(torque) < 2e-2 * a**3 * max(turn, size)


@pytest.mark.slow
def test_iterated_steps_agree_with_all_pairs():
    """Two bodies share a leaf: orbits by collocation, whose trial states need new sums, are the same."""
    mass = np.array([3e9, 1e9])
    end = []
    for law in (TreeGravity(), SelfGravity()):
        setup = scene(
            [[0, 0, 0], [0.4, 0, 0]],
            [[0, -0.1, 0], [0, 0.7, 0]],
            (law,),
            mass=mass,
            stepper=Collocation(control=StageControl(error=1e-8)),
            duration=3.0,
        )
        (result,) = simulate([setup], capacity=2)
        assert result.status.ok, result.status.reason
        end.append(result.state["position"])
    np.testing.assert_allclose(end[0], end[1], atol=1e-9)


@pytest.mark.slow
def test_coincident_particles_stop_the_world():
    setup = scene([[1, 2, 3], [1, 2, 3], [0, 0, 0]], np.zeros((3, 3)), (TreeGravity(),), mass=1.0)
    (result,) = simulate([setup], capacity=16)
    assert not result.status.ok
    assert "effects.tree_gravity" in result.status.reason


def test_a_periodic_box_with_images_is_refused():
    box = {"low": (0, 0, 0), "high": (1, 1, 1)}
    scene([[0.5] * 3], [[0] * 3], (TreeGravity(),), mass=1.0, radius=0.1, domain=Box(**box, images=False))
    with pytest.raises(InputError) as fault:
        scene([[0.5] * 3], [[0] * 3], (TreeGravity(),), mass=1.0, radius=0.1, domain=Box(**box))
    assert "one without periodic images, with effects.tree_gravity" in str(fault.value)


def test_a_cost_study_tries_tree_gravity():
    tried = SelfGravity().approximations(1.0)
    assert [law.opening_angle for law in tried] == list(OPENING_ANGLES)
    soft = SoftenedSelfGravity(softening_length=0.3).approximations(1.0)
    assert soft == tuple(law.model_copy(update={"softening_length": 0.3}) for law in tried)
    assert TreeGravity().approximations(1.0) == ()
    (turned,) = TreeGravity.accuracy_parameters
    assert turned.turned(TreeGravity(), -3.0).opening_angle == pytest.approx(0.05)


def test_the_memory_of_the_tree_is_reported():
    setup = scene(np.zeros((1, 3)), np.zeros((1, 3)), (TreeGravity(),), mass=1.0)
    simulation = compiled(setup, worlds=len(THETAS), capacity=CAPACITY)
    (buffer,) = [one for one in simulation.assembly.buffers if one.what == "long-range sum"]
    assert buffer.why == "tree_gravity"
    assert buffer.memory.bytes() > 0


@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_invalid_values_are_refused(angle):
    with pytest.raises(InputError, match=r"tree_gravity\.opening_angle must be (greater|less) than"):
        TreeGravity(opening_angle=angle)
