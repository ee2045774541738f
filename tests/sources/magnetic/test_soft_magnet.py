"""A soft magnetic cylinder in a uniform field."""

import numpy as np
import pytest
from scipy.constants import mu_0

from tisim import InputError
from tisim.sources.magnetic.soft_magnet import magnetisation
from tisim.sources.magnetic.stoner_wohlfarth import demagnetising_factor

SATURATION = 985e3
AXIS = (0.0, 0.6, 0.8)


@pytest.mark.parametrize("aspect", [0.3, 1.0, 20.0])
def test_inside_a_weak_field_is_cancelled(aspect):
    b = np.array([1e-3, -2e-3, 3e-3])
    m = np.array(magnetisation(AXIS, 1.0, 2 * aspect, SATURATION, tuple(b)))
    n, along = demagnetising_factor(1.0, 2 * aspect), np.array(AXIS)
    own = -n * (m @ along) * along - (1 - n) / 2 * (m - (m @ along) * along)
    np.testing.assert_allclose(b / mu_0 + own, 0.0, atol=1e-9 * np.linalg.norm(b) / mu_0)


def test_saturates_sooner_along_a_long_axis():
    def size(field):
        return np.linalg.norm(magnetisation((0, 0, 1), 1.0, 40.0, SATURATION, field))

    assert size((0.0, 0.0, 0.1)) == pytest.approx(SATURATION)
    # Across the axis N is near 1/2, so saturation takes mu_0 M_s / 2 = 0.62 T.
    assert size((0.1, 0.0, 0.0)) == pytest.approx(0.1 / (mu_0 * 0.5), rel=0.05)
    assert size((0.7, 0.0, 0.0)) == pytest.approx(SATURATION)
    assert size((0.0, 0.0, 0.0)) == 0.0


@pytest.mark.parametrize("field", [(0.05, 0.0, 0.05), (0.3, 0.0, 0.3), (0.8, 0.0, 0.4), (4.0, 0.0, 3.0)])
@pytest.mark.parametrize("aspect", [5 / 3, 20.0])
def test_the_energy_is_minimal_within_saturation(aspect, field):
    n, b = demagnetising_factor(1.0, 2 * aspect), np.array(field)
    factors = np.array([(1 - n) / 2, (1 - n) / 2, n])

    def energy(m):
        return (mu_0 / 2 * factors * m**2 - m * b).sum(axis=-1)

    moment = np.array(magnetisation((0, 0, 1), 1.0, 2 * aspect, SATURATION, field))
    assert np.linalg.norm(moment) <= SATURATION * (1 + 1e-12)
    size, angle = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, np.pi / 2, 1801))
    trials = SATURATION * size[..., None] * np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=-1)
    least = trials[np.unravel_index(energy(trials).argmin(), size.shape)]
    assert energy(moment) <= energy(least) + 1e-12 * np.abs(energy(least))
    np.testing.assert_allclose(moment, least, atol=0.01 * SATURATION)


def test_invalid_magnets_are_refused():
    with pytest.raises(InputError, match="axis of a cylinder must be a direction"):
        magnetisation((0, 0, 0), 1.0, 1.0, SATURATION, (0, 0, 1))
    with pytest.raises(InputError, match="saturation magnetisation must be greater than 0"):
        magnetisation((0, 0, 1), 1.0, 1.0, 0.0, (0, 0, 1))
