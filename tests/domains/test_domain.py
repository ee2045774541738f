"""The box: particles that leave through one face return through the opposite one, and meet
particles there."""

import numpy as np
import pytest

from tests.scenes import HEAT_CAPACITY, by_id, check_sums, compiled, scene, simulate
from tests.throwaway import SoftShell
from tisim import Box, GrainClass, InputError
from tisim.backend.taichi import ti
from tisim.effects import Heating, Impact
from tisim.engine.loading import check_sides, volume
from tisim.operators import InsertionByFlux
from tisim.packing import EqualSizes, UniformSizes
from tisim.steppers import FixedStep, Verlet


def run(scenes):
    return simulate(scenes, worlds=64, capacity=64)


BOX = Box(low=(-1.0, -2.0, -3.0), high=(1.0, 2.0, 4.0), images=False)


def drift(position, velocity, steps=1, domain=None):
    return scene(position, velocity, (), dt=1.0, steps=steps, domain=domain or BOX)


def test_particles_return_through_the_opposite_face(rng):
    """The position is on the straight line, modulo the sides; the velocity is equal bit for bit."""
    low, high = (np.asarray(x) for x in (BOX.low, BOX.high))
    r = rng.uniform(low, high, (60, 3))
    v = rng.normal(size=(60, 3)) * 10.0 ** rng.uniform(-1, 2, (60, 1))
    (result,) = run([drift(r, v)])
    state = by_id(result)
    np.testing.assert_array_equal(state["velocity"], v)
    expected = low + np.mod(r + v - low, high - low)
    np.testing.assert_allclose(state["position"], expected, rtol=0, atol=1e-13)
    assert (np.abs(r + v).max(axis=1) > 20).any(), "some must leave by several boxes"


def test_open_axes_continue_beyond_the_faces():
    """A particle may also start there, and one that moves on is wrapped along the other axes only."""
    box = Box(low=BOX.low, high=BOX.high, periodic=(True, False, True))
    place, speed = [[0.9, 1.9, -2.9], [0.0, -7.0, 0.0]], [[0.3, 5.0, -0.3], [0.0, -1e20, 0.0]]
    (result,) = run([drift(place, speed, domain=box)])
    assert result.status.ok, result.status.reason
    expected = [[-0.8, 6.9, 3.8], [0.0, -1e20, 0.0]]
    np.testing.assert_allclose(by_id(result)["position"], expected, rtol=0, atol=1e-14)


def test_positions_are_in_a_half_open_range():
    """Always low <= r < high: on the far face, just below the near one, at the last number inside."""
    low, high = (np.asarray(x) for x in (BOX.low, BOX.high))
    inside = np.nextafter(high, low)
    r = np.array([low, inside, low, low])
    v = np.array([high - low, np.zeros(3), [-1e-300] * 3, np.nextafter(0, -1) * np.ones(3)])
    (result,) = run([drift(r, v)])
    place = by_id(result)["position"]
    assert (place >= low).all()
    assert (place < high).all()
    np.testing.assert_array_equal(place[0], low)
    np.testing.assert_array_equal(place[1], inside)


def test_rounding_to_the_far_face_gives_the_near_face():
    """1 - 1e-300 rounds to 1, which is outside: the particle on the far face is put on the near one."""
    unit = Box(low=(0.0,) * 3, high=(1.0,) * 3, images=False)
    (result,) = run([drift(np.zeros((1, 3)), [[-1e-300, -1e-18, -1e-17]], domain=unit)])
    np.testing.assert_array_equal(result.state["position"], np.zeros((1, 3)))


def test_a_start_outside_the_box_is_refused():
    with pytest.raises(InputError, match=r"particles.position must be inside the domain; received"):
        run([drift([[5.0, 0, 0]], [[0.0, 0, 0]])])


def test_boxes_too_narrow_for_one_image_are_refused():
    """Each particle interacts with one image of another. A box without images, or an open one, may be
    narrower."""
    for settings in ({}, {"images": False}, {"periodic": (True, False, True)}):
        box = Box(low=(0.0,) * 3, high=(2.0, 1.0, 2.0), **settings)
        made = scene([[0.5] * 3, [1.5, 0.5, 0.5]], np.zeros((2, 3)), (Impact(hardness=1e9),), 0.3, domain=box)
        start = made.particles.arrays(box, 0)
        if settings:
            check_sides(made, start)
        else:
            with pytest.raises(
                InputError, match=r"box must be at least 1.2 m wide where it is periodic, twice"
            ):
                check_sides(made, start)


class FarShell(SoftShell):
    """A shell whose range grows with the radius of the larger grain."""

    @ti.func
    def reach(self, s, w, i):
        return self.width(w) * s.radius[w, i]


