"""Fits of flow curves to known curves, exact and with noise of known size."""

import numpy as np
import pytest

from tisim import InputError
from tisim.analysis import fit_bingham, fit_biviscous, fit_herschel_bulkley

RATE = np.geomspace(1.0, 1e3, 25)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_exact_curves_are_found(size):
    found = fit_bingham(RATE, size * (5.0 + 0.02 * RATE))
    assert found.yield_stress.value == pytest.approx(5.0 * size, rel=1e-10)
    assert found.plastic_viscosity.value == pytest.approx(0.02 * size, rel=1e-10)
    assert found.yield_stress.half < 1e-9 * size
    stress = size * np.minimum(0.4 * RATE, 5.0 + 0.02 * RATE)
    creeping = fit_biviscous(RATE, stress)
    assert [one.value / size for one in creeping] == pytest.approx([0.4, 5.0, 0.02], rel=1e-7)
    np.testing.assert_allclose(creeping.stress(RATE), stress, rtol=1e-7)
    for exponent in (0.4, 1.0, 2.1):
        stress = size * (3.0 + 0.5 * RATE**exponent)
        curve = fit_herschel_bulkley(RATE, stress)
        assert curve.yield_stress.value == pytest.approx(3.0 * size, rel=1e-6)
        assert curve.consistency.value == pytest.approx(0.5 * size, rel=1e-6)
        assert curve.exponent.value == pytest.approx(exponent, rel=1e-7)
        np.testing.assert_allclose(curve.stress(RATE), stress, rtol=1e-7)


def test_rates_up_to_a_limit_are_left_out():
    """Below the limit the curve has another slope."""
    stress = np.where(RATE > 200, 40.0 + 0.1 * RATE, 10.0)
    found = fit_bingham(RATE, stress, above=200.0)
    assert found.yield_stress.value == pytest.approx(40.0)
    assert found.stress(500.0) == pytest.approx(90.0)
    with pytest.raises(InputError, match="rates must be more than 2 above 990 1/s; received 1"):
        fit_bingham(RATE, stress, above=990.0)
    with pytest.raises(InputError, match="stress must be of the shape of rate"):
        fit_bingham(RATE, stress[:3])
    with pytest.raises(InputError, match="error must be above 0"):
        fit_bingham(RATE, stress, np.zeros(25))
    with pytest.raises(InputError, match="rate must be above 0"):
        fit_herschel_bulkley(RATE - 1, stress, above=-1.0)


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize(
    ("fit", "law", "true"),
    [
        (fit_bingham, lambda x: 5.0 + 0.02 * x, (5.0, 0.02)),
        (fit_herschel_bulkley, lambda x: 5.0 + 0.5 * x**0.6, (5.0, 0.5, 0.6)),
    ],
)
def test_intervals_have_their_nominal_coverage(rng, fit, law, true, known):
    """Over 400 noisy curves, with an estimated noise level or with known errors that vary."""
    error, tries = np.where(RATE > 30, 0.3, 0.1) if known else np.full(len(RATE), 0.2), 400
    held = np.zeros(len(true))
    for _ in range(tries):
        stress = law(RATE) + error * rng.normal(size=len(RATE))
        found = fit(RATE, stress, error if known else None)
        held += [abs(one.value - value) <= one.half for one, value in zip(found, true, strict=True)]
    # Four standard errors of a fraction of 0.95.
    assert np.abs(held / tries - 0.95).max() < 4 * np.sqrt(0.95 * 0.05 / tries)
    half = fit(RATE, stress, error if known else None, confidence=0.5)
    assert all(0 < narrow.half < wide.half for narrow, wide in zip(half, found, strict=True))


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize(("noise", "least"), [(0.01, 0.906), (0.2, 0.85)])
def test_intervals_of_a_biviscous_fluid_hold_if_noise_hides_no_point_near_the_yield_stress(
    rng, noise, least, known
):
    """Otherwise points near the yield stress are taken for the other line, and intervals are too narrow."""
    true, tries = (0.4, 5.0, 0.02), 400
    error = noise * (np.where(RATE > 30, 1.5, 0.5) if known else np.ones(len(RATE)))
    held = np.zeros(len(true))
    for _ in range(tries):
        stress = np.minimum(true[0] * RATE, true[1] + true[2] * RATE) + error * rng.normal(size=len(RATE))
        found = fit_biviscous(RATE, stress, error if known else None)
        held += [abs(one.value - value) <= one.half for one, value in zip(found, true, strict=True)]
    assert (held / tries).min() > least
    assert (held / tries).max() < 0.994
