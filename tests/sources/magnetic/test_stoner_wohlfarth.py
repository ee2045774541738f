"""Magnetisation of a cylinder in a field: demagnetising factors and the closed forms of the model."""

import numpy as np
import pytest
from scipy.constants import mu_0

from tests.sources.fields import fields
from tisim import InputError
from tisim.sources import Cylinder, MagneticCylinders
from tisim.sources.magnetic.stoner_wohlfarth import demagnetising_factor, magnetisation

SATURATION = 985e3


def test_demagnetising_factor():
    """Tabulated values (D.-X. Chen et al., IEEE Trans. Magn. 27 (1991) 3601, no susceptibility), limits."""
    for ratio, expected in ((0.1, 0.7967), (1.0, 0.3116), (10.0, 0.0412)):
        assert demagnetising_factor(1.0, 2 * ratio) == pytest.approx(expected, abs=6e-5)
    # The factors are equal along and across the axis if the length is 0.9065 of the diameter.
    assert demagnetising_factor(1.0, 2 * 0.90647) == pytest.approx(1 / 3, abs=1e-5)
    assert demagnetising_factor(1.0, 1e-6) == pytest.approx(1.0, abs=1e-5)
    assert demagnetising_factor(1.0, 2e4) == pytest.approx(4 / (3 * np.pi * 1e4), rel=1e-3)


def test_the_factor_is_the_mean_field_inside():
    """-H / M along the axis, averaged over the cylinder by quadrature."""
    x, weight = np.polynomial.legendre.leggauss(60)
    half = 0.7
    # The radial variable is squared towards the rim, because the field diverges logarithmically there.
    rho2, z = 1 - (0.5 - 0.5 * x) ** 2, half * (1 - (0.5 - 0.5 * x) ** 2)
    share = weight * (1 - x) * 0.5
    points = np.array([[np.sqrt(r), 0, h] for r in rho2 for h in z])
    magnet = MagneticCylinders(
        cylinders=[Cylinder(radius=1, length=2 * half, magnetisation=(0, 0, 1 / mu_0))]
    )
    h = fields([magnet], points[None])[0][0, :, 2].reshape(60, 60) - 1
    assert -share @ h @ share == pytest.approx(demagnetising_factor(1.0, 2 * half), rel=1e-5)


def test_along_the_easy_axis_and_across_it():
    """Along the easy axis the magnetisation stays.

    Across it, sin(psi) = B / B_K up to B_K = mu_0 M (1 - 3N)/2, and then it is saturated.
    """
    m = magnetisation((0, 0, 2), 1.0, 10.0, SATURATION, (0, 0, 0.1))
    np.testing.assert_allclose(m, (0, 0, SATURATION), atol=1e-9 * SATURATION)
    threshold = mu_0 * SATURATION * (1 - 3 * demagnetising_factor(1.0, 10.0)) / 2
    for part in (0.1, 0.5, 0.99, 1.5):
        m = np.array(magnetisation((0, 0, 1), 1.0, 10.0, SATURATION, (part * threshold, 0, 0))) / SATURATION
        assert m[0] == pytest.approx(min(part, 1.0), abs=1e-12)
        assert m[1] == 0
        assert m[2] == pytest.approx(np.sqrt(1 - m[0] ** 2), abs=1e-7)
    # The magnetisation of a flat cylinder stays in its plane until the field along the axis is strong.
    m = np.array(magnetisation((0, 0, 1), 1.0, 0.2, SATURATION, (0, 1e-3, 0.1))) / SATURATION
    assert m[2] == pytest.approx(
        0.1 / (mu_0 * SATURATION * (3 * demagnetising_factor(1.0, 0.2) - 1) / 2), rel=0.01
    )
    assert m[1] > 0.9


def test_the_energy_is_minimal(rng):
    """Compared with the energy of every direction, for random cylinders in random weak and strong fields."""
    psi = np.linspace(-np.pi, np.pi, 3601)
    for _ in range(200):
        axis, field = rng.normal(size=3), rng.normal(size=3) * 10 ** rng.uniform(-2, 1)
        length = 10 ** rng.uniform(-1, 2)
        m = np.array(magnetisation(axis, 1.0, length, SATURATION, field))
        assert np.linalg.norm(m) == pytest.approx(SATURATION, rel=1e-14)
        e = axis / np.linalg.norm(axis)
        n = demagnetising_factor(1.0, length)

        def energy(m, n=n, e=e, field=field):
            along = m @ e
            across = (m * m).sum(axis=-1) - along**2
            return mu_0 / 2 * (n * along**2 + (1 - n) / 2 * across) - m @ field

        side = field - (field @ e) * e
        side /= np.linalg.norm(side)
        plane = SATURATION * (np.cos(psi)[:, None] * e + np.sin(psi)[:, None] * side)
        anywhere = rng.normal(size=(500, 3))
        anywhere *= SATURATION / np.linalg.norm(anywhere, axis=1)[:, None]
        least = min(energy(plane).min(), energy(anywhere).min())
        assert energy(m) <= least + 1e-12 * abs(least)


def test_without_a_field():
    """Along the axis of a long cylinder, across a flat one; with magnitude M."""
    assert magnetisation((1, 0, 0), 1.0, 9.0, 2.0, (0, 0, 0)) == pytest.approx((2.0, 0, 0))
    flat = magnetisation((1, 0, 0), 1.0, 0.1, 2.0, (0, 0, 0))
    assert flat[0] == pytest.approx(0, abs=1e-15)
    assert np.linalg.norm(flat) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((0, 0, 0), 1, 1, 1, (0, 0, 1)), "axis of a cylinder must be a direction; received (0, 0, 0)"),
        (((0, 0, 1), 0, 1, 1, (0, 0, 1)), "radius of a cylinder must be greater than 0; received 0"),
        (((0, 0, 1), 1, -1, 1, (0, 0, 1)), "length of a cylinder must be greater than 0; received -1"),
        (((0, 0, 1), 1, 1, 0, (0, 0, 1)), "saturation magnetisation must be greater than 0; received 0"),
    ],
)
def test_invalid_values_are_refused(arguments, message):
    with pytest.raises(InputError) as fault:
        magnetisation(*arguments)
    assert str(fault.value) == message
