"""Clouds of equal spheres: positions, velocities, charges, and files."""

from __future__ import annotations

import tomllib
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import tisim
from tests.judged import check_message
from tisim import (
    Blast,
    Box,
    Cloud,
    InputError,
    Lattice,
    Open,
    RandomAroundCylinder,
    RandomInBall,
    RandomInBox,
    RandomInDomain,
    Scene,
)
from tisim.backend import runtime
from tisim.scene.placed_together import placed_together

BALL = dict(number=2000, radius=0.05, density=7000.0, placement=RandomInBall(radius=1.0, centre=(3.0, 0, 0)))
"""The blast of Z16 section 6.1, with its centre off the origin."""
VIBRATION = dict(radius=0.005, density=2000.0, placement=Lattice(shape=(7, 7, 7), size=(0.2, 0.2, 0.2)))
"""The sample of Z13 section 4."""


def arrays(cloud, domain=None, seed=0):
    return cloud.arrays(domain or Open(), seed)


def overlaps(positions, radius):
    return len(cKDTree(positions).query_pairs(2 * radius * (1 - 1e-12)))


@pytest.fixture(scope="module")
def ball():
    return arrays(Cloud(**BALL, specific_charge=10.0, pulse=Blast(energy=1e4), mean_velocity=(0, 0, 2.0)))


def test_spheres_lie_inside_the_ball_and_fill_it_uniformly(ball):
    distance = np.linalg.norm(ball["position"] - [3.0, 0, 0], axis=1)
    assert distance.max() <= 0.95
    assert distance.max() > 0.949
    assert overlaps(ball["position"], 0.05) == 0
    assert len(distance) * 0.05**3 == pytest.approx(0.25)
    # No direction is preferred; a uniform ball would give var(x) = 0.95^2/5, and spheres accumulate at the
    # wall.
    offset = ball["position"] - [3.0, 0, 0]
    assert np.abs(offset.mean(axis=0)).max() < 4 * np.sqrt(0.19 / 2000)
    assert np.ptp(offset.var(axis=0)) < 0.02
    assert 0.18 < offset.var(axis=0).mean() < 0.22


def test_a_ball_nearly_without_room_has_no_overlap():
    positions = arrays(Cloud(**{**BALL, "number": 2880}))["position"]
    assert np.linalg.norm(positions - [3.0, 0, 0], axis=1).max() <= 0.95 * (1 + 1e-12)
    assert overlaps(positions, 0.05) == 0


def test_spheres_lie_wholly_inside_the_box():
    low, high = np.array([0.0, -1.0, 2.0]), np.array([0.5, 1.0, 2.4])
    placement = RandomInBox(low=tuple(low), high=tuple(high))
    positions = arrays(Cloud(number=200, radius=0.05, density=1.0, placement=placement))["position"]
    assert ((positions >= low + 0.05) & (positions <= high - 0.05)).all()
    assert overlaps(positions, 0.05) == 0


def test_blast_adds_its_energy_along_the_radius(ball):
    """Z16 (3.1)-(3.4): W = 10 kJ on 2000 spheres of 3.665 kg."""
    mass, moved = ball["mass"], ball["velocity"] - [0, 0, 2.0]
    assert 0.5 * (mass * (moved**2).sum(axis=1)).sum() == pytest.approx(1e4, rel=1e-13)
    speed = np.sqrt(2 * 1e4 / (2000 * 7000 * 4 / 3 * np.pi * 0.05**3))
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), speed, rtol=1e-13)
    arm = ball["position"] - ball["position"].mean(axis=0)
    np.testing.assert_allclose(np.cross(arm, moved), 0.0, atol=1e-13)
    assert ((arm * moved).sum(axis=1) > 0).all()


def test_blast_of_unequal_masses_starts_from_their_centre_of_mass():
    position, mass = np.array([[0.0, 0, 0], [3.0, 0, 0]]), np.array([1.0, 2.0])
    np.testing.assert_allclose(
        Blast(energy=6.0).velocity(position, mass), [[-2.0, 0, 0], [2.0, 0, 0]], rtol=1e-15
    )
    # With three positions on a line the middle sphere gets no velocity and the others share the energy.
    position = np.array([[-1.0, 5, 0], [0.0, 5, 0], [1.0, 5, 0]])
    moved = Blast(energy=4.0).velocity(position, np.full(3, 1.0))
    np.testing.assert_allclose(moved, [[-2.0, 0, 0], [0, 0, 0], [2.0, 0, 0]], rtol=1e-15)
    with pytest.raises(InputError, match="must be apart from their centre of mass; received 1 in it"):
        Blast(energy=4.0).velocity(np.ones((1, 3)), np.ones(1))


