"""Cylinders that magnetise each other: exact limits, minima of the energy, and boundary elements."""

import math

import numpy as np
import pytest
from scipy.constants import mu_0
from scipy.spatial.transform import Rotation
from scipy.stats import qmc

from tests.sources.fields import fields
from tests.sources.magnetic import boundary_elements
from tisim import InputError
from tisim.sources import Cylinder, MagneticCylinders, magnetise
from tisim.sources.magnetic import soft_magnet, stoner_wohlfarth
from tisim.sources.magnetic.demagnetising_tensors import demagnetising_tensors

SATURATION = 985e3
FIELDS = ((0.3, 0.0, 0.3), (0.05, 0.0, 0.01), (1.0, 0.4, 0.0))
CROSSED = (
    Cylinder(radius=1.0, length=10.0, axis=(0.0, 0.0, 1.0)),
    Cylinder(radius=1.0, length=10.0, axis=(0.0, 1.0, 0.0), centre=(2.2, 0.0, 2.0)),
)
"""Two cylinders at right angles, a tenth of a diameter apart."""


def scattered(rng, n, side=12.0):
    """Cylinders in any direction in a cube; some overlap."""
    return [
        Cylinder(
            centre=rng.uniform(-side / 2, side / 2, 3),
            axis=rng.normal(size=3),
            radius=rng.uniform(0.5, 1.0),
            length=rng.uniform(3.0, 9.0),
        )
        for _ in range(n)
    ]


def apart(rng, n, spacing=9.0):
    """Cylinders in any direction that do not touch."""
    grid = np.argwhere(np.ones((n, n, n))) * spacing
    return [Cylinder(centre=r, axis=rng.normal(size=3), radius=1.0, length=8.0) for r in grid]


def magnetisations(cylinders):
    return np.array([one.magnetisation for one in cylinders])


def energies(cylinders, m, field, stiffness=0.0):
    """The energy over mu_0 (J m/H) of magnetisations m, shape (..., n, 3)."""
    volume = np.array([np.pi * one.radius**2 * one.length for one in cylinders])
    tensors = demagnetising_tensors(cylinders)
    own = 0.5 * np.einsum("...ia,iajb,...jb,i->...", m, tensors, m, volume)
    applied = np.einsum("...ia,a,i->...", m, np.asarray(field) / mu_0, volume)
    return own + 0.5 * stiffness * np.einsum("...ia,...ia,i->...", m, m, volume) - applied


@pytest.mark.parametrize("field", FIELDS)
def test_one_cylinder_is_magnetised_as_before(field):
    one = Cylinder(axis=(1.0, 2.0, 3.0), radius=1.0, length=7.0)
    shape = one.axis, one.radius, one.length, SATURATION, field
    (saturated,) = magnetise([one], field, SATURATION)
    assert saturated.magnetisation == pytest.approx(stoner_wohlfarth.magnetisation(*shape), rel=1e-12)
    (soft,) = magnetise([one], field, SATURATION, math.inf)
    assert soft.magnetisation == pytest.approx(soft_magnet.magnetisation(*shape), abs=1e-6 * SATURATION)


def inside(cylinder, count=17):
    """2^count points of a sequence of low discrepancy in the box about a cylinder, without those outside."""
    x, y, z = (2 * qmc.Sobol(3, scramble=False).random_base2(count) - 1).T
    x, y, z = (one[np.hypot(x, y) < 1] for one in (x, y, z))
    up = np.array(cylinder.direction)
    first = np.cross(up, np.roll(up, 1))
    first /= np.linalg.norm(first)
    across = np.outer(x, first) + np.outer(y, np.cross(up, first))
    return cylinder.centre + cylinder.radius * across + 0.5 * cylinder.length * np.outer(z, up)


def test_the_tensors_are_mean_fields():
    """Compared with the field of each of two at many points in the other, and with the dipole far away; the
    second is smaller."""
    pair = CROSSED[0], CROSSED[1].model_copy(update={"radius": 0.8, "length": 4.0})
    ours = demagnetising_tensors(pair)
    for i, j in ((0, 1), (1, 0)):
        magnets = [pair[j].model_copy(update={"magnetisation": tuple(axis)}) for axis in np.eye(3)]
        b, _ = fields([MagneticCylinders(cylinders=[one]) for one in magnets], [inside(pair[i])] * 3)
        np.testing.assert_allclose(-ours[i, :, j].T, b.mean(axis=1) / mu_0, atol=2e-4)
    far = demagnetising_tensors([CROSSED[0], CROSSED[1].model_copy(update={"centre": (300.0, 0.0, 0.0)})])
    dipole = 10 * np.pi / (4 * np.pi * 300.0**3) * np.diag([-2.0, 1.0, 1.0])
    np.testing.assert_allclose(far[1, :, 0], dipole, atol=1e-3 * np.abs(dipole).max())


