"""Series of states of clouds, and the checks and figures made from them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.constants import G

from tests.cases.common.test_rubble_pile import row, state_of
from tisim import InputError
from tisim.cases.case import Check
from tisim.cases.coalescence.checks import of_agglomeration, of_conservation, of_structure, of_the_cloud
from tisim.cases.coalescence.figures import asteroids, figures, forces, growth, shells, table
from tisim.cases.coalescence.published import BULK, DIAMETERS, MAGNETISATIONS, NUMBER
from tisim.cases.coalescence.regime import (
    COMPARED,
    MAGNETISED_BY,
    random_moment,
    regime,
    rotation_over_gravity,
)
from tisim.cases.coalescence.runs import CloudRun, Gathering, chain_length, clouds, of_magnetisation
from tisim.cases.coalescence.scene import scene
from tisim.cases.common.rubble_pile import Conserved


def made(magnetisation, bound, seed=0, lost=0):
    """A run that ends with ``bound`` of 40 grains in a block, ``lost`` grains far away and the others in
    pairs; all moments are along the pairs."""
    block = np.argwhere(np.ones((bound // 9, 3, 3))).astype(float)
    pairs = [row(2, at=(0, 10.0 * (k + 1), 0)) for k in range((40 - len(block)) // 2)]
    place = np.vstack([block, *pairs])
    place[40 - lost :, 0] += 100.0 * np.arange(1, lost + 1)
    end = state_of(place, moment=np.tile([2.0 * (magnetisation > 0), 0.0, 0.0], (40, 1)))
    states = [state_of(row(40, 3.0)), end]
    for state in states:
        state["velocity"], state["spin"] = np.tile([[1.0, 0.0, 0.0]], (2, 40, 1))
    return CloudRun(
        magnetisation, 0.5, scene(number=20, seed=seed), np.array([0.0, COMPARED]),
        [Gathering.of(one) for one in states], [Conserved.of(one) for one in states], end,
    )  # fmt: skip


RUNS = [
    made(m, bound, seed) for m, bound in zip(MAGNETISATIONS, (18, 18, 36), strict=True) for seed in (0, 1)
]


def test_claims_about_runs():
    claims = {claim.name: claim for claim in (*of_agglomeration(RUNS), *of_structure(RUNS))}
    outside = claims["0 A/m: fraction of outside grains in clusters of two or more"]
    assert (outside.value.value, outside.beside) == (1.0, "L21, 50 cm: 0.007")
    assert claims["fraction of all grains in clusters, 1190 minus 0 A/m"].mean.value == 0.0
    assert claims["1190 A/m: longest axis over shortest"].beside == "L21: 1.07"
    # All moments of these runs are parallel; at random those of 40 grains would be 0.15 of it.
    aligned = claims["119 A/m: moment over the sum of the grains' moments"]
    assert (aligned.value.value, aligned.beside) == (1.0, "random directions: 0.15; L21, 50 cm: 0.04")
    bulk = claims["119 A/m: bulk magnetisation, A/m"]
    assert bulk.value.value == pytest.approx(119 * RUNS[2].magnetised_part)
    assert bulk.beside == "L21, 50 cm: 3"
    ratio = RUNS[-1].asteroid.magnetisation / (0.5 * 1190.0)
    assert RUNS[-1].magnetised_part == pytest.approx(ratio)
    assert RUNS[-1].asteroid is RUNS[-1].asteroid
    checks = {check.name: check for check in of_conservation(RUNS)}
    # Velocities do not change; only the gravitational energy has decreased.
    assert all(check.ok for check in checks.values())


def test_clumps_that_join_the_asteroid_later_count():
    """Before the end, 12 of 40 grains are in a clump outside an asteroid of 20."""
    between = Gathering.of(state_of(np.vstack([row(20), row(12, at=(0, 10, 0)), row(8, 5.0, (0, 40, 0))])))
    runs = [
        replace(one, agglomerations=[between, one.agglomerations[1]]) if one.magnetisation > 1000 else one
        for one in RUNS
    ]
    most = [item.value.value for item in of_agglomeration(runs) if "largest fraction" in item.name]
    assert most == pytest.approx([0.0, 0.0, 0.3])


@pytest.mark.parametrize(("weak", "strong"), [(2, 0), (0, 0), (0, 2)])
def test_a_claim_fails_if_magnetised_grains_do_not_agglomerate_more(weak, strong):
    """Some of the 40 grains are lost, either without or with magnetisation."""
    runs = [made(m, 18, seed, lost=strong if m > 1000 else weak) for m in MAGNETISATIONS for seed in (0, 1)]
    claims = {claim.name: claim for claim in (*of_agglomeration(runs), *of_structure(runs))}
    for of in (
        "of all grains in clusters, 1190 minus 0 A/m",
        "of outside grains in clusters, 1190 minus 0 A/m",
    ):
        (claim,) = [one for name, one in claims.items() if of in name]
        assert claim.ok == (weak > strong)
    # The asteroids are the same.
    assert not claims["density, 1190 minus 0 A/m, kg/m^3"].ok


def test_chain_lengths_are_given_by_magnetisation():
    """A block whose rows along the moments have two grains, and pairs; then a block with rows of four."""
    shown = {item.name: item.value for item in of_agglomeration(RUNS) if "chain length" in item.name}
    assert [one for one in shown if one.endswith("at the end")] == [
        f"{m} A/m: chain length in grains, at the end" for m in (119, 1190)
    ]
    assert shown["119 A/m: chain length in grains, at the end"].value == 2.0
    assert shown["1190 A/m: chain length in grains, at the end"].value == (36 * 4 + 4 * 2) / 40


def test_the_rotation_that_disrupts_a_cloud():
    checks = list(of_the_cloud())
    assert all(isinstance(one, Check) and one.ok for one in checks)
    assert [one.expected for one in checks] == pytest.approx([82.8, 234.2], abs=0.5)


def test_figures_of_runs():
    assert len(growth(RUNS).axes) == 3
    assert len(asteroids([of_magnetisation(RUNS, m)[0] for m in MAGNETISATIONS]).axes) == 3
    by_size, by_gravity = forces().axes
    assert len(by_size.lines) == 2 + 4 + len(DIAMETERS)
    # At 5 mT grains of iron of 5 mm attract each other with 7.86 times their weight on Psyche.
    line = by_gravity.lines[list(MAGNETISED_BY).index(5e-3)]
    at = np.exp(np.interp(np.log(5e-3), *np.log([line.get_xdata(), line.get_ydata()])))
    assert at == pytest.approx(7.86 * 0.144, rel=1e-3)
    assert len(table(RUNS).splitlines()) == 1 + len(RUNS)
    assert shells(RUNS[0]).shape == (2,)
    assert table(RUNS).splitlines()[0].split(",")[5] == "semi_major_axis_m"
    with pytest.raises(InputError, match=r"size must be one that is run with each magnetisation \(default"):
        figures("unmagnetised", None)


def test_the_regime_of_clouds():
    shown = {item.name: item.value for item in regime()}
    # For a ball it is M R^2 w^2 / 5 over 3/5 G M^2 / R.
    mass, radius, spin = 7.0, 0.3, 1e-3
    density = mass / (4 / 3 * np.pi * radius**3)
    expected = mass * radius**2 * spin**2 / 5 / (0.6 * G * mass**2 / radius)
    assert rotation_over_gravity(spin, density) == pytest.approx(expected)
    for name, value in {
        "100 cm, 1000 urad/s: over critical spin of the cloud": 4.27,
        "100 cm, 1000 urad/s: rotational over gravitational energy": 6.1,
        "50 cm, 1000 urad/s: rotational over gravitational energy": 49,
        "50 cm, 2000 urad/s, read as microdegrees: final over critical spin": 0.86,
        "100 cm: 2 K / |U| of the cloud": 0.41,
        # A value above 2 means a positive energy.
        "50 cm: 2 K / |U| of the cloud": 3.3,
        "default: overlap of an impact over a radius": 0.008,
    }.items():
        assert shown[name] == pytest.approx(value, rel=0.03), name


@pytest.mark.parametrize(("number", "seed"), [(400, 0.0), (400, 8.0), (100, 200.0), (7, 0.0)])
def test_the_moment_of_random_directions(number, seed, rng):
    """Against the mean of 4000 draws; sqrt(8 N / (3 pi)) is for many grains, and 1 % too small for 7."""
    draws = rng.normal(size=(4_000, number, 3))
    total = (draws / np.linalg.norm(draws, axis=2, keepdims=True)).sum(axis=1)
    total[:, 2] += seed
    sizes = np.linalg.norm(total, axis=1)
    error = 4 * sizes.std() / np.sqrt(len(sizes)) + 0.02 * sizes.mean() * (number < 10)
    assert random_moment(number, seed) == pytest.approx(sizes.mean(), abs=error)


def test_the_published_moment_is_that_of_the_seed_particle():
    """L21's 7.3e3 and 7.1e4 A m^2 are within one standard deviation of the seed's moment, the spread of the
    grains in random directions along it."""
    shown = {item.name: item.value for item in regime()}
    for m, theirs in BULK.items():
        grain = m * np.pi / 6 * 0.5**3
        alone = shown[f"50 cm, {m:g} A/m: moment of the seed particle, A m^2"]
        assert alone == pytest.approx(1000 * grain)
        assert abs(theirs.moment - alone) < np.sqrt(NUMBER / 3) * grain
        assert shown[f"50 cm, {m:g} A/m: moment of grains in random directions, A m^2"] < 0.2 * theirs.moment


@pytest.mark.slow
def test_a_tiny_cloud_satisfies_conservation_laws():
    runs = clouds(1, number=30, seed_diameter=2.0, duration=400.0, samples=2, magnetisations=(0.0, 1190.0))
    assert [one.magnetisation for one in runs] == [0.0, 1190.0]
    for check in of_conservation(runs):
        assert check.ok, check
    # Magnets attract each other in addition to gravity.
    assert runs[1].conserved[-1].kinetic > 1.05 * runs[0].conserved[-1].kinetic


def test_the_degree_of_agglomeration_of_a_cloud():
    """A row of 20 is the asteroid; a row of 12, a pair and 6 single grains are outside."""
    single = row(6, 5.0, (0.0, 40.0, 0.0))
    place = np.vstack([row(20), row(12, at=(0, 10, 0)), row(2, at=(0, 20, 0)), single])
    seen = Gathering.of(state_of(place))
    assert (seen.coalesced, seen.some, seen.many) == pytest.approx((20 / 40, 14 / 20, 12 / 20))
    assert (seen.bound, seen.clumped) == pytest.approx((34 / 40, 12 / 40))


def test_the_ends_of_agglomeration():
    apart, whole = Gathering.of(state_of(row(4, 3.0))), Gathering.of(state_of(row(4)))
    assert (apart.coalesced, apart.some, apart.bound) == (0.0, 0.0, 0.0)
    assert (whole.coalesced, whole.bound, whole.clumped) == (1.0, 1.0, 0.0)
    assert np.isnan(whole.some)


def test_chains_are_of_grains_head_to_tail():
    """A row of three along its moments, one of two across them, and a seed that counts in none."""
    place = np.vstack([row(3), row(2, at=(0, 9, 0)), row(1, at=(0, 30, 0))])
    moment = np.array([[1.0, 0, 0]] * 3 + [[0, 1.0, 0]] * 2 + [[1.0, 0, 0]])
    state = state_of(place, moment=moment, radius=np.array([0.5] * 5 + [2.0]))
    assert chain_length(state) == pytest.approx((3 * 3 + 1 + 1) / 5)
    assert np.isnan(chain_length(state | {"moment": 0 * moment}))
