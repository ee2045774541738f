"""Drag against its NumPy reference, in all branches of each law; and its derivative by velocity."""

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, close, cloud, jacobians, loads, vector
from tests.scenes import scene, simulate
from tisim import InputError
from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects import ChowDrag, ConstantDrag, Gravity, SchillerNaumannDrag, StokesDrag
from tisim.sources import Source
from tisim.sources.base import parameter
from tisim.steppers import ErrorControl, Trapezoid


class MeanShear(Source):
    """v_f = v_0 + G r, for the drag laws."""

    quantity = "flow_velocity"
    mean: Vector = parameter("m/s", "mean")
    rate: Vector = parameter("1/s", "rate")

    @ti.func
    def value(self, w, r, t):
        return self.mean(w) + self.rate(w) * r.yzx

    @staticmethod
    def reference(source, r):
        return np.array(source.mean) + np.array(source.rate) * r[:, [1, 2, 0]]


REYNOLDS = np.array([1e-3, 0.5, 1.5, 50.0, 399.0, 401.0, 1e5, 2.9e5, 3.1e5, 1e6, 2.1e6, 1e9])
"""Two or more in each of Chow's five intervals."""


def chow_coefficient(re):
    """Z16 section 4.2, as printed."""
    bounds = [re <= 1, re <= 400, re <= 3e5, re <= 2e6]
    return np.select(bounds, [24 / re, 24 / re**0.646, 0.5, 0.000366 * re**0.4275], 0.18)


def schiller_naumann_coefficient(re):
    return np.where(re <= 1000, 24 / re * (1 + 0.15 * re**0.687), 0.44)


COEFFICIENTS = {ChowDrag: chow_coefficient, SchillerNaumannDrag: schiller_naumann_coefficient}


def drag_reference(law, state, flow=0.0):
    u = flow - state["velocity"]
    speed, radius = np.linalg.norm(u, axis=1), state["radius"]
    if isinstance(law, StokesDrag):
        return 6 * np.pi * law.viscosity * radius[:, None] * u
    if type(law) in COEFFICIENTS:
        coefficient = COEFFICIENTS[type(law)](2 * radius * law.density * speed / law.viscosity)
    else:
        coefficient = law.coefficient
    return (0.5 * law.density * coefficient * speed * np.pi * radius**2)[:, None] * u


def drags(rng, kind):
    """One law for a world."""
    options = {
        "density": rng.uniform(1, 2),
        "viscosity": rng.uniform(0.01, 0.02),
        "coefficient": rng.uniform(),
    }
    return kind(**{name: value for name, value in options.items() if name in kind.model_fields})


def at_reynolds(rng, law, n=12):
    """Particles at rest, in the fluid's frame or not, with Reynolds numbers REYNOLDS; each has its own
    radius."""
    setup = cloud(rng, (law,), n=n)
    start = setup.particles.arrays(setup.domain, 0)
    speed = REYNOLDS * law.viscosity / (2 * start["radius"] * law.density)
    unit = start["velocity"] / np.linalg.norm(start["velocity"], axis=1, keepdims=True)
    return scene(start["position"], unit * speed[:, None], (law,), radius=start["radius"], mass=start["mass"])


@pytest.mark.parametrize("kind", [ConstantDrag, ChowDrag, SchillerNaumannDrag, StokesDrag])
def test_drag_in_a_fluid_at_rest(kind, rng):
    if kind in COEFFICIENTS:
        scenes = [at_reynolds(rng, drags(rng, kind)) for _ in range(WORLDS)]
    else:
        scenes = [cloud(rng, (drags(rng, kind),)) for _ in range(WORLDS)]
    for one, state in zip(scenes, loads(scenes), strict=True):
        expected = drag_reference(one.effects[0], state)
        np.testing.assert_allclose(state["force"], expected, rtol=1e-12)
        assert ((state["force"] * state["velocity"]).sum(axis=1) < 0).all()


@pytest.mark.long
@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(ConstantDrag, marks=pytest.mark.slow),
        ChowDrag,
        pytest.param(SchillerNaumannDrag, marks=pytest.mark.slow),
        pytest.param(StokesDrag, marks=pytest.mark.slow),
    ],
)
def test_drag_in_a_flow(kind, rng):
    """Relative to the flow at the position of each particle."""
    scenes = [
        cloud(rng, (MeanShear(mean=vector(rng), rate=vector(rng)), drags(rng, kind))) for _ in range(WORLDS)
    ]
    for one, state in zip(scenes, loads(scenes), strict=True):
        flow, law = one.effects
        velocity = MeanShear.reference(flow, state["position"])
        np.testing.assert_allclose(
            state["force"],
            drag_reference(law, state, velocity),
            rtol=1e-12,
        )


def test_chow_meets_stokes_at_small_reynolds_numbers(rng):
    setup = at_reynolds(rng, ChowDrag(density=1.2, viscosity=1.8e-5))
    (state,) = loads([setup])
    slow = REYNOLDS <= 1
    assert slow.sum() == 2
    stokes = drag_reference(StokesDrag(viscosity=1.8e-5), state)
    np.testing.assert_allclose(state["force"][slow], stokes[slow], rtol=1e-12)


