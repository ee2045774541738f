"""Rods and superquadrics in one scene: collisions, heaps and starts, against NumPy references."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.effects.constraint.shapes import (
    BALL,
    BRICK,
    EGG,
    LYING,
    ROD,
    D,
    energy,
    gap_beside_rod,
    momentum,
    moving,
    reference,
    whole_momentum,
)
from tests.effects.constraint.test_rigid_shapes import (
    ELASTIC,
    FLOOR,
    USUAL,
    WEIGHT,
    colliding,
    material,
    turned_apart,
)
from tests.scenes import by_id, compiled, simulate
from tisim import Box, InputError
from tisim.effects import Granular, HertzMaterial, MindlinForce, RestitutionDamping, RigidMixture

pytestmark = pytest.mark.long
BOTH = {"shape": [0, 1]}
STICKING = Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce())
END_ON = Rotation.from_rotvec([[0.1, 1.4, 0.2], [0.3, 0.2, 0.9]]).as_quat(scalar_first=True)
PAIRS = {
    "side of a rod on an ellipsoid": ((ROD, EGG), {}),
    "side of a rod on a brick": ((ROD, BRICK), {}),
    "end of a rod on an ellipsoid": ((ROD, EGG), {"orientation": END_ON}),
    "sphere on a brick": ((BALL, BRICK), {}),
}


def meeting(name, dt=1e-6, law=ELASTIC, **more):
    """A rod and a superquadric that collide off centre, spinning."""
    shapes, given = PAIRS[name]
    made = colliding(shapes, law, dt, **BOTH, **given, **more)
    if name.startswith("end") or shapes[0] is BALL:
        place = [(-2.5e-3, 0, 0), (1.5e-3, 0.3e-3, 0.2e-3)]
        particles = made.particles.model_copy(update={"position": np.array(place)})
        made = made.model_copy(update={"particles": particles})
    return made


@pytest.mark.parametrize(
    "name",
    ["side of a rod on an ellipsoid", pytest.param("end of a rod on an ellipsoid", marks=pytest.mark.slow)],
)
def test_a_rod_and_a_superquadric_collide_as_in_a_numpy_reference(name):
    shapes, errors = PAIRS[name][0], []
    effective = USUAL["young"] / (2 * (1 - USUAL["poisson"] ** 2))
    radius = 1 / sum(1 / one.contact_radius() for one in shapes)

    def push(overlap):
        return 4 / 3 * effective * np.sqrt(radius) * overlap**1.5

    made = meeting(name)
    x, v, q, momenta, _ = reference(made, shapes, push, 4e-3, contact=gap_beside_rod)
    assert np.abs(v - made.start()["velocity"]).max(axis=1).min() > 0.1
    for dt in (1e-5, 2.5e-6):
        (result,) = simulate([meeting(name, dt)])
        state = by_id(result)
        parts = (
            np.abs(state["position"] - x).max() / D,
            np.abs(state["velocity"] - v).max() / 0.3,
            max(turned_apart(p, r) for p, r in zip(state["orientation"], q, strict=True)),
            np.abs(state["angular_momentum"] - momenta).max() / np.abs(momenta).max(),
        )
        errors.append(max(parts))
    assert errors[0] < 5e-4
    # A method of first order would give a quarter.
    assert errors[1] < 0.2 * errors[0]


@pytest.mark.parametrize("name", PAIRS)
def test_an_elastic_collision_keeps_energy_momentum_and_angular_momentum(name):
    errors = []
    for dt in (2e-6, 1e-6, 5e-7):
        (result,) = simulate([meeting(name, dt)])
        start, end = result.start, result.state
        size = np.abs(start["mass"][:, None] * start["velocity"]).sum()
        np.testing.assert_allclose(momentum(end), momentum(start), rtol=0, atol=1e-14 * size)
        np.testing.assert_allclose(whole_momentum(end), whole_momentum(start), rtol=0, atol=1e-12 * size * D)
        assert np.abs(end["velocity"] - start["velocity"]).max() > 0.1
        assert np.abs(end["spin"] - start["spin"]).max() > 10
        errors.append(abs(energy(end) / energy(start) - 1))
    assert errors[0] < 2e-5
    assert max(errors[1:]) < 5e-6


@pytest.mark.slow
def test_friction_keeps_momentum_and_angular_momentum():
    (result,) = simulate([meeting("side of a rod on a brick", law=STICKING)])
    start, end = result.start, result.state
    size = np.abs(start["mass"][:, None] * start["velocity"]).sum()
    np.testing.assert_allclose(momentum(end), momentum(start), rtol=0, atol=1e-14 * size)
    np.testing.assert_allclose(whole_momentum(end), whole_momentum(start), rtol=0, atol=1e-12 * size * D)
    assert 0.2 < energy(end) / energy(start) < 0.9


@pytest.mark.slow
@pytest.mark.parametrize("shape", [ROD, BRICK], ids=["rods", "bricks"])
def test_bodies_of_one_family_collide_as_in_a_scene_of_their_own(shape):
    """With friction, and on a floor; the mixture has a shape of the other family that no body takes."""
    others = (shape, EGG) if shape is ROD else (BALL, shape)
    index = others.index(shape)
    alone = colliding(shape, STICKING)
    mixed = colliding(others, STICKING, shape=[index, index])
    (one,), (other,) = simulate([alone]), simulate([mixed])
    assert np.abs(one.state["velocity"] - one.start["velocity"]).max() > 0.1
    for name in ("position", "velocity", "spin", "orientation"):
        scale = np.abs(one.state[name]).max()
        np.testing.assert_allclose(other.state[name], one.state[name], rtol=0, atol=1e-9 * scale)


@pytest.mark.slow
def test_all_bodies_come_to_rest_on_a_floor():
    """A rod lies on both ends, a brick on its largest face, a sphere and an ellipsoid on one point.

    The ellipsoid starts with its shortest axis upright: nothing damps the rocking of one that leans.
    """
    shapes = (ROD, BALL, EGG, BRICK)
    lean = Rotation.from_rotvec(
        [[0, np.pi / 2 - 0.2, 0], [0, 0, 0], [np.pi / 2, 0, 0], [np.pi / 2 - 0.2, 0, 0]]
    )
    place = np.column_stack([8e-3 * np.arange(4), np.zeros(4), [1.2e-3, 1.01e-3, 0.71e-3, 1.3e-3]])
    made = moving(
        shapes, place, (STICKING, WEIGHT, FLOOR), 2e-6, 300_000, shape=np.arange(4), materials=material(),
        orientation=lean.as_quat(scalar_first=True),
    )  # fmt: skip
    (result,) = simulate([made])
    assert result.status.ok, result.status.reason
    state = by_id(result)
    weight = state["mass"].sum() * 9.81
    assert result.measures["walls_force_z"] == pytest.approx(-weight, rel=1e-2)
    rod = Rotation.from_quat(state["orientation"][0], scalar_first=True).apply([0, 0, 1])
    face = Rotation.from_quat(state["orientation"][3], scalar_first=True).apply([0, 1, 0])
    assert abs(rod[2]) < 1e-4
    assert abs(face[2]) > 1 - 1e-4
    heights = state["position"][:, 2]
    np.testing.assert_allclose(heights, [D / 2, D, EGG.semi_axes[1], BRICK.semi_axes[1]], rtol=5e-3)


@pytest.mark.slow
def test_a_rod_lies_across_two_fixed_bricks():
    """It stays at rest, with half of its weight on each."""
    upright = Rotation.from_rotvec([np.pi / 2, 0, 0]).as_quat(scalar_first=True)
    top = BRICK.semi_axes[1]
    made = moving(
        (ROD, BRICK), [(-1.2 * D, 0, 0), (1.2 * D, 0, 0), (0, 0, top + 0.505 * D)], (STICKING, WEIGHT), 2e-6,
        50_000, orientation=[upright, upright, LYING], shape=[1, 1, 0], quantities={"fixed": [1, 1, 0]},
        materials=material(),
    )  # fmt: skip
    (result,) = simulate([made])
    assert result.status.ok, result.status.reason
    state = by_id(result)
    np.testing.assert_array_equal(state["position"][:2], made.particles.position[:2])
    assert top + 0.49 * D < state["position"][2, 2] < top + 0.5 * D
    assert np.abs(state["velocity"][2]).max() < 1e-4
    axis = Rotation.from_quat(state["orientation"][2], scalar_first=True).apply([0, 0, 1])
    assert abs(axis[2]) < 1e-3


def heap(seed=1, steps=2000):
    """Bodies of four shapes that fall into a periodic box with a floor."""
    rng = np.random.default_rng(seed)
    apart = 4.5e-3
    place = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), -1).reshape(-1, 3) * apart
    place = place + rng.normal(size=place.shape) * 2e-4 + [0, 0, apart / 2]
    place[:, :2] %= 3 * apart
    box = Box(low=(0, 0, 0), high=(3 * apart,) * 3, periodic=(True, True, False))
    return moving(
        (ROD, BALL, EGG, BRICK), place, (STICKING, WEIGHT, FLOOR), 2e-6, steps, shape=rng.integers(0, 4, 27),
        orientation=Rotation.random(27, rng=rng).as_quat(scalar_first=True), materials=material(),
        velocity=rng.normal(size=place.shape) * 0.4, domain=box,
    )  # fmt: skip


@pytest.mark.slow
def test_runs_have_the_same_bits_by_any_schedule_in_a_batch_and_restarted(tmp_path):
    made = heap()
    (whole,) = simulate([made], 2, schedule="world")
    assert whole.status.ok, whole.status.reason
    (other,) = simulate([made], 2, schedule="particle")
    _, batched = simulate([heap(2), made], 2, schedule="world")
    half = compiled(made, 2, schedule="world")
    half.load([made])
    half.run(steps=900)
    half.checkpoint(tmp_path / "half.h5")
    half.load([made])
    half.restore(tmp_path / "half.h5")
    half.run()
    assert np.abs(whole.state["velocity"] - whole.start["velocity"]).max() > 0.1
    for again in (other, batched, half.results()[0]):
        for field, values in whole.state.items():
            np.testing.assert_array_equal(again.state[field], values, err_msg=field)


def test_shapes_are_numbered_with_rods_first():
    """A start has the bounding radii and masses of the shapes in this order."""
    law = RigidMixture(rods=(ROD, BALL), superquadrics=(EGG, BRICK))
    assert list(law.shapes()) == [ROD, BALL, EGG, BRICK]
    made = moving((ROD, BALL, EGG, BRICK), 0.1 * np.eye(4)[:, :3], shape=np.arange(4))
    (result,) = simulate([made])
    moments = [one.moments() * mass for one, mass in zip(law.shapes(), made.particles.mass, strict=True)]
    turned = moving(
        (ROD, BALL, EGG, BRICK), 0.1 * np.eye(4)[:, :3], shape=np.arange(4), orientation=(1, 0, 0, 0),
        angular_velocity=(1.0, 2.0, 3.0),
    )  # fmt: skip
    np.testing.assert_allclose(
        turned.start()["angular_momentum"], moments * np.array([1.0, 2.0, 3.0]), rtol=1e-12
    )
    assert result.status.ok
    with pytest.raises(InputError, match="rods must be"):
        RigidMixture(rods=(), superquadrics=(EGG,))
    with pytest.raises(InputError, match="particles must be held by one of rigid_mixture, rigid_rods"):
        simulate([made.model_copy(update={"effects": (law, *moving(ROD, [(0, 0, 0)]).effects)})])