def test_sums_of_the_tensors(rng):
    """Traces are 1 within a cylinder and 0 between two that are apart; pairs are reciprocal; the pieces of
    one have the mean of the whole."""
    cylinders = apart(rng, 2)
    tensors = demagnetising_tensors(cylinders)
    np.testing.assert_allclose(np.einsum("iaja->ij", tensors), np.eye(8), atol=1e-12)
    np.testing.assert_allclose(tensors, tensors.transpose(2, 3, 0, 1), atol=1e-15)
    reverse = demagnetising_tensors(cylinders[::-1])[::-1, :, ::-1]
    np.testing.assert_allclose(tensors, reverse, atol=1e-4)
    whole = Cylinder(radius=1.0, length=8.0, axis=(1.0, 2.0, 2.0))
    (bare,) = demagnetising_tensors([whole])[:, :, 0]
    pieces = magnetise([whole], (0.0, 0.0, 0.1), SATURATION, segments=5)
    five = demagnetising_tensors(pieces, 5)
    np.testing.assert_allclose(five.sum(axis=2).mean(axis=0), bare, atol=1e-12)
    np.testing.assert_allclose(five[1, :, 3], five[0, :, 2], atol=1e-15)


@pytest.mark.parametrize("field", FIELDS)
def test_saturated_cylinders_are_in_a_minimum(field, rng):
    """No cylinder gains by turning, by a little or to any direction."""
    cylinders = scattered(rng, 12)
    found = magnetise(cylinders, field, SATURATION, tolerance=1e-9)
    m = magnetisations(found)
    np.testing.assert_allclose(np.linalg.norm(m, axis=1), SATURATION, rtol=1e-12)
    least = energies(cylinders, m, field)
    for spread in (1e-3, 0.1, 10.0):
        trials = np.repeat(m[None], 300, axis=0)
        k = rng.integers(0, 12, 300)
        moved = m[k] / SATURATION + spread * rng.normal(size=(300, 3))
        trials[np.arange(300), k] = SATURATION * moved / np.linalg.norm(moved, axis=1)[:, None]
        assert (energies(cylinders, trials, field) >= least - 1e-12 * abs(least)).all()


@pytest.mark.parametrize("susceptibility", [3.0, math.inf])
@pytest.mark.parametrize("field", FIELDS)
def test_soft_cylinders_are_in_the_minimum(field, susceptibility, rng):
    """Among all magnetisations up to saturation."""
    cylinders = apart(rng, 2, spacing=5.0)
    found = magnetise(cylinders, field, SATURATION, susceptibility, tolerance=1e-9)
    m = magnetisations(found)
    assert (np.linalg.norm(m, axis=1) <= SATURATION * (1 + 1e-12)).all()
    least = energies(cylinders, m, field, 1 / susceptibility)
    for spread in (1e-3, 0.1, 1.0):
        trials = m + spread * SATURATION * rng.normal(size=(500, *m.shape))
        size = np.linalg.norm(trials, axis=2, keepdims=True)
        trials *= np.minimum(1.0, SATURATION / size)
        assert (energies(cylinders, trials, field, 1 / susceptibility) >= least - 1e-12 * abs(least)).all()


def test_linear_cylinders_solve_linear_equations(rng):
    """(1 / chi + N) M = H_0; a permanent magnet among them keeps its magnetisation and acts on the others."""
    cylinders, field = apart(rng, 2), np.array([0.02, -0.01, 0.03])
    cylinders[3] = cylinders[3].model_copy(update={"magnetisation": (2e5, 1e5, -3e5)})
    found = magnetise(cylinders, tuple(field), math.inf, 7.0, permanent=[3], tolerance=1e-11)
    assert found[3].magnetisation == cylinders[3].magnetisation
    m, n = magnetisations(found), demagnetising_tensors(cylinders)
    balance = m / 7.0 + np.einsum("iajb,jb->ia", n, m) - field / mu_0
    assert np.abs(np.delete(balance, 3, axis=0)).max() < 1e-8 * np.abs(m).max()
    without = magnetise(cylinders[:3], tuple(field), math.inf, 7.0)
    assert np.abs(magnetisations(without) - m[:3]).max() > 1e-3 * np.abs(m).max()


def test_it_rotates_with_the_cylinders(rng):
    cylinders, field, turn = (
        apart(rng, 2),
        np.array([0.2, 0.1, 0.3]),
        Rotation.from_rotvec([0.3, 2.0, -1]),
    )
    turned = [
        one.model_copy(update={"centre": tuple(turn.apply(one.centre)), "axis": tuple(turn.apply(one.axis))})
        for one in cylinders
    ]
    for chi in (None, math.inf):
        one = magnetise(cylinders, tuple(field), SATURATION, chi, tolerance=1e-9)
        other = magnetise(turned, tuple(turn.apply(field)), SATURATION, chi, tolerance=1e-9)
        expected = turn.apply(magnetisations(one))
        np.testing.assert_allclose(magnetisations(other), expected, atol=1e-4 * SATURATION)


