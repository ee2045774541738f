"""Charged and magnetic particles in external fields, against their NumPy references."""

import numpy as np
import pytest

from tests.effects.contact.loads import (
    WORLDS,
    close,
    cloud,
    fields_beside_the_core,
    jacobians,
    loads,
    vector,
)
from tests.effects.magnetic.magnets import Quadrupole
from tests.scenes import scene, simulate
from tisim import InputError, Scene
from tisim.effects import Lorentz, MagneticBodyForce
from tisim.sources import ElectricField, MagneticField
from tisim.steppers import IterationControl, Trapezoid


def waves(source, t):
    return np.array(source.constant) + np.array(source.amplitude) * np.sin(
        np.array(source.omega) * t + np.array(source.phase)
    )


def oscillating(kind, rng):
    return kind(constant=vector(rng), amplitude=vector(rng), omega=vector(rng, 3), phase=vector(rng))


def lorentz_reference(setup, state, t=0.0):
    b = e = np.zeros(3)
    for source in setup.effects:
        if isinstance(source, ElectricField):
            e = waves(source, t)
        if isinstance(source, MagneticField):
            b = waves(source, t)
    return state["charge"][:, None] * (e + np.cross(state["velocity"], b))


@pytest.mark.parametrize(
    "kinds",
    [
        (ElectricField, MagneticField),
        pytest.param((ElectricField,), marks=pytest.mark.slow),
        pytest.param((MagneticField,), marks=pytest.mark.slow),
    ],
)
def test_lorentz_force(kinds, rng):
    """Both fields, oscillating, or a single one."""
    scenes = [
        cloud(
            rng,
            (*(oscillating(kind, rng) for kind in kinds), Lorentz()),
            quantities={"charge": rng.normal(size=12)},
        )
        for _ in range(WORLDS)
    ]
    for one, state in zip(scenes, loads(scenes), strict=True):
        close(state["force"], lorentz_reference(one, state))


@pytest.mark.long
def test_the_electric_field_alone_acts_without_a_magnetic_one(rng):
    electric, magnetic = (oscillating(kind, rng) for kind in (ElectricField, MagneticField))
    law = Lorentz(magnetic=False)
    setup = cloud(rng, (electric, magnetic, law), quantities={"charge": rng.normal(size=12)})
    (state,) = loads([setup])
    close(state["force"], state["charge"][:, None] * waves(electric, 0.0))
    assert setup.stepper.kind() == "verlet"
    assert not law.gyrates(setup.effects)
    assert law.critical_step(state, 1.0, setup.effects) == np.inf
    assert Lorentz().gyrates(setup.effects)


@pytest.mark.slow
def test_fields_oscillate_in_time(rng):
    """Heavy charges keep their velocity: the force after some steps is the force in the field at
    that time."""
    scenes = [
        cloud(
            rng,
            (oscillating(ElectricField, rng), oscillating(MagneticField, rng), Lorentz()),
            quantities={"charge": 1e-9 * rng.normal(size=12)},
            dt=0.37,
            steps=k + 1,
            stepper=Trapezoid(control=IterationControl(first=0.37, longest=0.37)),
        )
        for k in range(WORLDS)
    ]
    for one, result in zip(scenes, simulate(scenes, worlds=WORLDS, capacity=16), strict=True):
        close(result.state["force"], lorentz_reference(one, result.state, result.time), 1e-7)
        assert result.time > 0.3


@pytest.mark.long
def test_zero_amplitude_is_a_constant_field(rng):
    """A field of zero amplitude in one world of a batch beside one that oscillates."""
    still = ElectricField(constant=vector(rng), omega=vector(rng), phase=vector(rng))
    scenes = [
        cloud(rng, (field, Lorentz()), quantities={"charge": 1.0})
        for field in (still, oscillating(ElectricField, rng))
    ]
    for one, state in zip(scenes, loads(scenes), strict=True):
        close(state["force"], lorentz_reference(one, state))


def test_magnetic_body_force_is_the_gradient_of_gamma_b_squared(rng):
    """Against a central difference of gamma B.B, for two sources together."""
    scenes = [
        cloud(
            rng,
            (
                Quadrupole(constant=vector(rng), scale=vector(rng)),
                MagneticField(constant=vector(rng)),
                MagneticBodyForce(gamma=float(rng.normal())),
            ),
        )
        for _ in range(WORLDS)
    ]

    def energy(one, r):
        field, uniform, law = one.effects
        b = np.array(field.constant) + np.array(uniform.constant)
        b = b + np.array(field.scale) * np.stack([r[:, 1], r[:, 0], r[:, 2] ** 2], axis=1)
        return law.gamma * (b * b).sum(axis=1)

    h = 1e-5
    for one, state in zip(scenes, loads(scenes), strict=True):
        r = state["position"]
        expected = [(energy(one, r + h * axis) - energy(one, r - h * axis)) / (2 * h) for axis in np.eye(3)]
        close(state["force"], np.stack(expected, axis=1), 1e-8)


def test_the_velocity_jacobian_of_the_lorentz_force(rng):
    """Against a central difference of the force."""
    scenes = [
        cloud(
            rng,
            (oscillating(ElectricField, rng), oscillating(MagneticField, rng), Lorentz()),
            quantities={"charge": rng.normal(size=12)},
        )
        for _ in range(WORLDS)
    ]
    for claimed, difference in zip(*jacobians(scenes, 1e-3), strict=True):
        close(claimed, difference, 1e-9)


def test_only_needed_fields_are_allocated():
    field = MagneticField(constant=(0, 0, 1))
    extra = {
        (field,): set(),
        (field, Lorentz()): {"charge", "force"},
        (field, MagneticBodyForce(gamma=1)): {"force"},
    }
    for effects, more in extra.items():
        assert fields_beside_the_core(scene([[0, 0, 0]], [[0, 0, 0]], effects)) == more
    assert not MagneticBodyForce.offers("velocity_jacobian")


AT_REST = ([[0, 0, 0]], [[0, 0, 0]])
WRONG = {
    "effects.lorentz must be used together with a source of electric_field or magnetic_flux_density; "
    "received 'lorentz'": lambda: scene(*AT_REST, (Lorentz(),)),
    "effects.magnetic_body_force must be used together with a source of magnetic_flux_density; "
    "received 'electric_field, magnetic_body_force'": lambda: scene(
        *AT_REST, (ElectricField(), MagneticBodyForce(gamma=1))
    ),
    "particles must be given charge, which effects of the scene need; received none": lambda: loads(
        [scene(*AT_REST, (MagneticField(), Lorentz()))]
    ),
    "magnetic_field.constant.1 must be a finite number; received inf": lambda: MagneticField(
        constant=(0, np.inf, 0)
    ),
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        WRONG[message]()
    assert str(fault.value) == message


def test_a_scene_in_a_file_finds_sources():
    setup = scene(
        [[0, 0, 0]],
        [[1, 0, 0]],
        (MagneticField(constant=(0, 0, 1), amplitude=(1, 2, 3)), Lorentz()),
        quantities={"charge": 2.0},
    )
    again = Scene.from_dict(setup.to_dict())
    assert again.digest() == setup.digest()
    assert [type(effect) for effect in again.effects] == [MagneticField, Lorentz]
