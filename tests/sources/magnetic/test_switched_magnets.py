"""Magnets that are magnetised between two times."""

import numpy as np
import pytest

from tisim import InputError
from tisim.sources import Cylinder, FieldSampler, MagneticCylinders, MagneticSpheres, Sphere, sample

FLUX = "magnetic_flux_density"
BEFORE_AND_AFTER = ((0.0, 0.0), (0.4999, 0.0), (0.5, 1.0), (0.7499, 1.0), (0.75, 0.0), (9.0, 0.0))
"""Times, and whether the bodies are then magnetised from 0.5 to 0.75 s."""


def cylinders(**times):
    body = Cylinder(radius=1e-3, length=4e-3, magnetisation=(1e5, 0, 2e5))
    return MagneticCylinders(cylinders=[body], **times)


def spheres(**times):
    return MagneticSpheres(spheres=[Sphere(radius=1e-3, magnetisation=(1e5, 0, 2e5))], **times)


BOTH = pytest.mark.parametrize("magnets", [cylinders, spheres])


@BOTH
def test_magnets_act_between_their_begin_and_their_end(magnets):
    """Outside and inside, field and gradient are those of magnets without an end, or zero."""
    points = [[1.5e-3, 2e-4, 3e-4], [1e-4, 2e-4, 3e-4]]
    always = sample((magnets(),), FLUX, points)
    assert np.linalg.norm(always[0], axis=1).min() > 1e-3
    with FieldSampler((magnets(begin=0.5, end=0.75),), FLUX) as switched:
        for t, share in BEFORE_AND_AFTER:
            for value, whole in zip(switched(points, t), always, strict=True):
                np.testing.assert_array_equal(value, share * whole)


@BOTH
def test_an_end_before_the_begin_is_refused(magnets):
    name = magnets().kind()
    with pytest.raises(InputError, match=rf"{name}\.end must be after {name}\.begin, 0\.5 s; received 0\.25"):
        magnets(begin=0.5, end=0.25)
    assert (magnets().kinked, magnets(end=1.0).kinked, magnets(begin=1.0).kinked) == (False, True, True)
