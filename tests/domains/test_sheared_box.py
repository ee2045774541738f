"""The box in simple shear: images, crossing particles, lists, files."""

import ase.io
import h5py
import numpy as np
import pytest

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.effects.contact.sheared import (
    ACROSS,
    ALONG,
    DT,
    MATERIALS,
    RATE,
    SIDES,
    STEPS,
    ShearedGrains,
    crowd,
    inside,
)
from tests.scenes import by_id, compiled, roundoff, scene
from tisim import Recording, ShearedBox
from tisim.accuracy.quantity import usual, velocity
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.io.export import export
from tisim.steppers import Boris, FixedStep, Verlet
from tisim.testing import assert_lists

WORLDS, CAPACITY = 2, 64
Array = ti.types.ndarray()
END = STEPS * DT
GROWTH = 5000
"""Factor by which contacts amplify rounding errors in a run, at most."""


def run(*scenes, schedule=None):
    """Run scenes side by side in the simulation that all tests share; return their results."""
    simulation = compiled(scenes[0], WORLDS, CAPACITY, schedule)
    simulation.load(scenes)
    simulation.run()
    results = simulation.results()
    for result in results:
        assert result.status.ok, result.status.reason
    return results


def assert_images(result, place, velocity):
    """Assert that the grains are at the images, inside the box, of these positions, with these velocities."""
    box, state, tolerance = result.scene.domain, by_id(result), GROWTH * roundoff()
    place, velocity = inside(box, place, velocity, result.time)
    sides = np.subtract(box.high, box.low)
    off = state["position"] - place
    # A grain on a face may be taken for its image on the opposite face.
    off -= sides * np.round(off / sides)
    assert np.abs(off).max() <= tolerance
    np.testing.assert_allclose(state["velocity"], velocity, rtol=0, atol=tolerance * np.abs(velocity).max())


@in_taichi_thread
@ti.kernel
def _images(domain: ti.template(), a: Array, b: Array, t: Array, out: Array):
    for w, k in ti.ndrange(WORLDS, a.shape[0]):
        here, there = ti.Vector([a[k, 0], a[k, 1], a[k, 2]]), ti.Vector([b[k, 0], b[k, 1], b[k, 2]])
        d = domain.nearest(w, here, there, t[k])
        for c in ti.static(range(3)):
            out[w, k, c] = d[c]


@pytest.mark.slow
def test_an_image_is_the_nearest_of_all(rng):
    """Of 75 images of each, computed in NumPy, at strains up to a thousand; in both directions."""
    made = [crowd(rng, rate=rate, low=-0.3) for rate in (RATE, -7.0)]
    simulation = compiled(made[0], WORLDS, CAPACITY)
    simulation.load(made)
    a, b = rng.uniform(0, 1, (2, 2000, 3)) * SIDES - 0.3
    time, out, back = rng.uniform(0, 500, 2000), np.zeros((WORLDS, 2000, 3)), np.zeros((WORLDS, 2000, 3))
    _images(simulation.assembly.domain, a, b, time, out)
    _images(simulation.assembly.domain, b, a, time, back)
    np.testing.assert_allclose(out, -back, rtol=0, atol=1e-11)
    for w, rate in enumerate((RATE, -7.0)):
        way = np.mod(rate * SIDES[ACROSS] * time, SIDES[ALONG])
        turns = np.stack(np.meshgrid(np.arange(-2, 3), [-1, 0, 1], np.arange(-2, 3)), -1).reshape(-1, 1, 3)
        images = b - a + turns * SIDES
        images[..., ALONG] += turns[..., ACROSS] * way
        which = np.linalg.norm(images, axis=2).argmin(axis=0)
        nearest = images[which, np.arange(2000)]
        near = np.linalg.norm(nearest, axis=1) < SIDES.min() / 2
        assert (turns[which, 0, ACROSS][near] != 0).sum() > 100
        # The error of rounded sides grows with the number of sides between a particle and the origin of its
        # image.
        passed = abs(rate) * SIDES[ACROSS] * time.max() / SIDES[ALONG]
        np.testing.assert_allclose(out[w, near], nearest[near], rtol=0, atol=passed * roundoff())


