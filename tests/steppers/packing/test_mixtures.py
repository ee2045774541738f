"""Packings of rods, spheres and superquadrics together."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.steppers.packing.bits import same_bits
from tests.steppers.packing.test_mechanical_contraction import (
    CUBOID,
    ELLIPSOID,
    ROD,
    SPHERE,
    attempt,
    contact,
)
from tisim import Box, InputError, Particles, Scene, Simulation, run
from tisim.analysis import near_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.effects import Confinement, HardMixture, HardRods
from tisim.geometry import BoxContainer, CylindricalContainer
from tisim.steppers import EnergyMinimisation, MechanicalContraction, MonteCarloGrowth

SHAPES = (ROD, SPHERE, CUBOID, ELLIPSOID)
BODIES = HardMixture(rods=SHAPES[:2], superquadrics=SHAPES[2:])
REVISED = {"method": "revised", "volume_step": 2.0, "motion": 0.5, "attempts": 50}


def mixed(number, fraction, stepper, *others, duration=1e6, periodic=(True, True, True), bodies=BODIES):
    """Bodies of all shapes in turn at random places of a cubic box, where they may overlap, or on a grid for
    growth."""
    shapes = bodies.shapes()
    kinds = np.arange(number) % len(shapes)
    side = (sum(shapes[k].volume() for k in kinds) / fraction) ** (1 / 3)
    places = np.random.default_rng(0).uniform(0, side, (number, 3))
    if isinstance(stepper, MonteCarloGrowth):
        places = (
            side * (np.stack(np.meshgrid(*[np.arange(5)] * 3), axis=-1).reshape(-1, 3)[:number] + 0.5) / 5
        )
    return Scene(
        particles=Particles.of_shapes(shapes, places, 1.0, shape=kinds),
        effects=[bodies, *others],
        domain=Box(low=(0, 0, 0), high=(side, side, side), periodic=periodic),
        duration=duration,
        stepper=stepper,
    )


SPHERES_AND_CUBOIDS = HardMixture(rods=(SPHERE,), superquadrics=(CUBOID,))


@pytest.mark.parametrize(
    "bodies",
    [
        pytest.param(BODIES, id="four shapes"),
        pytest.param(SPHERES_AND_CUBOIDS, id="spheres and cuboids", marks=pytest.mark.slow),
    ],
)
def test_an_attempt_equals_its_reference(bodies):
    """Until the first contraction, from deep overlaps on."""
    made, kinds = mixed(48, 0.08, MechanicalContraction(method="revised"), bodies=bodies), bodies.shapes()
    shapes = [kinds[k] for k in made.start()["shape"].astype(int)]
    side, simulation = made.domain.high[0], Simulation(made, 1)
    simulation.load([made])
    moved = np.zeros(len(kinds))
    for _ in range(2):
        before = {name: np.array(simulation.state[name]) for name in ("position", "orientation")}
        places, orientations = attempt(before, side, shapes, "revised")
        simulation.run(steps=1)
        after = {name: np.array(simulation.state[name]) for name in before}
        np.testing.assert_allclose(after["position"], places, rtol=0, atol=1e-10)
        found = Rotation.from_quat(after["orientation"], scalar_first=True).as_matrix()
        np.testing.assert_allclose(found[:, :, 2], orientations[:, :, 2], rtol=0, atol=1e-10)
        for k in range(len(kinds)):
            change = np.abs(after["position"] - before["position"])[k :: len(kinds)]
            moved[k] = max(moved[k], change.max())
    assert (moved > 0.01).all()
    simulation.close()


def test_pairs_are_those_of_spheres_for_spheres_alone():
    rods = (HardRods(rods=(SPHERE,)), HardRods(rods=(SPHERE, ROD)))
    assert [one.spheres for one in (*rods, BODIES, SPHERES_AND_CUBOIDS)] == [True, False, False, False]
    assert rods[0].structure() != HardRods(rods=(ROD,)).structure(), "they are not in one batch"


def deepest(result):
    """The deepest overlap over D of the first shape, from all pairs, and the number of pairs of a rod and a
    superquadric that touch."""
    state, side = result.state, result.scene.domain.high[0]
    kinds = state["shape"].astype(int)
    scale = float((state["radius"] / np.array([one.bounding_radius() for one in SHAPES])[kinds])[0])
    turns = Rotation.from_quat(state["orientation"], scalar_first=True)
    depths, unlike = [], 0
    imaged = np.array(result.scene.domain.imaged())
    for i in range(len(kinds)):
        d = state["position"][:i] - state["position"][i]
        d -= np.where(imaged, side * np.round(d / side), 0)
        for j in np.flatnonzero(np.linalg.norm(d, axis=1) < state["radius"][:i] + state["radius"][i]):
            both = SHAPES[kinds[i]], SHAPES[kinds[j]]
            depths.append(contact(both, d[j], turns[i], turns[j], scale)[0] / scale)
            unlike += depths[-1] > -0.01 and (kinds[i] < 2) != (kinds[j] < 2)
    return max(depths), unlike


@pytest.mark.slow
@pytest.mark.parametrize(
    "stepper",
    [MechanicalContraction(**REVISED), EnergyMinimisation(), MonteCarloGrowth()],
    ids=["contraction", "minimisation", "growth"],
)
def test_a_packing_has_no_overlaps(stepper):
    grows = isinstance(stepper, MonteCarloGrowth)
    result = run(mixed(80, 0.04 if grows else 0.2, stepper, duration=500.0 if grows else 1e6))
    assert result.status.ok, result.status.reason
    depth, unlike = deepest(result)
    assert depth <= 1.01e-4
    bodies = PackedBodies.from_result(result)
    packed = float(bodies.volumes().sum() / bodies.box_volume)
    assert packed == pytest.approx(result.measures["packing_fraction"], rel=1e-9)
    assert packed > 0.05
    if not grows:
        assert 0.45 < packed < 0.75
        assert unlike > 50
    # The measures of packings find the same deepest overlap.
    assert -near_gaps(bodies, 0.1).gap.min() / bodies.scale[0] == pytest.approx(depth, abs=1e-9)


@pytest.mark.slow
def test_bodies_stay_between_plane_walls():
    walls = Confinement(container=BoxContainer(hard=(False, False, True)))
    stepper = MechanicalContraction(**REVISED)
    result = run(mixed(80, 0.15, stepper, walls, periodic=(True, True, False)))
    assert result.status.ok, result.status.reason
    state = result.state
    turns = Rotation.from_quat(state["orientation"], scalar_first=True)
    kinds = state["shape"].astype(int)
    scale = state["radius"][0] / SHAPES[kinds[0]].bounding_radius()
    down = turns.apply([0, 0, -1.0], inverse=True)
    reach = scale * np.array([SHAPES[k].support(n) @ n for k, n in zip(kinds, down, strict=True)])
    high, z = result.scene.domain.high[2], state["position"][:, 2]
    assert min((z - reach).min(), (high - z - reach).min()) > -1.01e-4 * scale
    assert deepest(result)[0] <= 1.01e-4


def test_curved_walls_are_refused():
    walls = Confinement(container=CylindricalContainer(diameter=5.0))
    stepper = MechanicalContraction(method="revised")
    with pytest.raises(InputError, match="rods or spheres in a cylindrical_container, as round ends touch"):
        mixed(40, 0.1, stepper, walls, periodic=(False, False, True))


@pytest.mark.slow
def test_the_bits_do_not_depend_on_batch_portions_or_checkpoint(tmp_path):
    stepper = MechanicalContraction(**REVISED)
    scenes = [mixed(48 + 4 * k, 0.1, stepper, duration=60.0) for k in range(3)]
    same_bits(scenes, tmp_path, 17)
