"""Chains and clusters of known shape."""

from itertools import combinations

import numpy as np
import pytest

from tisim.analysis import (
    alignment,
    cluster_shapes,
    contacts,
    disjoint_chains,
    fabric_tensor,
    fraction_in_clusters,
    head_to_tail,
    labels,
    orientation_tensor,
)

SIDES = (6.0, 8.0, 30.0)


def rod(start, direction, number):
    """Positions of touching spheres of diameter 1 in a row."""
    direction = np.asarray(direction, float) / np.linalg.norm(direction)
    return np.asarray(start, float) + np.arange(number)[:, None] * direction


def test_a_rod_a_bend_a_ladder_and_one_alone():
    """The particles are shuffled, and the rod crosses faces of the box."""
    bend = np.vstack([rod((10, 0, 0), (1, 0, 0), 4), rod((13, 1, 0), (0, 1, 0), 3)])
    ladder = np.vstack([rod((30, 0, 0), (0, 0, 1), 6), rod((31, 0, 0), (0, 0, 1), 6)])
    places = np.vstack([rod((5.5, 7.5, 29.5), (1, 2, 2), 9), bend, ladder, [[50.0, 0, 0]]])
    shuffled = np.random.default_rng(3).permutation(len(places))
    places[:9] %= SIDES
    for sides, wanted in ((SIDES, slice(0, 9)), (None, slice(9, None))):
        chosen = shuffled[np.isin(shuffled, np.arange(len(places))[wanted])]
        position = places[chosen]
        shapes = cluster_shapes(position, contacts(position, np.full(len(position), 0.5), 1e-9, sides), sides)
        if sides:
            np.testing.assert_array_equal([shapes.size, shapes.path], [[9], [9]])
            assert shapes.extent[0] == pytest.approx(8.0)
            assert shapes.thickness[0] == pytest.approx(0.0, abs=1e-6)
            assert abs(shapes.direction[0] @ [1, 2, 2]) == pytest.approx(3.0)
            assert alignment(shapes.direction, (1, 2, 2)) == pytest.approx(1.0)
            assert shapes.gyration_radii[0, 0] == pytest.approx(np.sqrt((81 - 1) / 12))
            continue
        order = np.argsort(shapes.size)
        assert shapes.size[order].tolist() == [1, 7, 12]
        # Seven along the bend; the longest path along the ladder crosses at most one rung.
        assert shapes.path[order].tolist() == [1, 7, 7]
        assert shapes.breadth[order[2]] == pytest.approx(12 / 7)
        assert shapes.thickness[order[2]] == pytest.approx(0.5)
        assert shapes.extent[order[[0, 2]]] == pytest.approx([0.0, 5.0])
        np.testing.assert_allclose(shapes.centre[order[1]], bend.mean(axis=0))
        assert abs(shapes.direction[order[2], 2]) == pytest.approx(1.0)


def test_fraction_in_clusters():
    cluster = labels(10, np.array([[0, 1], [1, 2], [4, 9]]))
    assert [fraction_in_clusters(cluster, least) for least in (1, 2, 3, 4)] == [1.0, 0.5, 0.3, 0.0]
    assert np.isnan(fraction_in_clusters(np.empty(0, int), 2))


