"""The matrix of a packed filter: fibres that do not overlap, of a given fraction, and their images."""

from itertools import product

import numpy as np
import pytest

from tisim import InputError
from tisim.cases.packed_filter.matrix import Matrix
from tisim.packing.random_bodies import segment_distances

pytestmark = pytest.mark.long

MATRIX = Matrix(aspect=2.0, fraction=0.2)


@pytest.mark.slow
def test_fibres_fill_their_fraction_without_overlaps():
    fibres = MATRIX.fibres()
    volume = sum(np.pi * one.radius**2 * one.length for one in fibres)
    assert volume / MATRIX.sides[0] ** 3 == pytest.approx(0.2, rel=1e-9)
    assert MATRIX.density == pytest.approx(len(fibres) / MATRIX.sides[0] ** 3)
    centre = np.array([one.centre for one in fibres])
    axis = np.array([one.direction for one in fibres])
    low = np.array([-MATRIX.sides[0] / 2, -MATRIX.sides[0] / 2, 0.0])
    assert (centre >= low).all()
    assert (centre <= low + MATRIX.sides[0]).all()
    for k in range(len(fibres) - 1):
        apart = centre[k + 1 :] - centre[k]
        apart -= MATRIX.sides[0] * np.rint(apart / MATRIX.sides[0])
        half = MATRIX.length / 2
        distances = segment_distances(apart, axis[k], axis[k + 1 :], half, half)
        # Packings permit overlaps of the rods by a thousandth of D.
        assert distances.min() > (1 - 1e-3) * MATRIX.diameter
    # Directions are random: no more order than that of as many random vectors.
    assert abs(np.linalg.eigvalsh(axis.T @ axis / len(axis)) - 1 / 3).max() < 0.25


@pytest.mark.slow
def test_fibres_fill_their_fraction_of_a_tube_and_are_inside():
    tube = Matrix(aspect=2.0, fraction=0.2, tube=1.5)
    wide, _, long = tube.sides
    assert wide == pytest.approx(1.5 * (tube.length + tube.diameter))
    assert long >= 2 * (tube.length + tube.diameter)
    fibres = tube.fibres()
    volume = sum(np.pi * one.radius**2 * one.length for one in fibres)
    assert volume / (np.pi / 4 * wide**2 * long) == pytest.approx(0.2, rel=1e-9)
    assert tube.density == pytest.approx(len(fibres) / (np.pi / 4 * wide**2 * long))
    for one in fibres:
        ends = np.array(one.centre) + np.outer([-0.5, 0.5], np.array(one.direction) * one.length)
        # By a thousandth of D, as overlaps.
        assert np.hypot(*ends[:, :2].T).max() + one.radius < wide / 2 + 1e-3 * tube.diameter
        assert 0 <= one.centre[2] <= long
    # Some touch the wall.
    assert max(np.hypot(*one.centre[:2]) for one in fibres) > 0.5 * (wide / 2 - tube.diameter)
    assert tube.with_images(fibres, 2e-3, bulk=False) == fibres
    along = {one.centre[2] // long for one in tube.with_images(fibres, 2e-3, bulk=True)}
    assert {-1.0, 0.0, 1.0} <= along


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_parallel_fibres_do_not_overlap(axis):
    """No point is in two of them or of their images; they fill their fraction of the cube."""
    matrix = Matrix(aspect=3.0, fraction=0.3, parallel=axis)
    fibres, side = matrix.fibres(), matrix.sides[0]
    assert {one.axis for one in fibres} == {tuple(np.eye(3)["xyz".index(axis)])}
    assert len({one.centre for one in Matrix(aspect=3.0, fraction=0.3, parallel=axis, seed=1).fibres()} &
               {one.centre for one in fibres}) == 0  # fmt: skip
    points = np.random.default_rng(0).uniform(-side / 2, side / 2, (100_000, 3))
    inside = np.zeros(len(points), int)
    for one in fibres:
        away = points - one.centre
        away -= side * np.rint(away / side)
        along = away @ one.direction
        inside += (np.linalg.norm(away - np.outer(along, one.direction), axis=1) < one.radius) & (
            np.abs(along) < one.length / 2
        )
    assert inside.max() == 1
    assert inside.mean() == pytest.approx(0.3, abs=5 * np.sqrt(0.3 * 0.7 / len(points)))


def test_matrices_of_parallel_fibres_that_are_refused(monkeypatch):
    monkeypatch.setattr("tisim.cases.packed_filter.matrix.MOST_PLACES_TRIED", 5000)
    rule = r"^fraction of fibres must be at most 0\.3\d+ for parallel fibres of L/D = 2, as 5000 tries "
    with pytest.raises(InputError, match=rule + "found no further free place; received 0.7"):
        Matrix(aspect=2.0, fraction=0.7, parallel="y").fibres()
    with pytest.raises(InputError, match=r"^tube must be left out with parallel fibres; received 2"):
        Matrix(tube=2.0, parallel="y").fibres()


@pytest.mark.slow
def test_layers_are_copies_along_the_flow():
    one, two = MATRIX.fibres(), Matrix(aspect=2.0, fraction=0.2, layers=2).fibres()
    assert two[: len(one)] == one
    for first, second in zip(one, two[len(one) :], strict=True):
        np.testing.assert_allclose(
            np.subtract(second.centre, first.centre), [0, 0, MATRIX.sides[0]], atol=1e-15
        )


@pytest.mark.slow
@pytest.mark.parametrize("bulk", [False, True])
def test_all_images_near_the_matrix_are_there(bulk):
    """Points of the surfaces of all images of three periods that are within reach belong to an image."""
    fibres, reach = MATRIX.fibres(), 0.5e-3
    every = MATRIX.with_images(fibres, reach, bulk)
    assert every[: len(fibres)] == fibres
    known = {tuple(np.round(np.array(one.centre) / 1e-9).astype(int)) for one in every}
    assert len(known) == len(every)
    turns = [t for t in product(range(-3, 4), repeat=3) if bulk or t[2] == 0]
    middle = np.array([0.0, 0.0, MATRIX.depth / 2])
    missing = 0
    for turn, body in product(turns, fibres):
        centre = np.array(body.centre) + np.array(turn) * MATRIX.sides[0]
        ends = centre + np.outer([-0.5, 0.0, 0.5], np.array(body.direction) * body.length)
        near = (np.abs(ends - middle) < MATRIX.sides[0] / 2 + reach).all(axis=1).any()
        missing += near and tuple(np.round(centre / 1e-9).astype(int)) not in known
    assert missing == 0


@pytest.mark.slow
def test_a_fraction_beyond_jamming_is_refused():
    with pytest.raises(InputError, match=r"fraction of fibres must be at most 0\.[45]\d\d for fibres"):
        Matrix(aspect=2.0, fraction=0.6).fibres()
    with pytest.raises(
        InputError, match=r"at which rods with their caps fill less than the space; received 0\.9"
    ):
        Matrix(aspect=2.0, fraction=0.9).fibres()
