"""Closed forms of one particle of Z16, compared with runs of one particle."""

import numpy as np
import pytest

from tests.scenes import scene as one_sphere
from tests.scenes import simulate
from tisim.cases.blast import scene as blast
from tisim.cases.blast.checks import blast_radii, turns
from tisim.cases.blast.closed_forms import (
    chow_distance,
    displacement,
    distance_after,
    distance_at,
    drag_rate,
    final_radius,
    parity_field,
    parity_flux,
    relaxation_time,
    speed_at,
    stokes_to_quadratic,
    time_to,
    time_to_radius,
    viscosity_for,
)
from tisim.cases.blast.problem import REST_GENES, rest_scene
from tisim.effects import ConstantDrag, Lorentz, StokesDrag
from tisim.sources import ElectricField, MagneticField
from tisim.steppers import Collocation, StageControl

AIR, DENSITY, RADIUS, CHARGE = 1.2, 900.0, 2e-3, 3.0
"""Density of the fluid and of the sphere (kg/m^3), its radius (m), and its charge over mass (C/kg)."""
SPEED, COEFFICIENT, DURATION = 5.0, 0.6, 2.0
RATE = drag_rate(COEFFICIENT, AIR, DENSITY, RADIUS)
QUADRATIC = ConstantDrag(density=AIR, coefficient=COEFFICIENT)
MASS = DENSITY * 4 / 3 * np.pi * RADIUS**3
ALONG = np.array([2.0, -1.0, 2.0]) / 3


def end(effects, duration=DURATION, along=ALONG):
    """Displacement and velocity of a charged sphere that starts along a unit vector."""
    setup = one_sphere(
        [[0.0, 0.0, 0.0]], [SPEED * along], effects, radius=RADIUS, density=DENSITY, duration=duration,
        stepper=Collocation(control=StageControl(error=1e-10)), quantities={"charge": [CHARGE * MASS]},
    )  # fmt: skip
    (result,) = simulate([setup], capacity=1)
    assert result.status.ok
    return result.state["position"][0], result.state["velocity"][0]


def slowed_in(electric=(0.0, 0.0, 0.0), magnetic=(0.0, 0.0, 0.0)):
    """Effects of quadratic drag and two constant fields, which may be 0; all are compiled once."""
    return (Lorentz(), ElectricField(constant=electric), MagneticField(constant=magnetic), QUADRATIC)


def test_the_numbers_of_the_paper():
    """Its blast at the start: the fields of parity at C_D = 0.5, (6.3) with its own density of air, and
    (4.15)."""
    rate = drag_rate(0.5, blast.AIR, blast.DENSITY, blast.RADIUS)
    assert parity_flux(rate, 1.65178, 10.0) == pytest.approx(1.084e-4, rel=1e-4)
    assert parity_field(rate, 1.65178, 10.0) == pytest.approx(1.084e-4 * 1.65178, rel=1e-4)
    assert blast.FLUX / parity_flux(2 * rate, blast.SPEED, -10.0) == pytest.approx(46126.3, abs=0.1)
    assert stokes_to_quadratic(blast.VISCOSITY, blast.AIR, 0.5, 0.05, 2.0) == pytest.approx(
        3.5265e-4 / 0.1, rel=1e-4
    )


@pytest.mark.long
def test_speed_distance_and_time_with_quadratic_drag():
    place, velocity = end(slowed_in())
    distance, slowed = np.linalg.norm(place), np.linalg.norm(velocity)
    assert distance == pytest.approx(distance_after(DURATION, SPEED, RATE), rel=1e-9)
    assert slowed == pytest.approx(speed_at(distance, SPEED, RATE), rel=1e-9)
    assert distance == pytest.approx(distance_at(slowed, SPEED, RATE), rel=1e-9)
    assert time_to(distance, SPEED, RATE) == pytest.approx(DURATION, rel=1e-9)
    assert slowed < 0.6 * SPEED


@pytest.mark.long
def test_a_field_of_parity_keeps_the_speed():
    """The electric force balances the drag, so the particle neither slows down nor speeds up (5.7)."""
    field = parity_field(RATE, SPEED, CHARGE) * ALONG
    place, velocity = end(slowed_in(electric=tuple(field)))
    np.testing.assert_allclose(velocity, SPEED * ALONG, rtol=1e-9)
    np.testing.assert_allclose(place, SPEED * DURATION * ALONG, rtol=1e-9)