@pytest.mark.slow
def test_grains_in_shear_equal_an_unwrapped_reference(rng):
    """Two rates side by side, and a box of many cells; many grains cross the faces, and stick and slide
    across them. Momentum is conserved."""
    made = [crowd(rng, rate=rate, low=low) for rate, low in ((RATE, 0.0), (-20.0, -0.7))]
    wide = crowd(rng, rate=9.0, sides=2.3 * SIDES)
    for one, result in zip((*made, wide), (*run(*made), *run(wide)), strict=True):
        reference = ShearedGrains(one)
        momentum = reference.mass @ reference.v
        reference.run(STEPS, DT)
        assert min(reference.sliding, reference.sticking) > (100 if one is wide else 1000)
        beyond = np.floor((reference.x - one.domain.low) / reference.sides)[:, ACROSS]
        assert (beyond != 0).sum() > (0 if one is wide else 5)
        assert_images(result, reference.x, reference.v)
        atol = GROWTH * roundoff() * np.abs(reference.w).max()
        np.testing.assert_allclose(by_id(result)["spin"], reference.w, rtol=0, atol=atol)
        np.testing.assert_allclose(
            reference.mass @ reference.v, momentum, rtol=0, atol=1e-11 * np.abs(momentum).max()
        )


def flow(shift, rate=RATE):
    """The flow velocity, relative to the origin, at a position shifted by ``shift``."""
    return np.array([rate * shift[ACROSS], 0.0, 0.0])


def pair(shift, stepper=None):
    """Two touching grains in the middle of the box, moving with the flow there; or shifted to another
    position."""
    middle, apart = SIDES / 2, np.array([0.1, 0.4, 0.0])
    place, velocity = middle + np.outer([-0.5, 0.5], apart), np.array([[1.0, 3.0, 0.5], [-1.0, -3.0, 0.0]])
    place, velocity = place + shift, velocity + flow(shift)
    box = ShearedBox(low=(0, 0, 0), high=tuple(SIDES), rate=RATE)
    place, velocity = inside(box, place, velocity, 0.0)
    settings = {"radius": 0.25, "mass": 1.0, "dt": DT, "steps": STEPS, "domain": box}
    spin = {"spin": np.array([[1.0, 2.0, 30.0], [0.0, -5.0, 10.0]])}
    stepper = stepper or Verlet(control=FixedStep(dt=DT))
    return scene(
        place, velocity, (HERTZ_MINDLIN,), materials=MATERIALS, quantities=spin, stepper=stepper, **settings
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "stepper", [None, pytest.param(Boris(control=FixedStep(dt=DT)), marks=pytest.mark.slow)]
)
def test_a_pair_across_a_face_moves_as_in_the_middle(stepper):
    """It touches, sticks and separates as in the middle; the face lies between the two, or both cross it."""
    (there,) = run(pair(np.zeros(3), stepper))
    touched = by_id(there)
    assert np.abs(touched["velocity"] - there.start["velocity"]).max() > 1
    for shift in (np.array([0.3, 1.0, 0.2]), np.array([1.1, 0.8, 0.0]), np.array([0.0, -0.75, 0.0])):
        (here,) = run(pair(shift, stepper))
        place = touched["position"] + shift + flow(shift) * END
        assert_images(here, place, touched["velocity"] + flow(shift))
        for name in ("spin", "force"):
            atol = GROWTH * roundoff() * (1 + np.abs(touched[name]).max())
            np.testing.assert_allclose(by_id(here)[name], touched[name], rtol=0, atol=atol)


@pytest.mark.long
def test_compared_quantities_are_continuous_at_faces():
    """The velocity of a pair relative to the flow is the same at every position in the box, also after it has
    crossed a face."""
    (there,), (here,) = run(pair(np.zeros(3))), run(pair(np.array([0.0, -0.75, 0.0])))
    (quantity,) = usual(here.scene)
    assert quantity.name == "velocity relative to the flow"
    assert np.abs(velocity(here) - velocity(there)).max() > 1
    atol = GROWTH * roundoff() * np.abs(quantity.value(there)).max()
    np.testing.assert_allclose(quantity.value(here), quantity.value(there), rtol=0, atol=atol)


def layers(rate=RATE, steps=3000):
    """Layers of grains that follow the flow, and touch once a layer has slid far enough past the next."""
    sites = np.stack(np.meshgrid(*3 * [np.arange(4)], indexing="ij"), axis=-1).reshape(-1, 3)
    place = (sites + np.array([0.1, 0.5, 0.5])) * [0.7, 0.5, 0.7] + np.outer(
        sites[:, ACROSS] % 2, [0.35, 0, 0.02]
    )
    box = ShearedBox(low=(0, 0, 0), high=(2.8, 2.0, 2.8), rate=rate)
    velocity = np.outer(rate * (place[:, ACROSS] - 1.0), [1, 0, 0])
    settings = {"radius": 0.29, "mass": 1.0, "dt": DT, "steps": steps, "domain": box}
    return scene(
        place, velocity, (HERTZ_MINDLIN,), materials=MATERIALS, quantities={"spin": 0 * place}, **settings
    )


