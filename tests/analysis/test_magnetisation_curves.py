"""Magnetisation curves of lognormal colloids: closed forms, fits with noise, and inversion."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.constants import Boltzmann, mu_0
from scipy.integrate import quad

from tisim import InputError
from tisim.analysis import (
    LognormalRadii,
    chantrell_radii,
    fit_lognormal_radii,
    fit_radius_classes,
    lognormal_magnetisation,
    magnetic_radius,
)

MAGNETITE, ROOM = 4.46e5, 298.0
"""Saturation magnetisation of magnetite (A/m, B16 7.2.3), and room temperature (K)."""
STRONGEST = 1.194e6
"""Strongest field of the magnetometer (A/m, B16 7.3.5)."""
FIELD = np.linspace(-STRONGEST, STRONGEST, 200)
SATURATION = 80.0
DISPERSIONS = {
    "electron microscope": LognormalRadii.of_mean(5.6e-9, 0.31),
    "synthesised": LognormalRadii.of_mean(2.95e-9, 0.475),
    "Ioniqa": LognormalRadii.of_mean(5.1e-9, 0.40),
}
"""The sizes of B16 7.4.1."""


def moment(radius):
    return 4 / 3 * np.pi * radius**3 * MAGNETITE


def curve(radii, field=FIELD):
    return lognormal_magnetisation(field, SATURATION, radii, MAGNETITE, ROOM)


def limits(radii):
    """The susceptibility at 0, and the field H_0 of the approach to saturation."""
    weak, strong = 1e-3, 1e13
    rest = SATURATION - curve(radii, np.array([strong]))[0]
    return curve(radii, np.array([weak]))[0] / weak, rest / SATURATION * strong


def test_narrow_distributions_follow_langevins_law():
    """Of equal particles exactly; with a small width w, 1 + O(w^2)."""
    equal = LognormalRadii(4e-9, 0.0)
    x = mu_0 * moment(4e-9) * FIELD / (Boltzmann * ROOM)
    np.testing.assert_allclose(curve(equal), SATURATION * (1 / np.tanh(x) - 1 / x), rtol=1e-12)
    gaps = [np.abs(curve(LognormalRadii(4e-9, w)) - curve(equal)).max() for w in (1e-2, 1e-3)]
    assert gaps[0] / gaps[1] == pytest.approx(100.0, rel=0.02)
    assert curve(equal, np.array([0.0, 1e-300])).tolist() == pytest.approx([0.0, 0.0], abs=1e-290)


@pytest.mark.parametrize("width", [0.05, 0.3, 0.6, 1.0])
def test_averages_over_sizes_are_those_of_a_quadrature(width):
    """(7.9), with the integral over ln r by number."""
    radii = LognormalRadii(3e-9, width)

    def density(z, h):
        mu = moment(3e-9 * np.exp(width * z))
        x = mu_0 * mu * h / (Boltzmann * ROOM)
        langevin = x / 3 if x < 1e-4 else 1 / np.tanh(x) - 1 / x
        return mu * langevin * np.exp(-(z**2) / 2)

    def summed(h):
        # Of the curve by number, the part at z = 3 width matters most.
        pieces = np.linspace(-10, 10 + 6 * width, 30)
        return sum(quad(density, a, b, (h,), epsrel=1e-13)[0] for a, b in pairwise(pieces))

    whole = np.sqrt(2 * np.pi) * moment(3e-9) * np.exp(4.5 * width**2)
    for h in (1e2, 1e4, 1e5, 1e6):
        expected = SATURATION * summed(h) / whole
        assert curve(radii, np.array([h]))[0] == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("name", DISPERSIONS)
def test_the_ends_of_a_curve_are_those_of_chantrell(name):
    """chi = M_sat mu_0 mu_v e^(9 w^2/2) / (3 kT) and H_0 = kT e^(9 w^2/2) / (mu_0 mu_v)."""
    radii = DISPERSIONS[name]
    chi, intercept = limits(radii)
    unit = Boltzmann * ROOM / (mu_0 * moment(radii.median * np.exp(3 * radii.width**2)))
    widening = np.exp(4.5 * radii.width**2)
    assert chi == pytest.approx(SATURATION / (3 * unit) * widening, rel=1e-10)
    assert intercept == pytest.approx(unit * widening, rel=1e-6)
    found = chantrell_radii(chi, SATURATION, intercept, MAGNETITE, ROOM)
    assert found.median == pytest.approx(radii.median, rel=1e-5)
    assert found.width == pytest.approx(radii.width, rel=1e-5)


def test_the_magnetic_radius_of_equal_and_of_unequal_particles():
    """(7.8) inverts (7.6) and (7.7); for a lognormal distribution it is (1 + p^2)^4 times the mean radius."""
    chi = SATURATION * mu_0 * moment(5e-9) / (3 * Boltzmann * ROOM)
    assert magnetic_radius(chi, SATURATION, MAGNETITE, ROOM) == pytest.approx(5e-9, rel=1e-13)
    for name, factor in (("electron microscope", 1.443), ("synthesised", 2.256), ("Ioniqa", 1.811)):
        radii = DISPERSIONS[name]
        found = magnetic_radius(limits(radii)[0], SATURATION, MAGNETITE, ROOM)
        assert found / radii.mean == pytest.approx((1 + radii.polydispersity**2) ** 4, rel=1e-9)
        assert found / radii.mean == pytest.approx(factor, abs=1e-3)


def test_means_and_widths_of_a_distribution(rng):
    radii = LognormalRadii.of_mean(5e-9, 0.4)
    drawn = radii.median * np.exp(radii.width * rng.normal(size=200_000))
    assert drawn.mean() == pytest.approx(5e-9, rel=0.01)
    assert drawn.std() / drawn.mean() == pytest.approx(0.4, rel=0.02)
    assert (drawn**4).mean() / (drawn**3).mean() == pytest.approx(radii.volume_mean, rel=0.03)


@pytest.mark.parametrize("name", DISPERSIONS)
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_exact_curves_are_found(name, size):
    radii = DISPERSIONS[name]
    found = fit_lognormal_radii(FIELD, size * curve(radii), MAGNETITE, ROOM)
    exact = (size * SATURATION, *radii, radii.mean, radii.polydispersity)
    assert [one.value for one in found] == pytest.approx(exact, rel=1e-7)
    assert all(one.half < 1e-6 * one.value for one in found)
    assert found.radii.mean == pytest.approx(radii.mean, rel=1e-7)


@pytest.mark.parametrize(
    ("known", "tries"),
    [(True, 100), *(pytest.param(one, 300, marks=pytest.mark.slow) for one in (False, True))],
)
def test_intervals_have_their_nominal_coverage(rng, known, tries):
    """Of many curves with a noise of 0.5 % of the saturation, estimated or known and varying."""
    radii, field = DISPERSIONS["Ioniqa"], FIELD[::5]
    exact = np.array([SATURATION, *radii, radii.mean, radii.polydispersity])
    error = SATURATION * 0.005 * (np.where(np.abs(field) > 2e5, 1.5, 0.5) if known else np.ones(len(field)))
    true, held = curve(radii, field), np.zeros(5)
    for _ in range(tries):
        noisy = true + error * rng.normal(size=len(field))
        found = fit_lognormal_radii(field, noisy, MAGNETITE, ROOM, error if known else None)
        held += [abs(one.value - value) <= one.half for one, value in zip(found, exact, strict=True)]
    # Four standard errors of a fraction of 0.95.
    assert np.abs(held / tries - 0.95).max() < 4 * np.sqrt(0.95 * 0.05 / tries)
    narrow = fit_lognormal_radii(field, noisy, MAGNETITE, ROOM, error if known else None, confidence=0.5)
    assert all(0 < a.half < b.half for a, b in zip(narrow, found, strict=True))


@pytest.mark.parametrize("name", DISPERSIONS)
@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_classes_have_the_saturation_and_the_mean_by_volume_of_a_curve(rng, name, noise):
    """Of 1000 points, as B16 measures; the curve fits as well as the noise allows."""
    radii, field = DISPERSIONS[name], np.linspace(-STRONGEST, STRONGEST, 1000)
    noisy = curve(radii, field) + noise * SATURATION * rng.normal(size=1000)
    found = fit_radius_classes(field, noisy, MAGNETITE, ROOM, noise * SATURATION if noise else None)
    assert found.saturation.sum() == pytest.approx(SATURATION, rel=2e-4 if noise == 0 else 0.02)
    assert found.volume_mean == pytest.approx(radii.volume_mean, rel=4e-3 if noise == 0 else 0.02)
    np.testing.assert_allclose(found.number * moment(found.radius), found.saturation, rtol=1e-12)
    assert (found.number >= 0).all()
    x = mu_0 / (Boltzmann * ROOM) * np.outer(field, moment(found.radius))
    off = (1 / np.tanh(x) - 1 / x) @ found.saturation - noisy
    assert np.sqrt(np.mean(off**2)) < (1.001 * noise + 1e-4) * SATURATION


@pytest.mark.long
def test_means_of_classes_are_reliable_by_volume_and_not_by_number(rng):
    """Over 20 curves with a noise of 0.2 %: 0.1 % too small by volume, and 6 +- 9 % too small by number."""
    radii, field = DISPERSIONS["electron microscope"], np.linspace(-STRONGEST, STRONGEST, 1000)
    means = []
    for _ in range(20):
        noisy = curve(radii, field) + 0.002 * SATURATION * rng.normal(size=1000)
        found = fit_radius_classes(field, noisy, MAGNETITE, ROOM)
        by_number = np.average(found.radius, weights=found.number)
        means.append([found.volume_mean / radii.volume_mean, by_number / radii.mean])
    volume, number = np.transpose(means)
    assert volume.mean() == pytest.approx(1.0, abs=0.005)
    assert volume.std() < 0.005
    assert 0.88 < number.mean() < 0.98
    assert 0.05 < number.std() < 0.15


def test_classes_reach_from_particles_that_hardly_align_to_those_that_always_do():
    found = fit_radius_classes(FIELD, curve(DISPERSIONS["Ioniqa"]), MAGNETITE, ROOM)
    x = mu_0 / (Boltzmann * ROOM) * moment(found.radius[[0, -1]]) * [STRONGEST, np.abs(FIELD).min()]
    assert x == pytest.approx([1.0, 3.0])
    assert len(found.radius) == 40


def test_two_sizes_are_told_apart():
    """A mixture of equal parts of 3 and 8 nm, which is not lognormal."""
    mixture = sum(curve(LognormalRadii(r, 0.0)) for r in (3e-9, 8e-9)) / 2
    found = fit_radius_classes(FIELD, mixture, MAGNETITE, ROOM, radius=np.linspace(1e-9, 12e-9, 23))
    parts = found.saturation / SATURATION
    assert parts[[4, 14]] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert parts.sum() == pytest.approx(1.0, abs=1e-3)


def test_bad_input_is_refused():
    m = curve(DISPERSIONS["Ioniqa"])
    with pytest.raises(InputError, match="magnetisation must be of the shape of field"):
        fit_lognormal_radii(FIELD, m[:3], MAGNETITE, ROOM)
    with pytest.raises(InputError, match="fields must be more than 3 other than 0; received 3"):
        fit_lognormal_radii(FIELD[:3], m[:3], MAGNETITE, ROOM)
    with pytest.raises(InputError, match="error must be above 0"):
        fit_lognormal_radii(FIELD, m, MAGNETITE, ROOM, 0 * m)
    with pytest.raises(InputError, match="field and magnetisation must be finite"):
        fit_lognormal_radii(FIELD, m * np.nan, MAGNETITE, ROOM)
    with pytest.raises(InputError, match="temperature must be above 0; received 0"):
        lognormal_magnetisation(FIELD, 1.0, DISPERSIONS["Ioniqa"], MAGNETITE, 0.0)
    with pytest.raises(InputError, match="material must be above 0"):
        magnetic_radius(1.0, 1.0, -1.0, ROOM)
    with pytest.raises(InputError, match="susceptibility must be above 0"):
        magnetic_radius(0.0, 1.0, MAGNETITE, ROOM)
    with pytest.raises(InputError, match="intercept / saturation must be at least 1, as for equal"):
        chantrell_radii(1.0, 10.0, 1.0, MAGNETITE, ROOM)
    with pytest.raises(InputError, match="radius must be an array of radii above 0"):
        fit_radius_classes(FIELD, m, MAGNETITE, ROOM, radius=np.array([0.0, 1e-9]))
    with pytest.raises(InputError, match="polydispersity must be at least 0"):
        LognormalRadii.of_mean(1e-9, -0.1)
