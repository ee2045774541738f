"""The case of Z16: numbers of its start, and the effect of the field on a small ball of particles."""

from pathlib import Path

import numpy as np
import pytest

from tests.scenes import simulate
from tisim.cases.blast.checks import PAPER_STEP, growth, growth_by_euler
from tisim.cases.blast.scene import ENERGY, FLUX, NEIGHBOURS, NUMBER, SPECIFIC_CHARGE, SPEED, scene
from tisim.cases.blast.shape import contacts, half_axes

SMALL = 200
PAGE = Path(__file__).parents[3] / "docs" / "blast.md"


def test_start_has_the_speed_and_the_energy_of_the_paper():
    blast = scene(number=SMALL)
    start = blast.particles.arrays(blast.domain, 0)
    speed = np.linalg.norm(start["velocity"], axis=1)
    np.testing.assert_allclose(speed, SPEED, rtol=1e-12)
    assert (start["mass"] * speed**2).sum() / 2 == pytest.approx(ENERGY * SMALL / NUMBER)
    np.testing.assert_allclose(start["charge"], SPECIFIC_CHARGE * start["mass"])


@pytest.mark.long
def test_the_field_makes_an_ellipsoid_of_the_sphere():
    """Particles circle across the field, and fly freely along it."""
    still, field = simulate(
        [scene(flux, number=SMALL, duration=0.3) for flux in (0.0, FLUX)], worlds=2, capacity=SMALL
    )
    assert still.status.ok
    assert field.status.ok
    a, b = half_axes(still.state), half_axes(field.state)
    assert a.max() / a.min() < 1.15
    assert b[0] == pytest.approx(a[0], rel=1e-3)
    assert b[0] > 1.4 * b[1:].max()
    across = np.linalg.norm((field.state["position"] - field.start["position"])[:, 1:], axis=1)
    rate = SPECIFIC_CHARGE * FLUX
    assert across.max() == pytest.approx(2 * SPEED / rate * abs(np.sin(rate * 0.3 / 2)), rel=2e-3)


@pytest.mark.long
def test_explicit_euler_speeds_particles_up_by_its_closed_form():
    """Z16 (6.1) with dt = 1e-4 s, whose error the paper calls negligible; no force does work on a
    particle."""
    assert growth(0.0, PAPER_STEP, 1.0) == pytest.approx(growth_by_euler(PAPER_STEP, 1.0), rel=1e-11)
    assert growth(0.5, PAPER_STEP, 1.0) == pytest.approx(1.0, abs=1e-11)


def test_the_page_has_the_growth_by_explicit_euler():
    page = PAGE.read_text(encoding="utf-8")
    for dt in (PAPER_STEP, PAPER_STEP / 10):
        assert f"{growth_by_euler(dt, 1.0):.4f}" in page


@pytest.mark.slow
def test_contact_conserves_momentum_and_takes_energy():
    """Without air and field, touching spheres exchange momentum and dissipate energy."""
    blast = scene(0.0, contact=True, number=60, duration=0.02)
    (result,) = simulate([blast.without("chow_drag")], worlds=1, capacity=60)
    assert result.status.ok, result.status.reason
    start, end = result.start, result.state
    impulse = (start["mass"][:, None] * (end["velocity"] - start["velocity"])).sum(axis=0)
    assert np.abs(impulse).max() < 1e-9 * start["mass"].sum() * SPEED
    energy = [(s["mass"] * (s["velocity"] ** 2).sum(axis=1)).sum() / 2 for s in (start, end)]
    assert energy[1] <= energy[0] * (1 + 1e-6)


@pytest.mark.slow
def test_neighbours_agglomerate_but_not_by_contact_alone():
    """Z16 Fig. 9: clumps form while the cloud continues to grow along the field."""
    blast = scene(number=100, duration=0.1, contact=True, near=True, cutoff=NEIGHBOURS)
    law = "effects.truncated_near_field"
    without = blast.replace({f"{law}.alpha1": 0.0, f"{law}.alpha2": 0.0})
    alone, blast_result = simulate([without, blast], worlds=2, capacity=100)
    assert blast_result.status.ok, blast_result.status.reason
    assert contacts(blast_result.state) > 5 * contacts(alone.state)
    assert contacts(blast_result.state) > 40
    assert half_axes(blast_result.state)[0] > 1.1 * half_axes(blast_result.start)[0]