@pytest.mark.long
def test_a_flux_of_parity_turns_as_fast_as_drag_slows_down():
    """Both rates are w = K v_0 at the start (5.8): after 1/w the speed is halved, and has turned by 1
    radian."""
    flux = parity_flux(RATE, SPEED, CHARGE)
    across = np.array([0.6, 0.0, 0.8])
    effects = slowed_in(magnetic=(0.0, float(flux), 0.0))
    _, velocity = end(effects, 1 / (CHARGE * flux), across)
    assert np.linalg.norm(velocity) == pytest.approx(SPEED / 2, rel=1e-9)
    assert velocity @ across == pytest.approx(SPEED / 2 * np.cos(1.0), rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("w_tau", [0.0, 0.5, 3.0])
def test_stokes_drag_in_a_field(w_tau):
    """The displacement at any time, the time to a radius (A.14), and the place of rest."""
    tau = 0.4
    drag = StokesDrag(viscosity=viscosity_for(tau, DENSITY, RADIUS))
    assert relaxation_time(drag.viscosity, DENSITY, RADIUS) == pytest.approx(tau, rel=1e-12)
    field = MagneticField(constant=(0.0, 0.0, w_tau / tau / CHARGE))
    across, along = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    for time in (0.3, 40 * tau):
        place, _ = end((Lorentz(), field, drag), time, across)
        exact = displacement(time, SPEED, tau, w_tau / tau)
        np.testing.assert_allclose(place, [exact.real, exact.imag, 0.0], atol=1e-9 * SPEED * tau)
    assert np.linalg.norm(place) == pytest.approx(SPEED * tau / np.hypot(1, w_tau), rel=1e-9)
    assert np.arctan2(-place[1], place[0]) == pytest.approx(np.arctan(w_tau), abs=1e-9)
    (_, _, far), _ = end((Lorentz(), field, drag), 0.3, along)
    assert far == pytest.approx(displacement(0.3, SPEED, tau).real, rel=1e-9)
    assert time_to_radius(far, SPEED, tau) == pytest.approx(0.3, rel=1e-9)
    assert far < final_radius(SPEED, tau) == pytest.approx(abs(displacement(40 * tau, SPEED, tau)), rel=1e-12)


def test_displacement_without_drag_is_the_chord_of_a_circle():
    time = np.array([0.0, 0.2, 1.0])
    circle = SPEED / 7.0 * (np.sin(7.0 * time) - 1j * (1 - np.cos(7.0 * time)))
    np.testing.assert_allclose(displacement(time, SPEED, w=7.0), circle, rtol=1e-13)
    np.testing.assert_allclose(displacement(time, SPEED), SPEED * time, rtol=1e-15)
    # A tiny field, or a huge tau, changes nothing but the last digits.
    np.testing.assert_allclose(displacement(time, SPEED, 1e20, 1e-20), SPEED * time, rtol=1e-15)


@pytest.mark.slow
def test_chow_gives_a_smaller_blast_than_the_constant_coefficient():
    """Z16 4.2 says larger. Its own coefficients are at least 0.5 for any Reynolds number up to 3e5."""
    chow, constant = blast_radii()
    exact = chow_distance(blast.SPEED, blast.AIR, blast.VISCOSITY, blast.DENSITY, blast.RADIUS)
    assert chow == pytest.approx(exact, rel=1e-5)
    assert chow < 0.61 * constant


@pytest.mark.long
def test_mixed_charges_turn_in_both_senses():
    """Z16 3.2, remark 1."""
    setup = blast.scene(number=200, **blast.SIZES["mixed"].scene)
    (result,) = simulate([setup], capacity=200)
    sign, angle = np.sign(result.start["charge"]), blast.SPECIFIC_CHARGE * blast.MIXED_FLUX * result.time
    assert 60 < (sign > 0).sum() < 140
    np.testing.assert_allclose(turns(result), -sign * angle, atol=2e-4)


@pytest.mark.long
@pytest.mark.parametrize("end_of_range", ["low", "high"])
def test_coarse_steps_find_the_place_of_rest(end_of_range):
    """The trapezoidal rule does so exactly, in any field and fluid of the search."""
    design = {gene.name: getattr(gene, end_of_range) for gene in REST_GENES}
    (result,) = simulate([rest_scene(design, 0, 60)], capacity=60)
    tau = relaxation_time(design["viscosity"], blast.DENSITY, blast.RADIUS)
    flux = np.array([design[f"flux_{axis}"] for axis in "xyz"])
    w, b = blast.SPECIFIC_CHARGE * np.linalg.norm(flux), flux / np.linalg.norm(flux)
    v = result.start["velocity"]
    along = (v @ b)[:, None] * b
    across, turned = displacement(40 * tau, 1.0, tau, w), np.cross(b, v)
    exact = tau * along + across.real * (v - along) + across.imag * turned
    moved = result.state["position"] - result.start["position"]
    np.testing.assert_allclose(moved, exact, atol=1e-3 * blast.SPEED * tau)
