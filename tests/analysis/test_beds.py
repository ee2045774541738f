"""Beds, heaps and discharges with known answers."""

import numpy as np
import pytest

from tisim import InputError
from tisim.analysis import (
    angle_of_repose,
    beverloo_rate,
    contacts,
    coordination_numbers,
    discharge_rate,
    discharge_rates,
    largest_overlap,
    mean_coordination,
    solid_fraction,
)


def cubic(n, radius=0.5):
    sites = np.stack(np.meshgrid(*3 * [np.arange(n)], indexing="ij"), -1).reshape(-1, 3)
    return 2 * radius * (sites + 0.5), np.full(n**3, radius)


def test_solid_fraction_of_a_cubic_packing_and_of_cut_spheres():
    position, radius = cubic(4)
    layers = solid_fraction(position, radius, np.arange(5.0), area=16.0)
    np.testing.assert_allclose(layers, np.pi / 6, rtol=1e-14)
    # A quarter of the way up a sphere are 5/32 of its volume.
    cut = solid_fraction(position[:1], radius[:1], np.array([-1.0, 0.25, 2.0]), area=2.0, axis=0)
    np.testing.assert_allclose(cut * 2.0 * np.array([1.25, 1.75]), np.pi / 6 * np.array([5 / 32, 27 / 32]))


def test_the_largest_overlap_across_a_face_is_found():
    position, radius = np.array([[0.2, 0.0, 0.0], [1.1, 0.0, 0.0], [3.9, 0.0, 0.0]]), [0.5, 0.5, 0.4]
    assert largest_overlap(position, radius) == pytest.approx(0.1)
    # 0.3 apart through the face at 4.
    assert largest_overlap(position, radius, (4.0, 0.0, 0.0)) == pytest.approx(0.6)
    assert largest_overlap(position[1:], radius[1:]) == 0.0


def test_contacts_of_a_cubic_packing():
    position, radius = cubic(4)
    open_pairs = contacts(position, radius, gap=1e-9)
    assert len(open_pairs) == 3 * 4 * 4 * 3
    numbers = coordination_numbers(64, open_pairs)
    assert sorted(set(numbers)) == [3, 4, 5, 6]
    assert numbers[0] == 3
    periodic = contacts(position, radius, gap=1e-9, sides=(4.0, 4.0, 0.0))
    assert (coordination_numbers(64, periodic) >= 5).all()
    assert mean_coordination(64, contacts(position, radius, 1e-9, (4.0, 4.0, 4.0))) == 6.0
    assert len(contacts(position, radius, gap=-1e-9)) == 0
    # A small sphere in the centre of a cell touches eight grains, even if other grains are much larger.
    small = np.sqrt(3) / 2 - 0.5
    more, sizes = np.vstack([position, [[1.0, 1.0, 1.0]]]), np.append(radius, small)
    assert coordination_numbers(65, contacts(more, sizes, 1e-9))[-1] == 8


def test_rattlers_are_removed_repeatedly():
    """In a cube of 3 x 3 x 3 grains the 8 corners (3 contacts) go first; edges then have 2 of 4 contacts
    left."""
    position, radius = cubic(3)
    pairs = contacts(position, radius, gap=1e-9)
    assert mean_coordination(27, pairs) == pytest.approx(2 * 54 / 27)
    # Six face centres around the middle grain remain, each with one contact; in the next pass all go.
    assert mean_coordination(27, pairs, rattlers=False) == 0.0
    position, radius = cubic(5)
    pairs = contacts(position, radius, 1e-9, (5.0,) * 3)
    loose = np.vstack([position, [[100.0, 0, 0]]])
    open_pairs = contacts(loose, np.append(radius, 0.5), 1e-9)
    assert mean_coordination(125, pairs, rattlers=False) == 6.0
    assert mean_coordination(126, pairs) == pytest.approx(750 / 126)
    assert len(open_pairs) == 3 * 4 * 25


@pytest.mark.parametrize("degrees", [18.0, 27.0, 35.0])
def test_angle_of_a_cone_of_grains(rng, degrees):
    """Grains of two sizes fill a cone; a few strays lie on the floor."""
    height, slope, step = 0.03, np.tan(np.radians(degrees)), 1.9e-3
    reach = np.arange(-height / slope, height / slope, step)
    sites = np.stack(np.meshgrid(reach, reach, np.arange(0, height, step), indexing="ij"), -1).reshape(-1, 3)
    sites = sites + rng.uniform(-0.5, 0.5, sites.shape) * step
    inside = sites[np.hypot(*sites[:, :2].T) < (height - sites[:, 2]) / slope]
    position = inside + np.array([0.3, -0.1, 0.02])
    radius = rng.choice([0.8e-3, 1.2e-3], len(position))
    position[:20] = [0.5, -0.1, 0.021]
    found = np.degrees(angle_of_repose(position, radius, centre=(0.3, -0.1), floor=0.02))
    assert found == pytest.approx(degrees, abs=1.0)
    alone = np.degrees(angle_of_repose(position[20:], radius[20:], floor=0.02))
    assert alone == pytest.approx(degrees, abs=1.0)


def test_a_layer_has_no_flank():
    with pytest.raises(InputError, match="flank of the heap must be at least 3 mean diameters wide"):
        angle_of_repose(*cubic(1))


def test_rate_of_a_discharge_that_starts_and_ends_slowly():
    time = np.linspace(0, 10, 201)
    mass = np.interp(time, [0, 1, 2, 8, 9, 10], [0, 0, 0.5, 12.5, 13.0, 13.0])
    assert discharge_rate(time, mass) == pytest.approx(2.0, rel=1e-12)
    rates = discharge_rates(time, mass)
    assert rates[0] == 0
    assert rates[100] == pytest.approx(2.0)
    assert rates.sum() * 0.05 == pytest.approx(13.0)
    with pytest.raises(InputError, match="times of steady flow must be at least 3; received 0"):
        discharge_rate(np.array([0.0, 1.0]), np.array([0.0, 1.0]))


def test_beverloo():
    """D0 - k d = 0.04 m: 0.58 * 1500 * sqrt(9.81) * 0.04^2.5."""
    rate = beverloo_rate(0.047, 0.005, 1500.0, gravity=9.81)
    assert rate == pytest.approx(0.58 * 1500 * np.sqrt(9.81) * 0.04**2.5, rel=1e-12)
    with pytest.raises(InputError, match=r"outlet must be wider than 1\.4 diameters of a grain"):
        beverloo_rate(0.005, 0.005, 1500.0)