def test_orientations(rng):
    """Orientations at random, along an axis, across it, and weighted."""
    n = rng.normal(size=(20000, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    np.testing.assert_allclose(orientation_tensor(n), np.eye(3) / 3, atol=0.01)
    assert alignment(n, (1, 1, 0)) == pytest.approx(0.0, abs=0.02)
    assert alignment(np.eye(3)[:2], (0, 0, 5)) == pytest.approx(-0.5)
    # Without directions or pairs, or with zero weights, the results are undefined.
    none = np.zeros((0, 3))
    assert np.isnan(alignment(none, (0, 0, 5)))
    assert np.isnan(orientation_tensor(np.eye(3), np.zeros(3))).all()
    assert np.isnan(fabric_tensor(np.eye(3), np.zeros((0, 2), int))).all()
    assert alignment(np.eye(3)[:2], (1, 0, 0), np.array([3.0, 1.0])) == pytest.approx(0.75 - 0.125)
    # A random cosine has a mean square of a third; above c it is (1 - c^3) / (3 (1 - c)).
    cap = n[np.abs(n[:, 2]) > 0.5]
    assert orientation_tensor(cap)[2, 2] == pytest.approx((1 - 0.125) / 1.5, abs=0.01)


def test_fabric_of_a_lattice_stretched_along_x():
    """Rows along x touch, also across periodic faces."""
    sites = np.stack(np.meshgrid(*3 * [np.arange(4.0)], indexing="ij"), -1).reshape(-1, 3) * (1.0, 1.2, 1.0)
    sides = (4.0, 4.8, 4.0)
    pairs = contacts(sites, np.full(64, 0.5), 1e-9, sides)
    np.testing.assert_allclose(fabric_tensor(sites, pairs, sides), np.diag([0.5, 0, 0.5]), atol=1e-12)


def test_chains_across_periodic_faces_are_connected(rng):
    place = np.array([[0.0, 0, 0.2], [0, 0, 9.2], [0, 0, 5.0]])
    moment = np.tile([0.0, 0, 1.0], (3, 1))
    assert len(head_to_tail(place, moment, 1.0)) == 0
    assert head_to_tail(place, moment, 1.0, sides=(0, 0, 10.0)).tolist() == [[0, 1]]


def test_long_chains_are_fast(rng):
    """In a ring, the longest of the shortest paths has half of the particles."""
    angle = 2 * np.pi * np.arange(2000) / 2000
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    pairs = np.column_stack([np.arange(2000), (np.arange(2000) + 1) % 2000])
    pairs = np.vstack([pairs, [[2000 + k, 2001 + k] for k in range(0, 3000, 2)]])
    position = np.vstack([ring, rng.uniform(size=(3000, 3))])
    shapes = cluster_shapes(position, pairs)
    assert shapes.path[0] == 1001
    assert shapes.gyration_radii[0] == pytest.approx([np.sqrt(0.5), np.sqrt(0.5), 0], abs=1e-6)
    assert (shapes.size[1:] == 2).all()


def ends(number, first, last):
    """Masks of the particles at which chains begin and end."""
    return np.isin(np.arange(number), first), np.isin(np.arange(number), last)


def test_chains_side_by_side_do_not_share_a_particle():
    ladder = [(0, 1), (1, 2), (3, 4), (4, 5), (1, 4)]
    assert disjoint_chains(ladder, *ends(6, [0, 3], [2, 5])) == 2
    # All three chains of an hourglass lead through its neck.
    hourglass = [(0, 3), (1, 3), (2, 3), (3, 4), (3, 5), (3, 6)]
    assert disjoint_chains(hourglass, *ends(7, [0, 1, 2], [4, 5, 6])) == 1
    assert disjoint_chains(hourglass, *ends(8, [0, 1, 2], [7])) == 0
    # A particle in both sets is a chain without any bond.
    assert disjoint_chains(np.empty((0, 2), int), *ends(3, [0, 1], [1, 2])) == 1
    # Bonds have no direction.
    assert disjoint_chains([(0, 3), (1, 3), (1, 4), (2, 4)], *ends(5, [0], [2])) == 1


def test_as_many_chains_as_particles_separate_their_ends():
    """Menger's theorem: the smallest separating set, by trial of all subsets."""
    rng = np.random.default_rng(5)
    counts = []
    for _ in range(40):
        every = np.array(list(combinations(range(7), 2)))
        pairs = every[rng.random(len(every)) < 0.35]
        names = rng.permutation(7)
        first, last = ends(7, names[:3], names[4:])
        separating = (
            set(removed)
            for size in range(8)
            for removed in combinations(range(7), size)
            if apart(pairs, set(removed), first, last)
        )
        counts.append(len(next(separating)))
        assert disjoint_chains(pairs, first, last) == counts[-1]
    assert len(set(counts)) > 2


def apart(pairs, removed, first, last):
    """Whether no chain leads from first to last without the removed particles."""
    kept = [pair for pair in pairs if not removed & set(pair.tolist())]
    cluster = labels(len(first), np.reshape(kept, (-1, 2)).astype(int))
    left = np.isin(np.arange(len(first)), list(removed), invert=True)
    return not set(cluster[first & left].tolist()) & set(cluster[last & left].tolist())
