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
    assert volume / MATRIX.side**3 == pytest.approx(0.2, rel=1e-9)
    assert MATRIX.density == pytest.approx(len(fibres) / MATRIX.side**3)
    centre = np.array([one.centre for one in fibres])
    axis = np.array([one.direction for one in fibres])
    low = np.array([-MATRIX.side / 2, -MATRIX.side / 2, 0.0])
    assert (centre >= low).all()
    assert (centre <= low + MATRIX.side).all()
    for k in range(len(fibres) - 1):
        apart = centre[k + 1 :] - centre[k]
        apart -= MATRIX.side * np.rint(apart / MATRIX.side)
        half = MATRIX.length / 2
        distances = segment_distances(apart, axis[k], axis[k + 1 :], half, half)
        # Packings permit overlaps of the rods by a thousandth of D.
        assert distances.min() > (1 - 1e-3) * MATRIX.diameter
    # Directions are random: no more order than that of as many random vectors.
    assert abs(np.linalg.eigvalsh(axis.T @ axis / len(axis)) - 1 / 3).max() < 0.25


@pytest.mark.slow
def test_layers_are_copies_along_the_flow():
    one, two = MATRIX.fibres(), Matrix(aspect=2.0, fraction=0.2, layers=2).fibres()
    assert two[: len(one)] == one
    for first, second in zip(one, two[len(one) :], strict=True):
        np.testing.assert_allclose(np.subtract(second.centre, first.centre), [0, 0, MATRIX.side], atol=1e-15)


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
        centre = np.array(body.centre) + np.array(turn) * MATRIX.side
        ends = centre + np.outer([-0.5, 0.0, 0.5], np.array(body.direction) * body.length)
        near = (np.abs(ends - middle) < MATRIX.side / 2 + reach).all(axis=1).any()
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
