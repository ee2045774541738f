"""Clump templates: their rigid bodies, and invalid input."""

import numpy as np
import pytest

from tisim import Box, Clump, InputError, Particles
from tisim.geometry.sphere_union import sphere_union

PEAR = Clump(
    centres=[(0, 0, 0), (1.6, 0, 0), (0.5, 1.3, 0), (0, 0, 0.9)], radii=[1, 0.8, 0.7, 0.5], density=3.0
)


def test_the_body_is_the_union_in_its_principal_axes():
    body, solid = PEAR.body, sphere_union(PEAR.centres, PEAR.radius)
    assert body.mass == 3.0 * solid.volume < 0.99 * 4 * np.pi * (PEAR.radius**3).sum()
    np.testing.assert_allclose(body.axes.T @ body.axes, np.eye(3), atol=1e-14)
    assert np.linalg.det(body.axes) == pytest.approx(1)
    np.testing.assert_allclose(body.axes @ np.diag(body.moments) @ body.axes.T, 3 * solid.inertia, rtol=1e-12)
    np.testing.assert_allclose(solid.centre + body.places @ body.axes.T, PEAR.centres, atol=1e-14)


def test_sphere_masses_preserve_the_centre_of_mass():
    """Sphere masses are positive, and equal the volumes of spheres that do not overlap."""
    body = PEAR.body
    assert body.masses.sum() == pytest.approx(body.mass, rel=1e-14)
    assert (body.masses > 0).all()
    np.testing.assert_allclose(body.masses @ body.places, 0, atol=1e-9 * body.mass)
    apart = Clump(centres=[(0, 0, 0), (3, 0, 0), (0, 3, 0)], radii=[1, 2, 1.5], density=2.0)
    np.testing.assert_allclose(apart.body.masses, 2 * 4 / 3 * np.pi * np.array([1, 8, 1.5**3]), rtol=1e-12)


def test_mass_and_inertia_may_be_given():
    """Inertia about the centre of mass, from which sphere centres are measured; here the axes are not
    principal."""
    inertia = [(2.0, 0.3, 0.0), (0.3, 2.0, 0.1), (0.0, 0.1, 3.0)]
    body = Clump(centres=[(-1, 0, 0), (1, 0, 0)], radii=[0.5], mass=7.0, inertia=inertia).body
    assert body.mass == 7.0
    np.testing.assert_allclose(body.axes @ np.diag(body.moments) @ body.axes.T, inertia, atol=1e-14)
    np.testing.assert_allclose(body.masses, [3.5, 3.5], rtol=1e-12)


PAIR = {"centres": [(-1, 0, 0), (1, 0, 0)], "radii": [0.5]}
FLAT = [(1.0, 0, 0), (0, 1.0, 0), (0, 0, 2.5)]
REFUSED = {
    "no density": ({}, "clump must be given density, or mass and inertia; received none"),
    "both": ({"density": 1.0, "mass": 1.0}, "clump must be given density, or mass and inertia"),
    "radii": ({"density": 1.0, "radii": [1, 1, 1]}, r"clump.radii must be one value or 2 of them"),
    "buried": ({"density": 1.0, "radii": [3.0, 0.5]}, "clump must be of spheres none of which lies within"),
    "inertia": ({"mass": 1.0, "inertia": FLAT}, r"clump.inertia must be symmetric, with moments above 0"),
    "off": (
        {"mass": 1.0, "inertia": np.eye(3).tolist(), "centres": [(1, 0, 0), (3, 0, 0)]},
        "clump must be one whose centre of mass lies between the centres of its spheres",
    ),
}


@pytest.mark.parametrize("why", REFUSED)
def test_impossible_values_are_refused(why):
    wrong, message = REFUSED[why]
    with pytest.raises(InputError, match=message):
        Clump(**{**PAIR, **wrong})


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"position": [1, 2]}, r"clumps.position must be numbers of shape \(n, 3\)"),
        (
            {"orientation": [(1, 0, 0, 0)] * 3},
            r"clumps.orientation must be numbers of shape \(4,\) or \(2, 4\)",
        ),
        ({"orientation": (0, 0, 0, 0)}, r"clumps.orientation must be other than 0"),
        ({"clumps": [PEAR]}, r"clumps must be one, or 2 of them"),
    ],
)
def test_poses_are_checked(wrong, message):
    with pytest.raises(InputError, match=message):
        Particles.of_clumps(**{"clumps": PEAR, "position": np.zeros((2, 3)), **wrong})


def test_clumps_and_spheres_have_their_given_materials():
    clump = Clump(centres=[(0, 0, 0), (1e-3, 0, 0)], radii=[1e-3], density=2500.0)
    places = [(0.0, 0.0, 0.1), (0.0, 0.0, 0.2)]
    alone = {"position": [(0.0, 0.0, 0.0)], "velocity": [(0.0, 0.0, 0.0)], "radius": 1e-3, "mass": 1e-6}
    spheres = Particles(**alone, material="steel")
    both = Particles.of_clumps(clump, places, material=["glass", "steel"], spheres=spheres)
    assert both.material == ("glass", "glass", "steel", "steel", "steel")
    with pytest.raises(InputError, match=r"^material must be given for both clumps and the spheres"):
        Particles.of_clumps(clump, places, spheres=spheres)
    with pytest.raises(InputError, match=r"^clumps\.charge must be one value or 2 of them; received 3"):
        Particles.of_clumps(clump, places, quantities={"charge": [1.0, 2.0, 3.0]})


def test_a_position_rounded_below_a_periodic_face_is_wrapped():
    clump = Clump(centres=[(0, 0, 0)], radii=[0.1], density=2500.0)
    box = Box(low=(0, 0, 0), high=(1, 1, 1))
    made = Particles.of_clumps(clump, [(-1e-17, 0.5, 0.5)], box=box)
    np.testing.assert_array_equal(made.position, [(0.0, 0.5, 0.5)])
