"""Magnetic moments along the field, and the force of a field on them, against NumPy and closed forms."""

from decimal import Decimal, getcontext

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, close, cloud, fields_beside_the_core, loads, vector
from tests.effects.magnetic.magnets import K_B, MU_0, Quadrupole, flux_density, gradient
from tests.scenes import scene, simulate
from tisim import InputError
from tisim.effects import FixedMoment, InducedMoment, LangevinMoment, Magnetophoresis
from tisim.sources import MagneticField
from tisim.steppers import Boris, Collocation, ErrorControl, FixedStep, StageControl, Trapezoid, Verlet


def langevin(x):
    """L(x) = coth x - 1/x with 60 digits."""
    getcontext().prec = 60
    x = Decimal(float(x))
    e = (-2 * x).exp()
    return float((1 + e) / (1 - e) - 1 / x)


def made_of(rng, law, **quantities):
    effects = (
        Quadrupole(constant=vector(rng), scale=vector(rng)),
        MagneticField(constant=vector(rng)),
        law,
        Magnetophoresis(),
    )
    return cloud(rng, effects, quantities=quantities)


def check(scenes, size):
    """Moments of ``size`` along B, and the force of the field gradient on them."""
    for one, state in zip(scenes, loads(scenes), strict=True):
        b = flux_density(one.effects, state["position"])
        strength = np.linalg.norm(b, axis=1)
        expected = (size(one.effects[2], state, strength) / strength)[:, None] * b
        close(state["moment"], expected)
        close(state["force"], np.einsum("iab,ib->ia", gradient(one.effects, state["position"]), expected))


def test_langevin_moments_of_many_domains(rng):
    """x from 1e-2 to 1e2; each particle has its own domains."""
    scenes = []
    for _ in range(WORLDS):
        law = LangevinMoment(temperature=float(rng.uniform(100, 500)))
        domains = K_B * law.temperature * 10 ** rng.uniform(-2, 2, 12)
        scenes.append(made_of(rng, law, saturation_moment=rng.uniform(0, 2, 12), domain_moment=domains))

    def size(law, state, strength):
        x = state["domain_moment"] * strength / (K_B * law.temperature)
        return state["saturation_moment"] * [langevin(x) for x in x]

    check(scenes, size)


def test_induced_moments_of_magnetised_spheres(rng):
    """V M with M = chi H and H = H_0 - M/3 inside; from a superconductor to iron."""
    scenes = [
        made_of(rng, InducedMoment(susceptibility=chi)) for chi in (-1, -1e-5, 0, 1e-3, 0.5, 3, 1e3, 1e6)
    ]

    def size(law, state, strength):
        magnetisation = np.linalg.solve([[1, -law.susceptibility], [1 / 3, 1]], [0, 1])[0] / MU_0
        return 4 / 3 * np.pi * state["radius"] ** 3 * magnetisation * strength

    check(scenes, size)


STEPPERS = [
    pytest.param(Verlet(control=FixedStep(dt=1e-3)), id="verlet"),
    pytest.param(Boris(control=FixedStep(dt=1e-3)), id="boris", marks=pytest.mark.slow),
    pytest.param(
        Trapezoid(control=ErrorControl(error=1e-6, tolerance=1e-9, first=1e-3, longest=1e-2)),
        id="trapezoid, each particle alone",
        marks=pytest.mark.slow,
    ),
    pytest.param(
        Collocation(control=StageControl(error=1e-10, first=1e-3)), id="collocation", marks=pytest.mark.slow
    ),
]


@pytest.mark.long
@pytest.mark.parametrize("stepper", STEPPERS)
def test_every_stepper_solves_moments_before_forces(stepper):
    """In B = (y, x, 0), T, the force on a moment k B is k r in the plane: r = r_0 cosh wt + v_0/w sinh wt,
    w^2 = k/m. The final moment belongs to the final position; with Boris' stepper, to the position half a
    step before."""
    k = 4 * np.pi / MU_0 * 0.4 * 1e-7
    effects = (
        Quadrupole(constant=(0, 0, 0), scale=(1, 1, 0)),
        InducedMoment(susceptibility=2.0),
        Magnetophoresis(),
    )
    place, speed = np.array([[1.0, 0.5, 0], [-0.2, 0.3, 0]]), np.array([[0.0, 2, 0], [1, 0, 0]])
    setup = scene(place, speed, effects, radius=0.1 ** (7 / 3), mass=k / 4, duration=1.5, stepper=stepper)
    (result,) = simulate([setup], capacity=4)
    assert result.status.ok
    r = place * np.cosh(3.0) + speed / 2 * np.sinh(3.0)
    np.testing.assert_allclose(result.state["position"], r, rtol=0, atol=1e-4)
    lag = 0.5e-3 if isinstance(stepper, Boris) else 0.0
    last = result.state["position"] - lag * result.state["velocity"]
    np.testing.assert_allclose(result.state["moment"], k * last[:, [1, 0, 2]], rtol=0, atol=1e-5 * k)


def test_only_needed_fields_are_allocated():
    field = MagneticField(constant=(0, 0, 1))
    fixed = {"moment", "saturation_moment"}
    for law, more in (
        (FixedMoment(), fixed),
        (LangevinMoment(temperature=1), fixed | {"domain_moment"}),
        (InducedMoment(susceptibility=1), {"moment"}),
    ):
        assert fields_beside_the_core(scene([[0, 0, 0]], [[0, 0, 0]], (field, law))) == more


AT_REST = ([[0, 0, 0]], [[0, 0, 0]])
WRONG = {
    "effects.fixed_moment must be used together with a source of magnetic_flux_density; "
    "received 'fixed_moment'": lambda: scene(*AT_REST, (FixedMoment(),)),
    "langevin_moment.temperature must be greater than 0.0; received 0": lambda: LangevinMoment(temperature=0),
    "induced_moment.susceptibility must be at least -1.0; received -2": lambda: InducedMoment(
        susceptibility=-2
    ),
    "particles must be given saturation_moment, which effects of the scene need; received none": lambda: (
        loads([scene(*AT_REST, (MagneticField(), FixedMoment()))])
    ),
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        WRONG[message]()
    assert str(fault.value) == message