def test_charge_is_by_mass_or_for_each(ball):
    np.testing.assert_array_equal(ball["charge"], 10.0 * ball["mass"])
    start = arrays(Cloud(**VIBRATION, quantities={"charge": 1.0, "spin": (0.0, 0.0, 3.0)}))
    np.testing.assert_array_equal(start["charge"], np.ones(343))
    np.testing.assert_array_equal(start["spin"], np.tile([0.0, 0.0, 3.0], (343, 1)))


def test_lattice_of_the_vibration_sample():
    """7 x 7 x 7 sites in a cube of 0.2 m, with neighbours 1/30 m apart."""
    positions = arrays(Cloud(**VIBRATION))["position"]
    assert positions.shape == (343, 3)
    np.testing.assert_allclose(positions.mean(axis=0), 0.0, atol=1e-16)
    assert (positions.min(), positions.max()) == pytest.approx((-0.1, 0.1), rel=1e-15)
    distance, _ = cKDTree(positions).query(positions, k=2)
    np.testing.assert_allclose(distance[:, 1], 1 / 30, rtol=1e-13)


def test_lattice_by_spacing_about_a_centre():
    lattice = Lattice(shape=(3, 1, 2), spacing=0.5, centre=(1.0, 2.0, 3.0))
    positions = arrays(Cloud(radius=0.25, density=1.0, placement=lattice))["position"]
    expected = [[x, 2.0, z] for x in (0.5, 1.0, 1.5) for z in (2.75, 3.25)]
    np.testing.assert_array_equal(positions, expected)
    flat = Lattice(shape=(3, 1, 2), size=(1.0, 0.0, 0.5), centre=(1.0, 2.0, 3.0))
    np.testing.assert_array_equal(flat.centres(np.full(6, 0.25), Open(), 0), expected)


