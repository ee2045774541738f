"""Spin-up of piles: L21's numbers, the rotation of a pile, and its deformation and disruption."""

import numpy as np
import pytest

from tests.cases.common.test_rubble_pile import block, state_of
from tisim import InputError
from tisim.cases.common.rubble_pile import Asteroid, Conserved
from tisim.cases.spin_up import stages
from tisim.cases.spin_up.checks import at_least, of_conservation, of_densities, of_shapes, of_spins, regime
from tisim.cases.spin_up.figures import against_spin, figures, piles, table
from tisim.cases.spin_up.scene import NUMBERS, SIZES, scene_for
from tisim.cases.spin_up.stages import DEFORMATION, DISRUPTION, RATES, SpinStep, SpinUp, spin_ups, turn


def test_a_size_without_a_duration_settles_for_the_duration_of_the_scene(monkeypatch):
    """The sizes of L21 have no duration of their own."""
    made = []

    class Loaded(Exception):
        """Raised in place of running the scenes."""

    def load(scenes):
        made.extend(scenes)
        raise Loaded

    monkeypatch.setattr(stages, "loaded", load)
    with pytest.raises(Loaded):
        spin_ups(1, number=8, rates=(1e-4, 5e-4), holds=(5.0, 7.0))
    assert [one.duration for one in made] == [15_000.0 + 5.0 + 7.0] * 3


@pytest.mark.parametrize(("size", "diameter"), [("l21", 1.0), ("l21_50cm", 0.5)])
def test_the_sizes_of_l21_have_its_numbers(size, diameter):
    start = scene_for(size, 0).start()
    assert len(start["mass"]) == NUMBERS[diameter]
    assert set(2 * start["radius"]) == {diameter}
    # The total masses are equal within 2 %, as in L21.
    assert start["mass"].sum() == pytest.approx(4088 * 3000 * np.pi / 6, rel=0.02)
    np.testing.assert_allclose(np.linalg.norm(start["moment"], axis=1), 1190 * np.pi / 6 * diameter**3)


def test_the_cloud_of_the_default_does_not_turn():
    start = scene_for("default", 1).start()
    spin = np.linalg.norm(Asteroid(start, None).spin)
    assert spin < 5e-5
    assert SIZES.keys() == {"default", "unmagnetised", "l21", "l21_50cm"}
    np.testing.assert_allclose(RATES, 1e-4 * np.arange(1, 10))
    assert all(DEFORMATION[m] < DISRUPTION[m] for m in DISRUPTION)


def test_a_pile_is_turned_as_a_whole():
    """It gets the given angular velocity about z; its momentum and the grains outside of it do not change."""
    state = block(np.array([0.1, -0.2, 0.3]))
    state["mass"] = np.arange(1.0, 10.0)
    before = {name: np.array(values) for name, values in state.items()}
    turn(state, 0.05)
    np.testing.assert_allclose(Asteroid.of(state).spin, [0.0, 0.0, 0.05], atol=1e-12)
    np.testing.assert_allclose(Conserved.of(state).momentum, Conserved.of(before).momentum)
    np.testing.assert_array_equal(state["velocity"][8], before["velocity"][8])
    np.testing.assert_array_equal(state["spin"][8], before["spin"][8])
    np.testing.assert_array_equal(state["position"], before["position"])


def pile(tall=1, lost=0):
    """A block of 3 x 3 grains with 3 or more layers along x, of which ``lost`` grains are far away."""
    place = np.argwhere(np.ones((2 + tall, 3, 3))).astype(float)
    place[len(place) - lost :] += 50.0 * np.arange(1, lost + 1)[:, None]
    return state_of(place)


def spin_up(*states, magnetisation=0.0):
    steps = [SpinStep(1e-4 * k, state) for k, state in enumerate(states)]
    return SpinUp(magnetisation, 0, steps)


def test_when_a_pile_deforms_and_breaks():
    run = spin_up(pile(), pile(), pile(tall=2), pile(tall=2, lost=3))
    assert run.deformation == pytest.approx(2e-4)
    assert run.disruption == pytest.approx(3e-4)
    assert run.steps[3].held == pytest.approx(33 / 36)
    assert run.at(1.9e-4) is run.steps[2]
    # Grains that return later are not lost.
    assert np.isnan(spin_up(pile(lost=3), pile(), pile(lost=1)).disruption)
    # A pile that breaks also counts as deformed.
    assert spin_up(pile(), pile(lost=3)).deformation == pytest.approx(1e-4)
    assert np.isnan([spin_up(pile(), pile()).deformation, spin_up(pile(), pile(tall=2)).disruption]).all()


@pytest.mark.parametrize(("when", "later"), [(0, False), (1, False), (2, True)])
def test_the_claim_of_later_breaking_needs_a_difference_of_one_step(when, later):
    whole, broken = pile(), pile(lost=3)
    runs = [
        spin_up(whole, *[whole] * (when if m > 1000 else 1), broken, magnetisation=m)
        for m in (0.0, 119.0, 1190.0)
        for _ in range(2)
    ]
    claims = [claim for claim in of_spins(runs) if "1190 minus 0" in claim.name]
    assert [claim.ok for claim in claims] == [later]