def test_neighbours_strengthen_in_line_and_weaken_side_by_side():
    def middle(step):
        row = [Cylinder(radius=1.0, length=4.0, centre=tuple(k * np.array(step))) for k in range(3)]
        return magnetise(row, (0.0, 0.0, 0.05), SATURATION, math.inf)[1].magnetisation[2]

    alone = middle((1e4, 0.0, 0.0))
    assert middle((0.0, 0.0, 4.5)) > 1.3 * alone
    assert middle((2.5, 0.0, 0.0)) < 0.8 * alone


@pytest.mark.long
def test_against_boundary_elements():
    """Mean magnetisation of each of two cylinders, with 1 and with 8 pieces each; the boundary elements are
    accurate to half a percent."""
    field = np.array([0.05, 0.02, 0.04])
    for chi, bounds in ((1.0, (0.01, 0.005)), (5.0, (0.08, 0.035))):
        expected = boundary_elements.solve(CROSSED, field / mu_0, chi, 4)[2]
        for segments, bound in zip((1, 8), bounds, strict=True):
            found = magnetise(CROSSED, tuple(field), math.inf, chi, segments=segments)
            assert len(found) == 2 * segments
            mean = magnetisations(found).reshape(2, segments, 3).mean(axis=1)
            error = np.linalg.norm(mean - expected, axis=1) / np.linalg.norm(expected, axis=1)
            assert 0.1 * bound < error.max() < bound
        alone = magnetise(CROSSED[:1], tuple(field), math.inf, chi, segments=8)
        assert np.linalg.norm(magnetisations(alone).mean(axis=0) - expected[0]) > bounds[1] * np.linalg.norm(
            expected[0]
        )


def test_the_boundary_elements_are_right():
    """In the middle of a long cylinder across the field, M = 2 chi / (2 + chi) H_0, and H is H_0 - M/2."""
    (panels, charge, _) = boundary_elements.solve(
        [Cylinder(radius=1.0, length=30.0)], (1.0, 0.0, 0.0), 4.0, 7
    )
    inside = boundary_elements.field(np.array([[0.0, 0.0, 0.0], [0.3, 0.2, 1.0]]), panels, charge)
    np.testing.assert_allclose(inside, [[-2 / 3, 0, 0]] * 2, atol=0.02)
    outside = boundary_elements.field(np.array([[3.0, 0.0, 0.0]]), panels, charge)
    np.testing.assert_allclose(outside, [[2 / 3 / 9, 0, 0]], atol=2e-3)


def test_pieces_form_the_cylinder():
    (one,) = CROSSED[1:]
    pieces = magnetise([one], (0.0, 0.0, 1.0), SATURATION, segments=4)
    assert [piece.length for piece in pieces] == [2.5] * 4
    np.testing.assert_allclose(
        [p.centre for p in pieces], [(2.2, y, 2.0) for y in (-3.75, -1.25, 1.25, 3.75)]
    )
    assert pieces.iterations >= 1
    assert pieces.imbalance <= 1e-6


def test_a_result_beyond_the_tolerance_is_refused(rng):
    with pytest.raises(InputError, match=r"^tolerance must be met within 2 iterations; received 0\.\d+$"):
        magnetise(apart(rng, 2, 5.0), (0.1, 0.0, 0.0), SATURATION, math.inf, iterations=2)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"cylinders": []}, "cylinders must be at least one; received 0"),
        ({"field": (1.0, 2.0)}, "field must be three numbers in T; received (1.0, 2.0)"),
        ({"saturation": -1.0}, "saturation must be greater than 0 and finite; received -1.0"),
        ({"saturation": math.inf}, "saturation must be greater than 0 and finite; received inf"),
        ({"susceptibility": 0.0}, "susceptibility must be greater than 0; received 0.0"),
        ({"segments": 0}, "segments must be a whole number, at least 1; received 0"),
        ({"segments": 5000}, "segments must be such that all pieces are at most 6000; received 10000"),
        ({"permanent": [2]}, "permanent must be indices of cylinders; received 2"),
        ({"tolerance": 0.0}, "tolerance must be between 0 and 1; received 0.0"),
        ({"iterations": 0}, "iterations must be a whole number, at least 1; received 0"),
    ],
)
def test_invalid_values_are_refused(changed, message):
    with pytest.raises(InputError) as fault:
        magnetise(**{"cylinders": CROSSED, "field": (0.1, 0.0, 0.0), "saturation": 1e6, **changed})
    assert str(fault.value) == message