@pytest.mark.slow
@pytest.mark.parametrize("made", ["crowd", "sparse", "layers", "reverse"])
def test_lists_give_the_result_of_all_pairs(rng, made):
    """Also if grains move only with the flow, so that shear alone brings them together."""
    one = {
        "crowd": lambda: crowd(rng),
        "sparse": lambda: crowd(rng, sides=2.3 * SIDES, low=-1.0, rate=30.0, steps=1000),
        "layers": layers,
        "reverse": lambda: layers(-10.0),
    }[made]()
    simulation = compiled(one, WORLDS, CAPACITY)
    assert_lists(one, simulation)
    # The list lasts for several steps.
    simulation.load([one])
    column, times = simulation.assembly.pairs.half_list.made, set()
    for _ in range(30):
        simulation.run(steps=1)
        times.add(float(in_taichi_thread(column.to_numpy)()[0]))
    assert len(times) < 10


def test_a_restart_keeps_the_positions_of_images(rng, tmp_path):
    """The same bits as without a restart, alone or beside another world."""
    one, other = crowd(rng), crowd(rng, rate=-1.0, n=40)
    whole, _ = run(one, other)
    (alone,) = run(one)
    simulation = compiled(one, WORLDS, CAPACITY)
    simulation.load([one])
    simulation.run(until=0.37 * END)
    simulation.checkpoint(tmp_path / "c.h5")
    simulation.load([one])
    simulation.restore(tmp_path / "c.h5")
    simulation.run()
    for name, values in whole.state.items():
        np.testing.assert_array_equal(values, alone.state[name], err_msg=name)
        np.testing.assert_array_equal(values, simulation.results()[0].state[name], err_msg=name)


@pytest.mark.slow
def test_both_schedules_have_the_same_bits(rng):
    made = crowd(rng), layers()
    for one, other in zip(run(*made, schedule="world"), run(*made, schedule="particle"), strict=True):
        for name, values in one.state.items():
            np.testing.assert_array_equal(values, other.state[name], err_msg=name)


@pytest.mark.slow
def test_any_two_axes_can_be_sheared(rng):
    """The same grains with x, y and z permuted to z, x and y; the third axis need not be periodic."""
    turned, other = [1, 2, 0], crowd(rng)
    start = other.particles.arrays(other.domain, 0)
    box = ShearedBox(low=(0,) * 3, high=tuple(SIDES[turned]), rate=RATE, flow="z", gradient="x")
    same = crowd(rng, domain=box)
    particles = same.particles.model_copy(
        update={
            **{name: start[name][:, turned] for name in ("position", "velocity")},
            **{name: start[name] for name in ("radius", "mass")},
            "quantities": {"spin": start["spin"][:, turned]},
        }
    )
    (here,), (there,) = run(same.model_copy(update={"particles": particles})), run(other)
    for name in ("position", "velocity", "spin"):
        values = by_id(there)[name][:, turned]
        atol = GROWTH * roundoff() * np.abs(values).max()
        np.testing.assert_allclose(by_id(here)[name], values, rtol=0, atol=atol)


def test_files_have_the_positions_of_images(rng, tmp_path):
    """Both H5MD, as box edges, and extended XYZ, for each frame. They give the position of an image."""
    made, path = crowd(rng), tmp_path / "t.h5"
    simulation = compiled(made, WORLDS, CAPACITY)
    simulation.load([made])
    with Recording(path, frames=4).observer(simulation) as recorder:
        simulation.run(observers=[recorder])
    with h5py.File(path) as file:
        box, position = file["particles/all/box"], file["particles/all/position"]
        assert box.attrs["boundary"].tolist() == [b"periodic"] * 3
        edges, times = box["edges/value"][...], position["time"][...]
        assert box["edges/time"] == position["time"]
    assert edges.shape == (5, 3, 3)
    way = RATE * SIDES[ACROSS] * times
    sheared = way - SIDES[ALONG] * np.round(way / SIDES[ALONG])
    np.testing.assert_allclose(edges[:, ACROSS, ALONG], sheared, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(edges[:, [0, 1, 2], [0, 1, 2]], np.tile(SIDES, (5, 1)))
    for atoms, rows in zip(ase.io.read(export(path, "xyz", tmp_path), index=":"), edges, strict=True):
        np.testing.assert_array_equal(atoms.cell[...], rows)