def test_the_volume_of_an_empty_scene_fits_the_largest_grain():
    """For every order of their classes."""
    classes = [GrainClass(sizes=EqualSizes(radius=radius), density=1.0) for radius in (0.1, 0.4)]
    for grains in (classes, classes[::-1]):
        coming = InsertionByFlux(flux=1.0, number=5, grains=grains, low=(0.0,) * 3, high=(9.0,) * 3)
        made = scene(np.zeros((0, 3)), np.zeros((0, 3)), (coming,))
        assert volume(made, made.start()) == pytest.approx(0.8**3)


@pytest.mark.slow
def test_the_box_must_be_wide_enough_for_inserted_grains():
    """Grains of 0.1 m are present, and grains of up to 0.4 m will be inserted: the box must have room for
    four radii and twice the interaction range."""

    def filled(side, width, number=5):
        coming = InsertionByFlux(
            flux=1.0,
            number=number,
            grains=[GrainClass(sizes=UniformSizes(by="number", smallest=0.1, largest=0.4), density=1.0)],
            low=(0.1,) * 3,
            high=(1.0,) * 3,
        )
        law = FarShell(stiffness=1.0, width=width)
        return scene(
            [[0.5] * 3, [1.0, 0.5, 0.5]], np.zeros((2, 3)), (law, coming), 0.1,
            domain=Box(low=(0.0,) * 3, high=(side,) * 3), dt=1e-3,
        )  # fmt: skip

    for made, least in ((filled(1.59, 0.1), 1.6), (filled(1.61, 0.1), 0), (filled(0.99, 0.1, 1), 1.0)):
        if least:
            with pytest.raises(InputError, match=f"^box must be at least {least:g} m wide where it is per"):
                check_sides(made, made.start())
        else:
            check_sides(made, made.start())
    simulation = compiled(filled(1.9, 0.3), 2, 8)
    simulation.load([filled(1.9, 0.3), filled(1.9, 0.3)])
    # 2 (0.4 + 0.4 + 0.4 width).
    with pytest.raises(
        InputError, match=r"box must be at least 1\.92 m wide .* range over which far_shell acts"
    ):
        simulation.load([filled(1.9, 0.3), filled(1.9, 0.4)])


@pytest.mark.slow
def test_contacts_cross_faces_only_with_images():
    """A periodic box with images has contacts across its faces; Z04's control volume has not."""
    place, speed = [[-0.9995, 0, 0], [0.9995, 0, 0]], [[-1.0, 0, 0], [1.0, 0, 0]]
    impacts = []
    for settings in ({}, {"images": False}, {"periodic": (False, True, True)}):
        box = Box(low=(-1.0,) * 3, high=(1.0,) * 3, **settings)
        (result,) = run([scene(place, speed, (Impact(hardness=1e9),), domain=box)])
        impacts.append(result.work["impacts"])
    assert impacts == [1, 0, 0]


@pytest.mark.slow
def test_two_wrapped_grains_collide_inside_the_box():
    """Both cross the face, one of them twice; after wrapping they overlap, and collide once there."""
    box = Box(low=(0.0,) * 3, high=(1.0,) * 3, images=False)
    place = [[0.9, 0.5, 0.5], [0.95, 0.5, 0.5]]
    # After one second: 0.1 + 2 and 0.1005 + 1; the first is faster, and behind.
    speed = [[1.2, 0, 0], [0.1515, 0, 0]]
    setup = scene(
        place,
        speed,
        (Impact(hardness=1e12), Heating(heat_capacity=HEAT_CAPACITY)),
        domain=box,
        stepper=Verlet(control=FixedStep(dt=1.0)),
        duration=1.0,
        quantities={"temperature": 300.0},
    )
    (result,) = run([setup])
    check_sums(result)
    assert result.work["impacts"] == 1
    np.testing.assert_allclose(by_id(result)["position"][:, 0], [0.1, 0.1015], atol=1e-12)
    assert by_id(result)["velocity"][0, 0] < by_id(result)["velocity"][1, 0]


@pytest.mark.parametrize("images", [False, True])
def test_too_many_crossings_in_a_step_are_a_clear_failure(images):
    """A step over 1e12 boxes leaves three digits of the position; one over 1e14 leaves one, and over 1e300
    none."""
    box = Box(low=(-1.0,) * 3, high=(1.0,) * 3, images=images)
    far, *others = run(
        [drift([[0.1, 0.2, 0.3]], [[v, 0, 0]], domain=box) for v in (1e12, 1e14, -1e14, 1e300)]
    )
    assert far.status.ok
    np.testing.assert_allclose(far.state["position"], [[0.1, 0.2, 0.3]], atol=1e-3)
    for result in others:
        assert not result.status.ok
        assert "rounding loses the place in the box, at particle 0" in result.status.reason
        np.testing.assert_array_equal(result.state["position"], result.start["position"])