@pytest.mark.parametrize("kind", [ConstantDrag, ChowDrag, SchillerNaumannDrag, StokesDrag])
def test_nothing_drags_at_rest(kind, rng):
    """No force, and no NaN; the derivative is Stokes's or zero."""
    law = drags(rng, kind)
    setup = scene(np.zeros((1, 3)), np.zeros((1, 3)), (law,), radius=0.3)
    np.testing.assert_array_equal(loads([setup])[0]["force"], 0)
    ((claimed,),) = (jacobians([setup], 1e-6)[0],)
    expected = 0.0 if kind is ConstantDrag else -6 * np.pi * law.viscosity * 0.3
    np.testing.assert_allclose(claimed[0], expected * np.eye(3), rtol=1e-12, atol=0)


@pytest.mark.long
@pytest.mark.parametrize("kind", [ConstantDrag, StokesDrag])
def test_velocity_jacobians_are_the_derivatives(kind, rng):
    """Against a central difference of the force, in a flow."""
    scenes = [
        cloud(rng, (MeanShear(mean=vector(rng), rate=vector(rng)), drags(rng, kind))) for _ in range(WORLDS)
    ]
    for claimed, difference in zip(*jacobians(scenes, 1e-4), strict=True):
        close(claimed, difference, 1e-7)


@pytest.mark.parametrize("kind", COEFFICIENTS)
def test_velocity_jacobian_in_each_piece_of_a_law(kind, rng):
    """Steps small enough for the slowest particles of an interval, and large enough against rounding for the
    fastest."""
    scenes = [at_reynolds(rng, drags(rng, kind)) for _ in range(WORLDS)]
    for which, step in ((slice(0, 3), 1e-7), (slice(3, 8), 1e-4), (slice(8, 12), 1.0)):
        for claimed, difference in zip(*jacobians(scenes, step), strict=True):
            for a, b in zip(claimed[which], difference[which], strict=True):
                close(a, b, 2e-6)


def test_schiller_and_naumann_have_their_known_jump():
    """From 0.4383 to 0.44 at a Reynolds number of 1000; at small Reynolds numbers they agree with Stokes."""
    assert schiller_naumann_coefficient(1000.0) == pytest.approx(0.4383, abs=5e-5)
    law, radius = SchillerNaumannDrag(density=2.0, viscosity=0.01), 0.1
    reynolds = np.array([1000.0 * (1 - 1e-9), 1000.0 * (1 + 1e-9), 1e-8])
    speed = reynolds * law.viscosity / (2 * radius * law.density)
    velocity = np.outer(speed, [0.6, 0.0, 0.8])
    (state,) = loads([scene(velocity, velocity, (law,), radius=radius, mass=1.0)])
    drag = np.linalg.norm(state["force"], axis=1)
    assert drag[1] / drag[0] == pytest.approx(0.44 / 0.4383, abs=2e-4)
    assert drag[2] == pytest.approx(6 * np.pi * law.viscosity * radius * speed[2], rel=1e-6)


@pytest.mark.slow
def test_a_sphere_falls_at_the_terminal_velocity_of_schiller_and_naumann():
    """Weight equals drag: m g = 1/2 rho_f C_D(Re) v^2 pi R^2, at Reynolds numbers from 2 to 3000.

    Masses are chosen for these numbers; with a wrong coefficient a sphere falls at another speed.
    """
    law, radius, reynolds = SchillerNaumannDrag(density=1000.0, viscosity=1e-3), 1e-3, [2.0, 80.0, 900.0, 3e3]
    speed = np.array(reynolds) * law.viscosity / (2 * radius * law.density)
    drag = 0.5 * law.density * schiller_naumann_coefficient(np.array(reynolds)) * speed**2 * np.pi * radius**2
    setup = scene(
        [[0.1 * k, 0, 0] for k in range(4)],
        np.zeros((4, 3)),
        (Gravity(acceleration=(0, 0, -10.0)), law),
        radius=radius,
        mass=drag / 10,
        stepper=Trapezoid(control=ErrorControl(error=1e-8, tolerance=1e-10, first=1e-4, longest=0.01)),
        duration=3.0,
    )
    (result,) = simulate([setup], capacity=4)
    assert result.status.ok
    np.testing.assert_allclose(result.state["velocity"][:, 2], -speed, rtol=1e-6)
    np.testing.assert_allclose(result.state["velocity"][:, :2], 0, atol=0)


WRONG = {
    "schiller_naumann_drag.viscosity must be greater than 0.0; received 0": lambda: SchillerNaumannDrag(
        density=1, viscosity=0
    ),
    "chow_drag.density must be greater than 0.0; received 0": lambda: ChowDrag(density=0, viscosity=1),
    "stokes_drag.viscosity must be greater than 0.0; received -1": lambda: StokesDrag(viscosity=-1),
    "constant_drag.coefficient must be given (drag coefficient C_D); received nothing": lambda: ConstantDrag(
        density=1
    ),
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        WRONG[message]()
    assert str(fault.value) == message
