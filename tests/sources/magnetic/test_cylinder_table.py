"""The tabulated field has its stated accuracy for cylinders of any shape; invalid settings are refused."""

import numpy as np
import pytest

from tests.sources.fields import fields, relative, steepness
from tisim import InputError
from tisim.sources import Cylinder, MagneticCylinders
from tisim.sources.magnetic import cylinder_table

LENGTHS = (1.0, 2.0, 40.0, 300.0)


def magnet(length, digits=None):
    return MagneticCylinders(
        cylinders=[Cylinder(radius=1.0, length=length, magnetisation=(3e5, -2e5, 5e5))], table_digits=digits
    )


def around(rng, length, n=1500):
    """Points around the cylinder, near its rim, far away, inside, and about its centre."""
    wide = rng.uniform(-1, 1, (n, 3)) * [4, 4, length]
    rim = rng.normal(size=(n, 3)) * 10 ** rng.uniform(-4, 0, (n, 1)) + [1, 0, length / 2]
    far = rng.normal(size=(n, 3)) * 5 * length
    rho, angle = np.sqrt(rng.uniform(0, 1, n)), rng.uniform(0, 2 * np.pi, n)
    z = length * rng.uniform(-0.5, 0.5, n)
    within = np.stack([rho * np.cos(angle), rho * np.sin(angle), z], axis=1)
    middle = rng.normal(size=(n, 3)) * 10 ** rng.uniform(-4, -0.5, (n, 1))
    return np.concatenate([wide, rim, far, within, middle])


@pytest.mark.long
@pytest.mark.parametrize("digits", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_the_table_has_its_stated_accuracy(digits, rng):
    """Errors of field and gradient relative to their sizes; inside, relative to the terms of the gradient.

    The errors are also not more than a thousand times below the bound.
    """
    points = np.array([around(rng, length) for length in LENGTHS])
    exact = fields([magnet(length) for length in LENGTHS], points)
    tabulated = fields([magnet(length, digits) for length in LENGTHS], points)
    for w, length in enumerate(LENGTHS):
        (b, slope), (b_true, true) = ((field[w], gradient[w]) for field, gradient in (tabulated, exact))
        off, size = (np.linalg.norm(m, axis=(1, 2)) for m in (slope - true, true))
        inside = (np.hypot(*points[w].T[:2]) < 1) & (np.abs(points[w][:, 2]) < length / 2)
        of_gradient = off / np.where(inside, steepness(b_true, true, points[w], length / 2), size)
        for errors in relative(b, b_true), of_gradient:
            assert 10.0 ** -(digits + 3) < errors.max() < 10.0**-digits


def test_approximations_for_tisim_cost():
    """Coarse tables come first, and closed forms last; too flat cylinders have no tables."""
    assert [law.table_digits for law in magnet(2.0).approximations(1.0)] == [3, 4, 5]
    assert [law.table_digits for law in magnet(2.0, 3).approximations(1.0)] == [4, 5, None]
    assert magnet(0.1).approximations(1.0) == ()


def test_invalid_values_are_refused():
    with pytest.raises(InputError) as fault:
        magnet(0.5, 4)
    text = "magnetic_cylinders.cylinders.0.length must be at least the radius, 1 m, with table_digits"
    assert str(fault.value) == f"{text}; received 0.5"
    with pytest.raises(InputError, match="table_digits must be at most 6; received 9"):
        magnet(1.0, 9)


def test_invalid_table_digits_are_refused(monkeypatch):
    monkeypatch.setattr(cylinder_table, "GRIDS", cylinder_table.GRIDS[:1])
    with pytest.raises(InputError, match=r"^table_digits must be fewer in f(32|64); received 6$"):
        cylinder_table.table(6)
