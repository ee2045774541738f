"""Packings from runs, and the images of their bodies."""

import numpy as np
import pytest

from tests.analysis.packings.lattices import lattice
from tisim import Box, InputError, Open, Particles, Scene, run
from tisim.analysis import PackedBodies, contact_numbers, near_gaps, packing_fraction, relative_gaps
from tisim.effects import HardRods, RigidSuperquadrics
from tisim.shapes import SpherocylinderShape, SuperquadricShape
from tisim.steppers import MechanicalContraction


@pytest.mark.slow
@pytest.mark.long
def test_the_packing_at_the_end_of_a_contraction(rng):
    rod, number, side = SpherocylinderShape(length=0.5, diameter=1.0), 40, 6.0
    scale = np.where(np.arange(number) % 2, 1.0, 0.7)
    particles = Particles(
        position=rng.uniform(0, side, (number, 3)),
        velocity=np.zeros((number, 3)),
        mass=np.ones(number),
        radius=scale * rod.bounding_radius(),
    )
    stepper = MechanicalContraction(method="original", volume_step=20.0, attempts=100)
    box = Box(low=(0, 0, 0), high=(side, side, side))
    scene = Scene(
        particles=particles, effects=[HardRods(rods=(rod,))], domain=box, duration=1e5, stepper=stepper
    )
    result = run(scene).check()
    packing = PackedBodies.from_result(result)
    growth = result.state["radius"][0] / particles.radius[0]
    start = rod.volume() * (scale**3).sum() / side**3
    assert packing_fraction(packing) == pytest.approx(start * growth**3, rel=1e-12)
    assert packing_fraction(packing) > 0.4
    np.testing.assert_array_equal(packing.orientation, result.state["orientation"])
    gaps = near_gaps(packing, 0.01)
    assert -1e-4 * (1 + 1e-9) <= relative_gaps(packing, gaps).min() < 1e-4
    assert contact_numbers(packing, [1e-4, 2e-4, 3e-4]).mean[0] > 1


def test_bodies_that_move_under_contact_laws_have_their_shapes():
    brick = SuperquadricShape(semi_axes=(1e-3, 2e-3, 3e-3), exponents=(6.0, 6.0, 6.0))
    ball = SuperquadricShape(semi_axes=(1e-3, 1e-3, 1e-3), exponents=(2.0, 2.0, 2.0))
    kinds, scale = np.array([0, 1, 0]), np.array([1.0, 0.5, 0.8])
    bounding = np.array([brick.bounding_radius(), ball.bounding_radius()])
    particles = Particles(
        position=[[0.01, 0.01, 0.01], [0.02, 0.02, 0.02], [0.03, 0.03, 0.03]],
        velocity=np.zeros((3, 3)),
        mass=np.ones(3),
        radius=scale * bounding[kinds],
        quantities={"shape": kinds},
    )
    bodies, box = RigidSuperquadrics(superquadrics=(brick, ball)), Box(low=(0, 0, 0), high=(0.04, 0.04, 0.04))
    result = run(Scene(particles=particles, effects=[bodies], domain=box, duration=1e-9)).check()
    packing = PackedBodies.from_result(result)
    np.testing.assert_array_equal(packing.shape, kinds)
    np.testing.assert_allclose(packing.scale, scale, rtol=1e-14)
    np.testing.assert_array_equal(packing.orientation, result.state["orientation"])
    expected = np.array([brick.volume(), ball.volume()])[kinds] * scale**3
    np.testing.assert_allclose(packing.volumes(), expected, rtol=1e-14)


def test_particles_without_shapes_are_spheres(rng):
    made = lattice("fcc", 2, diameter=2e-3)
    particles = Particles(
        position=made.position, velocity=np.zeros((32, 3)), mass=np.ones(32), radius=np.full(32, 1e-3)
    )
    box = Box(low=tuple(made.low), high=tuple(made.high), periodic=(True, True, False))
    scene = Scene(particles=particles, domain=box, duration=1e-9)
    packing = PackedBodies.from_result(run(scene).check())
    assert packing.periodic == (True, True, False)
    np.testing.assert_allclose(packing.bounding_radii(), 1e-3, rtol=1e-15)
    # Four of the twelve contacts of a sphere in the lowest layer are lost at each open face.
    assert 2 * len(near_gaps(packing, 1e-9).pairs) == 12 * 32 - 2 * 4 * 8
    with pytest.raises(InputError, match="domain must be a box that is not sheared; received"):
        PackedBodies.from_result(run(Scene(particles=particles, domain=Open(), duration=1e-9)).check())


@pytest.mark.parametrize("reach", [0.3, 1.0, 3.7])
def test_all_images_within_reach_of_the_box(rng, reach):
    """Against a search of many images."""
    made = lattice("sc", 1)
    position = rng.uniform(-2, 3, (5, 3))
    packing = PackedBodies.of(made.shapes[0], position, (-1, 0, 1), (1, 1, 2.5), periodic=(True, False, True))
    places, index = packing.images(reach)
    steps = np.stack(np.meshgrid(np.arange(-5, 6), [0], np.arange(-5, 6), indexing="ij"), -1).reshape(
        -1, 1, 3
    )
    everywhere = (position + steps * packing.sides).reshape(-1, 3)
    near = (everywhere >= packing.low - reach) & (everywhere <= packing.high + reach) | ~np.array(
        packing.periodic
    )
    expected = everywhere[near.all(axis=1)]
    assert len(places) == len(expected)
    order, wanted = (np.lexsort(np.round(one, 9).T) for one in (places, expected))
    np.testing.assert_allclose(places[order], expected[wanted], atol=1e-12)
    np.testing.assert_allclose(index[order], (np.tile(np.arange(5), len(steps))[near.all(axis=1)])[wanted])
    inside = places[:5]
    assert ((inside >= packing.low) & (inside <= packing.high))[:, [0, 2]].all()
    np.testing.assert_array_equal(index[:5], np.arange(5))
