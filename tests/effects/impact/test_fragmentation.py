"""Fragmentation: its threshold speed, the number of pieces, and conservation."""

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.scenes import DENSITY, GRAIN, RADIUS, SOFT, energy, hit, laws, momentum, scene, simulate
from tisim import Simulation
from tisim.effects import Impact
from tisim.operators import Fragmentation
from tisim.program import scans as prefix_sum


def run(scenes):
    return simulate(scenes, worlds=64, capacity=64)


def break_speed(gamma, radius=2 * RADIUS, e=0.0, pieces=8):
    """Z04 (5.4) for n pieces: dK = 4 pi gamma b0^2 (n^(1/3) - 1), dK = m v^2 (1 - e^2) / 2."""
    return np.sqrt(6 * gamma * (pieces ** (1 / 3) - 1) / (DENSITY * radius * (1 - e * e)))


@pytest.mark.slow
def test_speed_that_halves_the_radius_closed_form():
    """Z04 (5.4): eight pieces need v = sqrt(6 gamma / (rho b0 (1 - e^2))), to a relative error of 1e-10."""
    gamma, hardness = 30.0, 4e5
    critical = np.sqrt(3 * hardness / (2 * DENSITY))
    v = brentq(lambda v: v - break_speed(gamma, e=max(1 - v / critical, 0)), 1e-3, 0.999 * critical)
    assert v < 0.9 * critical
    whole, broken = run(
        [
            hit(v * (1 + off), laws(hardness, gamma, threshold=0.5), radius=2 * RADIUS)
            for off in (-1e-10, 1e-10)
        ]
    )
    assert whole.work["fractures"] == 0
    assert len(whole.state["mass"]) == 2
    assert broken.work["fractures"] == 2
    assert len(broken.state["mass"]) == 16


@pytest.mark.long
@pytest.mark.parametrize("pieces", [2, 3, 5, 8])
def test_the_default_threshold_allows_two_pieces(pieces):
    """With b/b0 = 2^(-1/3) a grain breaks as soon as dK suffices for two pieces, into the largest number that
    dK allows."""
    gamma = 30.0
    v = break_speed(gamma, pieces=pieces)
    fewer, enough = run([hit(v * (1 + off), laws(SOFT, gamma), radius=2 * RADIUS) for off in (-1e-9, 1e-9)])
    assert len(enough.state["mass"]) == 2 * pieces
    assert len(fewer.state["mass"]) == (1 if pieces == 2 else 2 * (pieces - 1))


@pytest.mark.long
def test_largest_grain_that_sticks_closed_form():
    """Z04 (5.5): above b0 = 4 gamma / (a_f H beta) two equal grains that bond also break into eight."""
    gamma, hardness = 30.0, 4e5
    adhesion = np.sqrt(3 * hardness / (2 * DENSITY))
    limit = 4 * gamma / hardness
    results = run(
        [
            hit(
                adhesion * (1 + 1e-12),
                laws(hardness, gamma, grain_mass=DENSITY * np.pi * limit**3 / 7, threshold=0.5),
                radius=limit * (1 + off),
            )
            for off in (-1e-9, 1e-9)
        ]
    )
    assert [len(r.state["mass"]) for r in results] == [1, 16]


@pytest.mark.long
def test_pieces_keep_mass_momentum_energy_and_centre(rng):
    """n equal pieces replace one grain: same mass, momentum, kinetic energy, volume, centre; no overlap."""
    scenes = []
    for _ in range(30):
        radii = RADIUS * rng.uniform(1.5, 2.5, 2)
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        v = rng.normal(size=3) * 100
        scenes.append(
            scene(
                [[0, 0, 0], radii.sum() * (1 - 1e-9) * n],
                [v, v - rng.uniform(1, 40) * n + rng.normal(size=3)],
                laws(1e5, 10 ** rng.uniform(-1, 1)),
                radius=radii,
                dt=1e-12,
                quantities={"temperature": rng.uniform(100, 1000, 2)},
            )
        )
    broke = 0
    for result in run(scenes):
        start, end = result.start, result.state
        if result.work["fractures"] == 0:
            continue
        broke += 1
        size = np.abs(start["mass"][:, None] * start["velocity"]).sum()
        assert end["mass"].sum() == pytest.approx(start["mass"].sum(), rel=1e-15)
        assert (end["radius"] ** 3).sum() == pytest.approx((start["radius"] ** 3).sum(), rel=1e-14)
        np.testing.assert_allclose(
            momentum(end),
            (start["mass"][:, None] * start["velocity"]).sum(axis=0),
            rtol=0,
            atol=1e-15 * size,
        )
        assert energy(end) == pytest.approx(energy(start), rel=2e-14)
        # No piece is lighter than a grain.
        assert end["mass"].min() >= GRAIN * (1 - 1e-6)
        assert len(np.unique(end["id"])) == len(end["id"])
        # Pieces of one grain share its velocity, and lie about its centre without overlap.
        for who in range(2):
            mine = np.flatnonzero(
                np.isclose(end["mass"], start["mass"][who] / pieces_of(end, start, who), rtol=1e-12, atol=0)
                & (np.abs(end["velocity"] - end["velocity"][end["id"] == who]) < 1e-12).all(axis=1)
            )
            n = pieces_of(end, start, who)
            assert len(mine) == n
            place = end["position"][mine]
            moved = start["position"][who] + 1e-12 * start["velocity"][who]
            np.testing.assert_allclose(place.mean(axis=0), moved, rtol=0, atol=1e-16)
            gaps = np.linalg.norm(place[:, None] - place, axis=2) + np.eye(n)
            assert gaps.min() >= 2 * end["radius"][mine[0]] * (1 - 1e-12)
            # The recorded surface energy is shared equally among the pieces.
            surface = 4 * np.pi * (n * end["radius"][mine[0]] ** 2 - start["radius"][who] ** 2)
            spent = result.scene.effects[6].surface_energy * surface
            assert end["fracture_energy"][mine].sum() == pytest.approx(spent, rel=1e-12, abs=1e-18)
    assert broke > 15