WRONG = {
    "no number": (lambda: Cloud(radius=1.0, density=1.0), "cloud.number must be given; received nothing"),
    "another number than sites": (
        lambda: Cloud(**VIBRATION, number=344),
        "cloud.number must be 343, as the placement has sites, or left out; received 344",
    ),
    "spacing and size": (
        lambda: Lattice(shape=(2, 2, 2), spacing=1.0, size=(1, 1, 1)),
        "lattice must be given spacing or size; received both",
    ),
    "neither": (lambda: Lattice(shape=(2, 2, 2)), "lattice must be given spacing or size"),
    "no sites": (lambda: Lattice(shape=(0, 2, 2), spacing=1.0), "lattice.shape must be at least 1"),
    "flat box": (
        lambda: Lattice(shape=(2, 2, 2), size=(1, 1, 0)),
        "lattice.size must be above 0 along an axis with several sites",
    ),
    "sites too close": (
        lambda: arrays(Cloud(radius=0.3, density=1.0, placement=Lattice(shape=(2, 1, 1), spacing=0.5))),
        "lattice sites must be at least a diameter, 0.6 m, apart; received 0.5",
    ),
    "ball too small": (
        lambda: arrays(Cloud(number=1, radius=0.3, density=1.0, placement=RandomInBall(radius=0.2))),
        "ball must be larger than a sphere, of radius 0.3 m; received 0.2",
    ),
    "box too small": (
        lambda: arrays(
            Cloud(number=1, radius=0.3, density=1.0, placement=RandomInBox(low=(0, 0, 0), high=(1, 1, 0.5)))
        ),
        "box must be wider than a sphere, 0.6 m, in each direction",
    ),
    "too many": (lambda: arrays(Cloud(**{**BALL, "number": 4000})), "must be at most 0.384.*received 0.5"),
    "a ball far from the origin": (
        lambda: arrays(
            Cloud(number=9, radius=0.01, density=1.0, placement=RandomInBall(radius=1.0, centre=(1e17, 0, 0)))
        ),
        "places of the packing must be so near the origin that rounding, .* m there, is at most 1.0e-05 m",
    ),
    "a box far from the origin": (
        lambda: arrays(
            Cloud(
                number=9,
                radius=1.0,
                density=1.0,
                placement=RandomInBox(low=(1e17,) * 3, high=(1.00000000000001e17,) * 3),
            )
        ),
        "places of the packing must be so near the origin",
    ),
    "a domain far from the origin": (
        lambda: arrays(
            Cloud(number=9, radius=1.0, density=1.0), Box(low=(1e17,) * 3, high=(1.00000000000001e17,) * 3)
        ),
        "places of the packing must be so near the origin",
    ),
    "a lattice far from the origin": (
        lambda: arrays(
            Cloud(
                radius=0.1,
                density=1.0,
                placement=Lattice(shape=(2, 2, 2), spacing=1.0, centre=(0, 1e17, 0)),
            )
        ),
        "lattice sites must be so near the origin",
    ),
    "a cylinder far from the origin": (
        lambda: arrays(
            Cloud(
                number=9,
                radius=0.01,
                density=1.0,
                placement=RandomAroundCylinder(radius=1.0, length=1.0, thickness=1.0, centre=(0, 0, 1e17)),
            )
        ),
        "places around the cylinder must be so near the origin",
    ),
    "more around a cylinder than its layer holds": (
        lambda: arrays(
            Cloud(
                number=10**6,
                radius=0.1,
                density=1.0,
                placement=RandomAroundCylinder(radius=1.0, length=1.0, thickness=1.0),
            )
        ),
        r"cloud.number must be at most the number that fits around the cylinder, less than",
    ),
    "velocities beyond numbers": (
        lambda: arrays(
            Cloud(
                number=2,
                radius=0.1,
                density=1.0,
                placement=RandomInBall(radius=1.0),
                pulse=Blast(energy=1.7e308),
            )
        ),
        "velocity of the cloud must be finite; received -?inf",
    ),
    "open domain": (lambda: arrays(Cloud(number=9, radius=1, density=1)), "domain must be bounded to hold"),
    "charge twice": (
        lambda: Cloud(**VIBRATION, specific_charge=1.0, quantities={"charge": 1.0}),
        "cloud.quantities.charge must be given outside quantities, and only once",
    ),
    "energy": (lambda: Blast(energy=0.0), "blast.energy must be greater than 0"),
}


@pytest.mark.parametrize(("make", "message"), WRONG.values(), ids=WRONG)
def test_wrong_starts_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_too_much_memory_is_refused_before_it_is_allocated(monkeypatch):
    """A scene with a cloud of 1e8 spheres can be made, as its check needs little memory; the start is
    refused."""
    monkeypatch.setattr(runtime, "memory", lambda: 10**9)
    most = Lattice(shape=(500, 500, 400), spacing=1.0)
    for cloud in (Cloud(radius=0.1, density=1.0, placement=most), Cloud(number=10**8, radius=1, density=1)):
        tracemalloc.start()
        scene = Scene(particles=cloud, duration=1.0)
        assert tracemalloc.get_traced_memory()[1] < 10**8
        message = r"memory for a cloud of 100000000 particles must be within the 1 GB .*; received 30 GB"
        with pytest.raises(InputError, match=message):
            scene.particles.arrays(scene.domain, 0)
        with placed_together([scene, scene]), pytest.raises(InputError, match=message):
            scene.start()
        assert tracemalloc.get_traced_memory()[1] < 10**8
        tracemalloc.stop()


def test_spheres_lie_inside_nonperiodic_faces():
    """Such axes may have walls; along periodic axes spheres may extend over the faces."""
    box = Box(low=(0, 0, 0), high=(1, 1, 0.5), periodic=(True, True, False))
    place = arrays(Cloud(number=300, radius=0.04, density=1.0), box)["position"]
    assert place[:, 2].min() >= 0.04
    assert place[:, 2].max() <= 0.46
    assert (place[:, :2].min(axis=0) < 0.04).all()
    assert (place[:, :2].max(axis=0) > 0.96).all()
    with pytest.raises(InputError, match=r"box must be wider than a sphere, 0.6 m, along axes that are not"):
        arrays(Cloud(number=1, radius=0.3, density=1.0), box)


