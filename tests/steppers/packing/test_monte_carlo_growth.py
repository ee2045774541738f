"""Monte Carlo growth: steps against a NumPy reference, the fluid of hard spheres, and packings."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.numerics.test_philox import reference
from tests.steppers.packing import test_energy_minimisation
from tests.steppers.packing.bits import same_bits
from tests.steppers.packing.test_energy_minimisation import axes_of, pair, width
from tests.steppers.packing.test_mechanical_contraction import (
    CUBOID,
    ELLIPSOID,
    ROD,
    SPHERE,
    deepest,
    fraction,
)
from tisim import InputError, Scene, Simulation, run
from tisim.effects import Gravity
from tisim.numerics.random_streams import TRIAL_MOVES
from tisim.steppers import MonteCarloGrowth

pytestmark = pytest.mark.long

ROUNDING = 1e-12
"""Bodies in contact overlap by rounding, in D."""
scene = partial(test_energy_minimisation.scene, stepper=MonteCarloGrowth)


def cube(seed, particle, step, draw):
    """A vector, uniform in a cube of side 1 around 0."""
    numbers = []
    for k in (draw, draw + 1):
        counter = (step & 0xFFFFFFFF, (step >> 32) ^ (k << 16), particle, TRIAL_MOVES)
        words = [int(word) for word in reference(counter, (seed & 0xFFFFFFFF, seed >> 32))]
        for high, low in (words[:2], words[2:]):
            numbers.append(((high >> 5) * 2**26 + (low >> 6) + 0.5) / 2**53)
    return np.array(numbers[:3]) - 0.5


def attempt(state, side, shape, length, rate, seed, step):
    """Positions, rotations and radii after a step, and the number of bodies that have moved."""
    x, radius, number = state["position"], state["radius"], len(state["radius"])
    before = Rotation.from_quat(state["orientation"], scalar_first=True)
    sizes = radius / shape.bounding_radius()
    unit = sizes[0] * width(shape)
    shift = length * unit * np.array([cube(seed, i, step, 0) for i in range(number)])
    turn = length * unit / radius[:, None] * np.array([cube(seed, i, step, 2) for i in range(number)])
    after = Rotation.from_rotvec(turn) * before
    states = before, after
    conflict, room, overlap = np.zeros(number, bool), np.inf, False
    for i in range(number):
        for j in range(i):
            d = x[j] - x[i]
            d -= side * np.round(d / side)
            if np.linalg.norm(d) > radius[i] + radius[j] + 2 * (np.sqrt(3) + rate) * length * unit:
                continue
            gaps, rooms = [], []
            for a, b in ((0, 0), (1, 0), (0, 1), (1, 1)):
                r = d + b * shift[j] - a * shift[i]
                gap, normal, _, _ = pair(r, states[a][i], states[b][j], sizes[i], sizes[j], shape)
                gaps.append(gap)
                rooms.append(gap / (r @ normal - gap))
            stays = min(gaps[1:]) < min(gaps[0], 0)
            conflict[[i, j]] |= stays
            overlap |= gaps[0] < 0
            room = min(room, rooms[0] if stays else min(rooms))
    moves = ~conflict[:, None]
    growth = 1.0 if overlap else 1 + min(rate * length * unit / radius.max(), 0.5 * room)
    turns = Rotation.from_rotvec(np.where(moves, turn, 0.0)) * before
    return (x + np.where(moves, shift, 0.0)) % side, turns, growth * radius, moves.sum()


@pytest.mark.parametrize(
    ("shape", "number"),
    [
        (ROD, 80),
        (SPHERE, 30),
        pytest.param(ELLIPSOID, 30, marks=pytest.mark.slow),
        pytest.param(CUBOID, 30, marks=pytest.mark.slow),
    ],
    ids=["rods", "spheres", "ellipsoids", "cuboids"],
)
def test_steps_equal_their_reference(shape, number):
    """From the overlaps of the start on, and later, while bodies grow."""
    rate = 0.01
    made = scene(shape, number, 0.15, spread=0.1, rate=rate, seed=5)
    side, simulation = made.domain.high[0], Simulation(made, 1)
    simulation.load([made])
    moved, grown, step = 0, 0, 0
    for growing in (False, True):
        while growing and (step < 300 or int(simulation.s.read("overlapping")[0])):
            simulation.run(steps=100)
            step += 100
        before = {name: np.array(simulation.state[name]) for name in ("position", "orientation", "radius")}
        length = float(simulation.s.read("trial_length")[0]) if growing else 0.1
        places, turns, radii, moves = attempt(before, side, shape, length, rate, 5, step)
        simulation.run(steps=1)
        step += 1
        off = np.array(simulation.state["position"]) - places
        np.testing.assert_allclose(off - side * np.round(off / side), 0, atol=1e-12)
        found = Rotation.from_quat(np.array(simulation.state["orientation"]), scalar_first=True)
        axes = [axes_of(one, shape) for one in (found, turns)]
        np.testing.assert_allclose(*axes, rtol=0, atol=1e-12)
        np.testing.assert_allclose(np.array(simulation.state["radius"]), radii, rtol=1e-12)
        moved, grown = moved + moves, grown + (radii[0] > before["radius"][0])
    assert moved > number / 5
    assert grown == 1
    simulation.close()


def distances(x, side):
    """The distances of all pairs."""
    d = x[:, None] - x[None]
    return np.linalg.norm(d - side * np.round(d / side), axis=-1)[np.triu_indices(len(x), 1)]


@pytest.mark.slow
def test_spheres_of_constant_size_are_a_fluid_of_hard_spheres():
    """Neighbours within a gap of 0.05 D at a packing fraction of 0.3, from the equation of state of Carnahan
    and Starling for the contact value g = (1 - f/2) / (1 - f)^3, and from Percus and Yevick for the slope,
    -9 f (1 + f) / (2 (1 - f)^3); both are accurate to 2 % here."""
    packed, number, width = 0.3, 200, 0.05
    made = scene(SPHERE, number, packed, rate=1e-12)
    side, simulation = made.domain.high[0], Simulation(made, 1)
    simulation.load([made])
    simulation.run(steps=3000)
    near = 0
    for _ in range(400):
        simulation.run(steps=40)
        distance = distances(np.array(simulation.state["position"]), side)
        assert distance.min() > 1 - ROUNDING
        near += (distance < 1 + width).sum()
    # Without growth spheres never jam, however long the run.
    assert simulation.s.read("jammed")[0] == 0
    simulation.close()
    contact, slope = (1 - packed / 2) / (1 - packed) ** 3, -4.5 * packed * (1 + packed) / (1 - packed) ** 3
    gap = np.linspace(0, width, 101)
    expected = 24 * packed * np.trapezoid((contact + slope * gap) * (1 + gap) ** 2, gap)
    assert 2 * near / 400 / number == pytest.approx(expected, rel=0.03)


@pytest.mark.slow
def test_spheres_pack_at_random_close_packing():
    made = scene(SPHERE, 100, precision=4e-3)
    result, side = run(made), made.domain.high[0]
    assert result.status.ok
    assert result.work["jammed"] == 1
    assert result.status.reason == "jammed: its bodies could not be brought closer"
    assert result.time < 1e6
    assert result.measures["packing_fraction"] == pytest.approx(fraction(result, SPHERE), rel=1e-9)
    assert 0.61 < fraction(result, SPHERE) < 0.65
    gaps = distances(result.state["position"], side) / (2 * result.state["radius"][0]) - 1
    assert -ROUNDING < gaps.min() < 1e-3


@pytest.mark.slow
def test_rods_pack_at_a_higher_density_than_spheres():
    shape = type(ROD)(length=0.5, diameter=1.0)
    made = scene(shape, 100)
    result = run(made)
    assert 0.67 < fraction(result, shape) < 0.75
    assert deepest(result.state, made.domain.high[0], shape, result.state["radius"][0]) < ROUNDING


@pytest.mark.slow
@pytest.mark.parametrize("shape", [ELLIPSOID, CUBOID], ids=["ellipsoids", "cuboids"])
def test_superquadrics_pack_at_a_higher_density_than_spheres(shape):
    made = scene(shape, 60, precision=1e-2)
    result = run(made)
    assert result.work["jammed"] == 1
    assert 0.64 < fraction(result, shape) < 0.78
    assert deepest(result.state, made.domain.high[0], shape, result.state["radius"][0]) < ROUNDING


@pytest.mark.slow
def test_the_bits_do_not_depend_on_batch_portions_or_checkpoint(tmp_path):
    scenes = [scene(ROD, 100 + k, 0.1, seed=k, duration=700.0) for k in range(3)]
    usual = same_bits(scenes, tmp_path, 417)
    assert usual[1].measures["packing_fraction"] > 0.15


@pytest.mark.slow
def test_a_run_that_never_removes_the_overlaps_of_its_start_fails():
    result = run(scene(ROD, 100, 0.3, duration=5.0))
    assert result.status.failed
    assert "overlaps of the start were not removed" in result.status.reason


def test_other_effects_are_refused():
    made = scene(ROD, 100)
    parts = {name: getattr(made, name) for name in ("particles", "domain", "duration", "stepper")}
    with pytest.raises(InputError, match=r"effects.gravity must be hard bodies alone, as monte_carlo_growth"):
        Scene(**parts, effects=[*made.effects, Gravity()])
