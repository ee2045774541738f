"""Flows that act on particles through drag laws, against NumPy and a closed form."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, close, cloud, loads, vector
from tests.scenes import scene, simulate
from tisim import InputError
from tisim.effects import StokesDrag
from tisim.sources import DarcyFlow, FieldSampler, UniformFlow, kozeny_carman
from tisim.steppers import ErrorControl, Trapezoid

FORMS = [("fibres", "packing", 4.0), pytest.param("spheres", "pores", 6.0, marks=pytest.mark.long)]


@pytest.mark.parametrize(("packed", "mean", "per_size"), FORMS)
def test_drag_in_both_flows_together(packed, mean, per_size, rng):
    """B16 (7.3), (7.4): U = eps^3 nu^2 / (C (1 - eps)^2) (-grad p) / eta, nu = V / S."""
    scenes = []
    for _ in range(WORLDS):
        darcy = DarcyFlow(
            pressure_gradient=vector(rng),
            viscosity=float(rng.uniform(0.1, 1)),
            porosity=float(rng.uniform(0.1, 0.9)),
            diameter=float(rng.uniform(1, 3)),
            constant=float(rng.uniform(4, 6)),
            packed=packed,
            mean=mean,
        )
        scenes.append(cloud(rng, (UniformFlow(velocity=vector(rng)), darcy, StokesDrag(viscosity=0.7))))
    for one, state in zip(scenes, loads(scenes), strict=True):
        flow, darcy, _ = one.effects
        eps, nu = darcy.porosity, darcy.diameter / per_size
        speed = eps**3 * nu**2 / (darcy.constant * (1 - eps) ** 2) / darcy.viscosity
        speed /= eps if mean == "pores" else 1.0
        fluid = np.array(flow.velocity) - speed * np.array(darcy.pressure_gradient)
        expected = 6 * np.pi * 0.7 * state["radius"][:, None] * (fluid - state["velocity"])
        np.testing.assert_allclose(state["force"], expected, rtol=1e-12, atol=1e-12)


def test_flows_begin_and_end():
    """They act at their beginning, no more at their end, and a flow that never ends acts always."""
    whole = UniformFlow(velocity=(1, 2, 3))
    darcy = DarcyFlow(pressure_gradient=(-5.0, 0, 0), viscosity=1.0, porosity=0.5, diameter=1.0)
    times = {"begin": 2.0, "end": 3.0}
    both = [one.model_copy(update=times) for one in (whole, darcy)]
    place = np.zeros((1, 3))
    with FieldSampler(both, "flow_velocity") as field:
        for time, acts in ((0.0, 0), (1.999, 0), (2.0, 1), (2.999, 1), (3.0, 0)):
            found, slope = field(place, time)
            if acts:
                np.testing.assert_allclose(found[:, 1:], [[2, 3]])
                assert found[0, 0] > 1
            assert found.any() == bool(acts)
            assert not slope.any()
    assert not whole.kinked
    assert all(one.kinked for one in both)
    with pytest.raises(InputError, match=r"uniform_flow\.end must be after uniform_flow\.begin, 2 s"):
        UniformFlow(velocity=(1, 2, 3), begin=2.0, end=1.0)


def test_permeability_of_blake_kozeny_and_carman():
    """Spheres with C = 5: eps^3 D^2 / (180 (1 - eps)^2), the textbook form."""
    assert kozeny_carman(0.4, 1e-3 / 6, 5.0) == pytest.approx(0.4**3 * 1e-6 / (180 * 0.6**2), rel=1e-14)


def test_permeability_of_the_fibres_of_b16():
    """B16 7.4.4 measures 2.2e-4 cm^2 for fibres of 0.4 mm by 4 mm, at a solid fraction that it does not
    give. nu = V / S of a cylinder with its ends."""
    volume, surface = np.pi / 4 * 0.4e-3**2 * 4e-3, np.pi * 0.4e-3 * (4e-3 + 0.2e-3)
    assert kozeny_carman(0.6, volume / surface, 5.0) == pytest.approx(2.449e-9, rel=1e-3)
    assert kozeny_carman(1 - 0.204, volume / surface, 5.0) == pytest.approx(2.2e-8, rel=0.005)


@pytest.mark.slow
def test_a_particle_takes_up_the_velocity_of_the_fluid():
    """v = v_f (1 - exp(-t/tau)), tau = m / (6 pi mu R), from rest."""
    tau, end = 2.0 / (6 * np.pi * 0.5 * 0.1), 3.0
    setup = scene(
        [[0, 0, 0]],
        [[0, 0, 0]],
        (UniformFlow(velocity=(1, -2, 3)), StokesDrag(viscosity=0.5)),
        radius=0.1,
        mass=2.0,
        stepper=Trapezoid(control=ErrorControl(error=1e-8, tolerance=1e-10, first=1e-3, longest=0.1)),
        duration=end,
    )
    (result,) = simulate([setup], capacity=4)
    assert result.status.ok
    expected = np.array([1, -2, 3]) * (1 - np.exp(-end / tau))
    close(result.state["velocity"][0], expected, 1e-6)


WRONG = {
    "darcy_flow.porosity must be less than 1.0; received 1": {"porosity": 1},
    "darcy_flow.diameter must be greater than 0.0; received 0": {"diameter": 0},
    "darcy_flow.packed must be 'fibres' or 'spheres'; received 'wool'": {"packed": "wool"},
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    right = {"pressure_gradient": (0, 0, 1), "viscosity": 1e-3, "porosity": 0.5, "diameter": 1e-3}
    with pytest.raises(InputError) as fault:
        DarcyFlow(**{**right, **WRONG[message]})
    assert str(fault.value) == message