def test_few_spheres_in_a_large_box_take_little_memory():
    """For a gas as thin as air the memory depends on the number of spheres, not on the capacity of the
    cells."""
    placement = RandomInBox(low=(-1.0,) * 3, high=(1.0,) * 3)
    tracemalloc.start()
    assert len(arrays(Cloud(number=2000, radius=1e-6, density=1.0, placement=placement))["position"]) == 2000
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2e7


def decades(low, high):
    """Numbers at both ends of a range of powers of ten, and between them."""
    return st.floats(low, high).map(lambda power: 10.0**power)


@settings(max_examples=200, derandomize=True, database=None, deadline=None)
@given(
    number=st.integers(1, 12),
    radius=decades(-110, 110),
    density=decades(-300, 300),
    extent=decades(-1, 20),
    away=st.one_of(st.just(0.0), decades(-3, 20)),
    kind=st.sampled_from(["ball", "box", "domain", "lattice", "cylinder"]),
)
def test_starts_of_any_size_have_no_overlap_or_are_refused(number, radius, density, extent, away, kind):
    """Spheres of 1e-110 to 1e110 m, in any region at any distance, do not overlap, or a message gives the
    reason."""
    side, centre = radius * extent, (0.0, radius * away, 0.0)
    low, high = ([c + s * side for c in centre] for s in (-1, 1))
    try:
        placement = {
            "ball": lambda: RandomInBall(radius=side, centre=centre),
            "box": lambda: RandomInBox(low=low, high=high),
            "domain": RandomInDomain,
            "lattice": lambda: Lattice(shape=(number, 1, 2), spacing=side, centre=centre),
            "cylinder": lambda: RandomAroundCylinder(radius=side, length=side, thickness=side, centre=centre),
        }[kind]()
        fixed = {} if kind == "lattice" else {"number": number}
        cloud = Cloud(**fixed, radius=radius, density=density, placement=placement)
        start = arrays(cloud, Box(low=low, high=high) if kind == "domain" else None)
    except InputError as fault:
        check_message(str(fault))
        return
    assert all(np.isfinite(values).all() for values in start.values())
    # Relative to the first sphere and in units of radii, so that squares do not overflow.
    places = (start["position"] - start["position"][0]) / radius
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)[np.triu_indices(len(places), 1)]
    assert (apart >= 2 * (1 - 2e-3)).all()


@pytest.mark.parametrize(
    "cloud",
    [
        Cloud(**BALL, specific_charge=10.0, pulse=Blast(energy=1e4)),
        Cloud(**VIBRATION, quantities={"charge": 1.0}),
        Cloud(number=5, radius=0.1, density=1.0, placement=RandomInBox(low=(0, 0, 0), high=(1, 1, 1))),
        Cloud(number=5, radius=0.1, density=1.0),
    ],
    ids=["blast", "vibration", "box", "domain"],
)
def test_the_scene_is_read_back_from_a_file(cloud):
    scene = Scene(particles=cloud, domain=Box(low=(-9,) * 3, high=(9,) * 3), duration=1.0)
    again = Scene.from_dict(tomllib.loads(scene.to_toml()))
    assert again == scene
    assert again.digest() == scene.digest()
    for name, values in arrays(again.particles, again.domain).items():
        np.testing.assert_array_equal(values, arrays(cloud, scene.domain)[name])


def test_parts_of_a_start_are_settings():
    scene = Scene(particles=Cloud(**BALL, pulse=Blast(energy=1e4)), duration=1.0)
    changed = scene.replace({"particles.placement.radius": 1.2, "particles.pulse.energy": 5.0})
    assert (changed.particles.placement.radius, changed.particles.pulse.energy) == (1.2, 5.0)
    assert changed.digest() != scene.digest()
    with pytest.raises(InputError, match=r"particles\.placement\.kind must be one of"):
        scene.replace({"particles.placement.kind": "heap"})


@pytest.mark.slow
def test_a_blast_runs():
    scene = Scene(
        particles=Cloud(
            number=20,
            radius=0.05,
            density=7000.0,
            placement=RandomInBall(radius=0.4),
            pulse=Blast(energy=10.0),
        ),
        duration=1e-2,
    )
    result = tisim.run(scene)
    moved = result.state["position"] - result.start["position"]
    np.testing.assert_allclose(moved, 1e-2 * result.start["velocity"], rtol=1e-9, atol=1e-12)
