"""The sum over many cylinders by cells has its stated accuracy, everywhere and in every world."""

import magpylib
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.sources.fields import fields
from tisim import InputError, Particles, Scene, run
from tisim.operators import Capture
from tisim.sources import Cylinder, MagneticCylinders, sample
from tisim.sources.magnetic import cell_sum, cylinder_rows
from tisim.sources.magnetic.local_expansions import gaps
from tisim.steppers import FixedStep, Verlet

SATURATION = 985e3
FIBRE = {"radius": 2e-4, "length": 4e-3}
SIDE = 8e-3


def fibres(rng, n, side=SIDE, **shape):
    """Fibres in any direction, with centres in a cube, in all degrees of touching and overlapping."""
    return tuple(
        Cylinder(
            centre=rng.uniform(-side / 2, side / 2, 3),
            axis=rng.normal(size=3),
            magnetisation=SATURATION * rng.normal(size=3),
            **{**FIBRE, **shape},
        )
        for _ in range(n)
    )


def about(rng, cylinders, n=400):
    """Points among cylinders and outside of all, inside them, next to their surfaces and their rims."""
    among = rng.uniform(-SIDE, SIDE, (n, 3))
    chosen = rng.integers(0, len(cylinders), n)
    axis = np.array([c.direction for c in cylinders])[chosen]
    centre = np.array([c.centre for c in cylinders])[chosen]
    across = np.cross(axis, rng.normal(size=(n, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    radius, half = np.array([(c.radius, c.length / 2) for c in cylinders])[chosen].T[:, :, None]
    along = rng.uniform(-1, 1, (n, 1))
    inside = centre + along * half * axis + rng.uniform(0, 1, (n, 1)) * radius * across
    touching = centre + along * half * axis + (1 + rng.choice([-1e-9, 1e-9, 1e-3], (n, 1))) * radius * across
    rims = centre + half * axis + radius * across + radius * 10 ** rng.uniform(-6, -1, (n, 1)) * across
    outside = rng.normal(size=(n, 3)) * 10 * SIDE
    return np.concatenate([among, inside, touching, rims, outside])


def typical(cylinders):
    """The mean magnitudes of field and gradient between the cylinders."""
    return cell_sum._typical(cylinder_rows.rows(cylinders), *cell_sum._region(cylinders))


def errors(cylinders, points, **ways):
    """The largest errors of field and gradient, over their mean magnitudes."""
    direct, by_cells = MagneticCylinders(cylinders=cylinders), MagneticCylinders(cylinders=cylinders, **ways)
    expected = sample([direct], direct.quantity, points)
    found = sample([by_cells], direct.quantity, points)
    return [
        np.linalg.norm((a - b).reshape(len(points), -1), axis=1).max() / size
        for a, b, size in zip(found, expected, typical(cylinders), strict=True)
    ]


@pytest.mark.long
@pytest.mark.parametrize("digits", [2, *(pytest.param(n, marks=pytest.mark.slow) for n in (3, 4))])
def test_the_sum_has_its_stated_accuracy(digits, rng):
    """At places of all kinds; and the error is not more than a thousand times below the bound."""
    cylinders = fibres(rng, 25)
    of_b, of_slope = errors(cylinders, about(rng, cylinders), sum_digits=digits)
    assert 10.0 ** -(digits + 3) < of_b < 10.0**-digits
    assert 10.0 ** -(digits + 3) < of_slope < 10.0**-digits


def test_fibres_of_different_shapes(rng):
    """Long, short and flat ones, of different radii."""
    cylinders = (*fibres(rng, 8), *fibres(rng, 6, radius=8e-4, length=2e-3), *fibres(rng, 3, length=5e-5))
    assert max(errors(cylinders, about(rng, cylinders), sum_digits=3)) < 1e-3


@pytest.mark.slow
def test_with_tabulated_ends(rng):
    """Near cylinders are read from the table; their relative error adds to the error of the cells."""
    cylinders = fibres(rng, 12)
    points = about(rng, cylinders)[:400]
    direct = MagneticCylinders(cylinders=cylinders)
    both = MagneticCylinders(cylinders=cylinders, sum_digits=3, table_digits=3)
    b, expected = (sample([one], one.quantity, points)[0] for one in (both, direct))
    each = [MagneticCylinders(cylinders=(one,)) for one in cylinders]
    size = sum(np.linalg.norm(sample([one], one.quantity, points)[0], axis=1) for one in each)
    off = np.linalg.norm(b - expected, axis=1)
    assert (off < 1e-3 * (typical(cylinders)[0] + size)).all()
    assert off.max() > 1e-7 * typical(cylinders)[0]


@pytest.mark.slow
def test_worlds_with_different_fibres(rng):
    """Worlds of a batch with other numbers of fibres equal worlds alone to the last bit; a world without
    fibres has no field."""
    worlds = [fibres(rng, n) for n in (20, 0, 5, 11)]
    sources = [MagneticCylinders(cylinders=one, sum_digits=3) for one in worlds]
    assert len({source.structure() for source in sources}) == 1
    points = rng.uniform(-SIDE, SIDE, (4, 200, 3))
    b, slope = fields(sources, points)
    for w in (0, 2, 3):
        alone = fields([sources[w]], points[w : w + 1])
        np.testing.assert_array_equal(b[w], alone[0][0])
        np.testing.assert_array_equal(slope[w], alone[1][0])
        expected = sample([MagneticCylinders(cylinders=worlds[w])], sources[w].quantity, points[w])
        size = typical(worlds[w])
        assert np.linalg.norm(b[w] - expected[0], axis=1).max() < 1e-3 * size[0]
        assert np.linalg.norm(slope[w] - expected[1], axis=(1, 2)).max() < 1e-3 * size[1]
    assert (b[1] == 0).all()


@pytest.mark.slow
def test_laws_of_maxwell_and_differences(rng):
    """The gradient is symmetric and traceless, and equals differences of the field within a cell."""
    cylinders = fibres(rng, 15)
    source = MagneticCylinders(cylinders=cylinders, sum_digits=3)
    points = rng.uniform(-SIDE, SIDE, (300, 3))
    _, slope = sample([source], source.quantity, points)
    size = np.linalg.norm(slope, axis=(1, 2))
    assert (np.abs(np.trace(slope, axis1=1, axis2=2)) <= 1e-13 * size).all()
    assert (np.abs(slope - np.swapaxes(slope, 1, 2)).max(axis=(1, 2)) <= 1e-13 * size).all()
    step = 1e-9
    up, down = (
        [sample([source], source.quantity, points + s * step * np.eye(3)[c])[0] for c in range(3)]
        for s in (1, -1)
    )
    difference = (np.stack(up, axis=-1) - np.stack(down, axis=-1)) / (2 * step)
    assert np.median(np.linalg.norm(difference - slope, axis=(1, 2)) / size) < 1e-5


def test_beside_an_independent_library(rng):
    cylinders = fibres(rng, 12)
    points = rng.uniform(-SIDE, SIDE, (500, 3))
    expected = np.zeros_like(points)
    for one in cylinders:
        turned = Rotation.align_vectors([one.axis], [[0, 0, 1]])[0]
        expected += magpylib.magnet.Cylinder(
            magnetization=turned.inv().apply(one.magnetisation),
            dimension=(2 * one.radius, one.length),
            position=one.centre,
            orientation=turned,
        ).getB(points)
    source = MagneticCylinders(cylinders=cylinders, sum_digits=4)
    b, _ = sample([source], source.quantity, points)
    assert np.linalg.norm(b - expected, axis=1).max() < 1e-4 * typical(cylinders)[0]


def test_a_full_list_of_near_cylinders(rng, monkeypatch):
    """Leaves whose near cylinders have no room sum all cylinders directly."""
    cylinders = fibres(rng, 10)
    cell_sum._octree.cache_clear()
    monkeypatch.setattr(cell_sum, "NEAR_PER_LEAF", 1)
    assert max(errors(cylinders, about(rng, cylinders), sum_digits=3)) < 1e-3
    cell_sum._octree.cache_clear()


@pytest.mark.slow
def test_tolerances_are_lowered_until_the_error_is_small(rng, monkeypatch):
    cylinders = fibres(rng, 10)
    cell_sum._octree.cache_clear()
    monkeypatch.setattr(cell_sum, "FIRST_TOLERANCE", 3.0)
    assert max(errors(cylinders, about(rng, cylinders), sum_digits=3)) < 1e-3
    cell_sum._octree.cache_clear()
    monkeypatch.setattr(cell_sum, "TRIES", 1)
    with pytest.raises(InputError, match=r"^sum_digits must be fewer for these cylinders in f(32|64);"):
        errors(cylinders, about(rng, cylinders), sum_digits=3)


def test_distances_from_surfaces():
    numbers = cylinder_rows.rows([Cylinder(radius=1.0, length=4.0)])
    places = np.array([[3.0, 0, 0], [0, 0, 5], [4, 0, 6], [0.5, 0, 0], [0, 0, 1.9]])
    np.testing.assert_allclose(gaps(numbers, places, np.zeros(5, int)), [2, 3, 5, -0.5, -0.1], rtol=1e-6)


def test_approximations_for_tisim_cost(rng):
    """The coarsest first; few cylinders are summed one by one. A source with digits is compared with the
    others, up to the exact one."""
    ways = MagneticCylinders(cylinders=fibres(rng, 10)).approximations(1.0)
    assert [(one.table_digits, one.sum_digits) for one in ways] == [
        (3, None), (3, 3), (None, 3), (4, None), (4, 4), (None, 4), (5, None), (5, 5), (None, 5),
    ]  # fmt: skip
    few = MagneticCylinders(cylinders=fibres(rng, 2)).approximations(1.0)
    assert [(one.table_digits, one.sum_digits) for one in few] == [(3, None), (4, None), (5, None)]
    by_cells = MagneticCylinders(cylinders=fibres(rng, 12), sum_digits=3).approximations(1.0)
    assert [(one.table_digits, one.sum_digits) for one in by_cells] == [
        (3, None), (3, 3), (4, None), (4, 4), (None, 4), (5, None), (5, 5), (None, 5), (None, None),
    ]  # fmt: skip


def in_this_precision():
    """The larger error of field and gradient with three and with four digits."""
    rng = np.random.Generator(np.random.Philox(3))
    cylinders = fibres(rng, 12)
    points = about(rng, cylinders)[:400]
    return [float(max(errors(cylinders, points, sum_digits=digits))) for digits in (3, 4)]


@pytest.mark.slow
def test_single_precision(single):
    """Cells have their stated accuracy in f32."""
    three, four = single("sources.magnetic.test_sum_by_cells", "in_this_precision")
    assert three < 1e-3
    assert four < 1e-4


@pytest.mark.long
def test_particles_touch_the_same_cylinders_as_without_cells(rng):
    """Some cylinders have no field, so they belong to no expansion; particles are smaller and larger than
    cells."""
    cylinders = fibres(rng, 40)
    cylinders = tuple(
        one.model_copy(update={"magnetisation": (0.0, 0.0, 0.0)}) if k % 3 == 0 else one
        for k, one in enumerate(cylinders)
    )
    points = about(rng, cylinders, 60)
    radius = np.resize([1e-7, 1e-5, 1e-4, 1e-3], len(points))
    found = [
        run(
            Scene(
                particles=Particles(
                    position=points, velocity=np.zeros_like(points), radius=radius, density=1e3
                ),
                effects=(MagneticCylinders(cylinders=cylinders, sum_digits=digits), Capture()),
                duration=1e-3,
                stepper=Verlet(control=FixedStep(dt=1e-3)),
            )
        )
        for digits in (None, 2)
    ]
    assert 60 < found[0].work["captures"] < len(points)
    assert (found[0].state["captured_by"] % 3 == 0).any()
    for name in ("captured_by", "position"):
        np.testing.assert_array_equal(found[1].state[name], found[0].state[name])


@pytest.mark.long
def test_a_sum_in_a_box(rng):
    """In the box the sum has its accuracy, with fewer cells; outside of the cube about it, fibres are added
    one by one. Worlds may differ in the box."""
    cylinders = fibres(rng, 25)
    box = ((-0.3 * SIDE, -0.2 * SIDE, 0.0), (0.2 * SIDE, 0.2 * SIDE, 0.4 * SIDE))
    low, high = np.array(box)
    ways = {"sum_digits": 3, "sum_box": box}
    size = cell_sum._typical(cylinder_rows.rows(cylinders), low, high)
    inside = rng.uniform(low, high, (400, 3))
    beyond = 0.5 * (low + high) + 0.26 * SIDE * np.sign(rng.normal(size=(100, 3)))
    points = np.concatenate([inside, beyond])
    direct, by_cells = MagneticCylinders(cylinders=cylinders), MagneticCylinders(cylinders=cylinders, **ways)
    expected, found = (sample([one], one.quantity, points) for one in (direct, by_cells))
    for a, b, one in zip(found, expected, size, strict=True):
        wrong = np.linalg.norm((a - b)[:400].reshape(400, -1), axis=1).max()
        assert 1e-6 * one < wrong < 1e-3 * one
    np.testing.assert_allclose(found[0][400:], expected[0][400:], rtol=0, atol=1e-12 * size[0])
    whole = cell_sum.cell_row(cylinders, 3)
    assert len(whole) == len(cell_sum.cell_row(cylinders, 3, box))
    assert np.count_nonzero(cell_sum.cell_row(cylinders, 3, box)) < 0.7 * np.count_nonzero(whole)
    other = MagneticCylinders(cylinders=cylinders, sum_digits=3, sum_box=((0, 0, 0), (SIDE, SIDE, SIDE)))
    assert by_cells.structure() == other.structure() != direct.structure()


def test_a_box_without_extent_is_refused(rng):
    with pytest.raises(InputError, match=r"magnetic_cylinders\.sum_box must be a lower and an upper corner"):
        MagneticCylinders(cylinders=fibres(rng, 2), sum_digits=3, sum_box=((0, 0, 0), (1e-3, 0, 1e-3)))