def slabs(magnetisation):
    """Two piles: blocks at rest, of which the second is taller, that become a slab two grains high at 600
    µrad/s."""
    for seed, tall in enumerate((4, 5)):
        block = state_of(np.argwhere(np.ones((4, 4, tall))).astype(float))
        slab = state_of(np.argwhere(np.ones((4, 8, 2))).astype(float))
        rates = (0.0, 5e-4, 6e-4, 7e-4)
        states = (block, block, slab, slab)
        yield SpinUp(magnetisation, seed, [SpinStep(*one) for one in zip(rates, states, strict=True)])


SLABS = [one for m in DEFORMATION for one in slabs(m)]


def test_widths_are_relative_to_the_pile_at_rest():
    shown = {item.name: item for item in of_shapes(SLABS)}
    steps = SLABS[0].steps[0], SLABS[1].steps[0], SLABS[0].steps[2]
    high, higher, flat = (one.asteroid.flattening for one in steps)
    assert shown["0 A/m, at rest: width over height"].value.value == pytest.approx((high + higher) / 2)
    assert shown["0 A/m, 600 urad/s: width over height"].value.value == pytest.approx(flat)
    growth = shown["119 A/m, 600 urad/s: width over height, over its value at rest"]
    assert growth.value.value == pytest.approx((flat / high + flat / higher) / 2)
    assert growth.beside == "L21: 1.28"
    axes = SLABS[0].steps[2].asteroid.ellipsoid.semi_axes
    for k, (name, beside) in enumerate((("longest", "L21: 1.85"), ("intermediate", "L21: 1.21"))):
        axis = shown[f"1190 A/m, 700 urad/s: {name} over shortest axis"]
        assert (axis.value.value, axis.beside) == (pytest.approx(axes[k] / axes[2]), beside)
    assert shown["1190 A/m, at rest: longest over shortest axis"].value.value < 1.3


def test_porosities_and_densities_are_of_the_hull():
    """Grains of 1 m with a mass of 2 kg, in place of 1571 kg: the porosity is 1 - 1e-3 and more."""
    shown = {item.name: item for item in of_densities(SLABS)}
    at_rest = [one.steps[0].asteroid.density for one in SLABS[:2]]
    porosity = shown["1190 A/m: porosity at rest"]
    assert porosity.value.value == pytest.approx(1 - np.mean(at_rest) / 3000)
    assert porosity.beside == "L21: 0.83"
    assert shown["0 A/m: porosity at rest"].beside == ""
    slab = SLABS[0].steps[2].asteroid.density
    ratio = shown["0 A/m, 600 urad/s: density over density at rest"].value.value
    assert ratio == pytest.approx(np.mean(slab / np.array(at_rest)))
    assert shown["0 A/m, 500 urad/s: density over density at rest"].value.value == pytest.approx(1.0)
    assert sum("over density at rest" in name for name in shown) == 3 * 3


@pytest.mark.long
def test_figures_and_claims_of_some_runs():
    runs = [
        spin_up(pile(), pile(tall=2), pile(tall=2, lost=2), magnetisation=m)
        for m in (0.0, 119.0, 1190.0)
        for _ in range(2)
    ]
    rows = table(runs).splitlines()
    assert len(rows) == 1 + 6 * 3
    assert rows[0].split(",")[3] == "semi_major_axis_m"
    with pytest.raises(InputError, match=r"size must be one that is run with each magnetisation \(default"):
        figures("unmagnetised", None)
    assert len(against_spin(runs).axes) == 3
    assert len(piles(runs).axes) == 9
    claims = {claim.name: claim for claim in of_spins(runs)}
    assert claims["0 A/m: spin at which it breaks, urad/s"].value.value == pytest.approx(200.0)
    assert claims["1190 A/m: spin at which it deforms, urad/s"].value.value == pytest.approx(100.0)
    np.testing.assert_allclose(at_least([7e-4, np.nan]), [700.0, 1000.0])
    assert claims["1190 A/m: spin at which it deforms, urad/s"].beside == "L21: 700"
    later = claims["spin at which it breaks, 1190 minus 0 A/m, urad/s (L21: 100)"]
    assert (later.mean.value, later.ok) == (0.0, False)


def test_the_regime_of_piles():
    shown = {item.name: item.value for item in regime()}
    assert shown["scale of the copy"] == pytest.approx((80 / 4088) ** (1 / 3))
    assert shown["free-fall time, s"] == pytest.approx(2484, rel=1e-3)
    assert shown["step, s"] == pytest.approx(0.225, rel=5e-3)
    assert shown["overlap of an impact over a radius"] == pytest.approx(0.02, rel=0.03)
    assert shown["overlap of two grains in line over a radius, 1190 A/m"] == pytest.approx(7e-4, rel=0.05)


@pytest.mark.slow
def test_a_tiny_pile_has_the_given_spins():
    """Grains that touch at the start form a pile, which keeps its momentum when its rotation is set."""
    settings = {"number": 27, "spacing": 1.0, "softened": 10.0, "duration": 50.0}
    (run,) = spin_ups(1, magnetisations=(0.0,), rates=(1e-4, 5e-4), holds=(5.0, 5.0), **settings)
    assert [step.rate for step in run.steps] == [0.0, 1e-4, 5e-4]
    for step in run.steps[1:]:
        assert step.asteroid.spin[2] == pytest.approx(step.rate, rel=0.05)
    (check,) = of_conservation([run])
    assert check.ok
