"""The field from a table: as accurate as it says, for cylinders of any shape, and what it refuses."""

import numpy as np
import pytest

from tests.sources.fields import fields, relative
from tisim.errors import InputError
from tisim.sources.cylinder import Cylinder, MagneticCylinders

LENGTHS = (1.0, 2.0, 40.0, 300.0)


def magnet(length, digits=None):
    return MagneticCylinders(
        cylinders=[Cylinder(radius=1.0, length=length, magnetisation=(3e5, -2e5, 5e5))], table_digits=digits
    )


def outside(rng, length, n=3000):
    """All about a cylinder, near its rim and far away."""
    wide = rng.uniform(-1, 1, (n, 3)) * [4, 4, length]
    rim = rng.normal(size=(n, 3)) * 10 ** rng.uniform(-4, 0, (n, 1)) + [1, 0, length / 2]
    far = rng.normal(size=(n, 3)) * 5 * length
    points = np.concatenate([wide, rim, far])
    inside = (np.hypot(*points.T[:2]) < 1) & (np.abs(points[:, 2]) < length / 2)
    return points[~inside][: 2 * n]


@pytest.mark.long
@pytest.mark.parametrize("digits", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_it_is_as_accurate_as_it_says(digits, rng):
    """Field and gradient, each relative to its own size; and no more accurate by a factor of a thousand."""
    points = np.array([outside(rng, length) for length in LENGTHS])
    exact = fields([magnet(length) for length in LENGTHS], points)
    found = fields([magnet(length, digits) for length in LENGTHS], points)
    for a, b in zip(found, exact, strict=True):
        errors = np.array([relative(a[w], b[w]).max() for w in range(len(LENGTHS))])
        assert (errors < 10.0**-digits).all()
        assert (errors > 10.0 ** -(digits + 3)).all()


def test_what_tisim_cost_tries():
    """Coarser first; none for one that is a table already, or where a cylinder is too flat for one."""
    assert [law.table_digits for law in magnet(2.0).approximations(1.0)] == [3, 4, 5]
    assert magnet(2.0, 3).approximations(1.0) == ()
    assert magnet(0.1).approximations(1.0) == ()


def test_what_is_wrong_is_named():
    with pytest.raises(InputError) as fault:
        magnet(0.5, 4)
    text = "magnetic_cylinders.cylinders.0.length must be at least the radius, 1 m, with table_digits"
    assert str(fault.value) == f"{text}; received 0.5"
    with pytest.raises(InputError, match="table_digits must be at most 6; received 9"):
        magnet(1.0, 9)