def pieces_of(end, start, who):
    """The number of pieces of grain ``who``: the first piece keeps its id."""
    return round(float(start["mass"][who] / end["mass"][end["id"] == who][0]))


@pytest.mark.long
def test_no_piece_is_lighter_than_an_original_grain():
    """For any impact energy: an agglomerate of 3.7 grains gives three pieces, and a single grain does not
    break."""
    radius = RADIUS * 3.7 ** (1 / 3)
    big, single = run([hit(1e4, laws(SOFT, 1.0), radius=r) for r in (radius, RADIUS)])
    assert len(big.state["mass"]) == 6
    assert single.work["fractures"] == 0
    assert len(single.state["mass"]) == 1


def test_the_smallest_piece_is_the_lightest_initial_grain():
    """Two agglomerates of eight grains beside a single grain: each breaks into eight, for any density."""
    light = scene(
        [[-2 * RADIUS, 0, 0], [2 * RADIUS, 0, 0], [0, 1, 0]], [[1e3, 0, 0], [-1e3, 0, 0], [0, 0, 0]],
        laws(SOFT, 1.0, grain_mass=None), radius=[2 * RADIUS, 2 * RADIUS, RADIUS], dt=1e-15,
        quantities={"temperature": 300.0},
    )  # fmt: skip
    heavy = light.replace({"effects.fragmentation.grain_mass": 2 * GRAIN})
    results = run([light, light.replace({"particles.density": 7 * DENSITY}), heavy])
    assert [len(result.state["mass"]) for result in results] == [17, 17, 9]
    assert light.replace({"particles.density": DENSITY / 7}).capacity() == light.capacity() == 17
    assert heavy.capacity() == 9


def test_an_agglomerate_breaks_into_all_its_grains():
    """Rounding of the summed masses costs no piece: 7 merged grains give 7 pieces."""
    radius = RADIUS * 7 ** (1 / 3)
    mass = sum([GRAIN] * 7) * (1 - 1e-15)
    (result,) = run([hit(1e3, laws(SOFT, 1.0), radius=radius, mass=mass)])
    assert len(result.state["mass"]) == 14


@pytest.mark.slow
def test_grains_of_several_blocks_of_memory_break_at_once(rng, monkeypatch):
    """Six pairs of 2 to 7 grains each, in random order among ten grains that are not hit: the pieces of each
    grain lie about the centre of their own pair."""
    monkeypatch.setattr(prefix_sum, "LEAST_BLOCK", {"cpu": 4})
    contents = np.concatenate([np.repeat(np.arange(2, 8), 2), np.ones(10, int)])
    radius = RADIUS * np.cbrt(contents)
    place, velocity = np.zeros((len(contents), 3)), np.zeros((len(contents), 3))
    place[:, 1] = np.concatenate([np.repeat(np.arange(6), 2), np.arange(6, 16)])
    side = np.tile([-1.0, 1.0], 6)
    place[:12, 0], velocity[:12, 0] = side * radius[:12] * (1 - 1e-12), -1e3 * side
    order = rng.permutation(len(contents))
    effects = (Impact(hardness=SOFT), Fragmentation(surface_energy=1.0, grain_mass=GRAIN))
    made = scene(place[order], velocity[order], effects, radius=radius[order], dt=1e-15)
    simulation = Simulation(made)
    simulation.load([made])
    simulation.run()
    (result,) = simulation.results()
    simulation.close()
    assert result.work["fractures"] == 12
    state = result.state
    np.testing.assert_array_equal(np.sort(state["id"]), np.arange(contents.sum()))
    np.testing.assert_allclose(state["mass"], GRAIN, rtol=1e-6)
    row = np.rint(state["position"][:, 1]).astype(int)
    np.testing.assert_array_equal(np.bincount(row), [*2 * np.arange(2, 8), *np.ones(10, int)])
    for k in range(16):
        centre = state["position"][row == k].mean(axis=0)
        np.testing.assert_allclose(centre, [0, k, 0], rtol=0, atol=1e-6)
