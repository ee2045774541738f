"""Uniform fields that are switched on and off."""

import numpy as np
import pytest

import tisim
from tests.scenes import scene
from tisim import InputError, Scene
from tisim.describe.explained_parts import explained
from tisim.effects import (
    CARBONYL_IRON,
    DipoleDipole,
    InducedMoment,
    LangevinMoment,
    Lorentz,
    Magnetophoresis,
    MutualFroehlichMoment,
    MutualInducedMoment,
)
from tisim.sources import ElectricField, MagneticField, sample
from tisim.steppers import Collocation, FixedStep, StageControl, Verlet

BOTH = pytest.mark.parametrize("kind", [ElectricField, MagneticField])


@BOTH
def test_a_field_acts_between_its_begin_and_its_end(kind):
    """It acts at its begin and no longer at its end; the oscillation keeps its phase."""
    field = kind(constant=(1.0, 0, 0), amplitude=(0.0, 2.0, 0), omega=(0, np.pi, 0), begin=0.5, end=0.75)
    for t, expected in ((0.4999, [0, 0, 0]), (0.5, [1, 2, 0]), (0.7499, [1, 2**0.5, 0]), (0.75, [0, 0, 0])):
        value, _ = sample((field,), kind.quantity, [[0.3, 0, 0]], t)
        np.testing.assert_allclose(value[0], expected, rtol=0, atol=1e-3)


@BOTH
def test_a_field_without_an_end_stays(kind):
    field = kind(constant=(1.0, 2.0, 3.0))
    value, _ = sample((field,), kind.quantity, [[0.0, 0, 0]], 1e20)
    np.testing.assert_array_equal(value[0], field.constant)


@BOTH
def test_an_end_before_the_begin_is_refused(kind):
    name = kind.kind()
    with pytest.raises(InputError, match=rf"{name}\.end must be after {name}\.begin, 0\.5 s; received 0\.25"):
        kind(begin=0.5, end=0.25)
    with pytest.raises(InputError, match=rf"{name}\.end must be after {name}\.begin, 0\.5 s; received 0\.5"):
        kind(begin=0.5, end=0.5)
    with pytest.raises(InputError, match=rf"{name}\.end must be greater than 0"):
        kind(end=0.0)


@BOTH
def test_steppers_know_of_the_jump(kind):
    """A field that is switched on or off is compiled apart from one that is not."""
    always, ends, begins = kind(), kind(end=1.0), kind(begin=1.0)
    assert (always.kinked, ends.kinked, begins.kinked) == (False, True, True)
    assert always.structure() != ends.structure() == begins.structure()


def test_the_end_is_kept_in_a_file_and_explained(tmp_path):
    field = MagneticField(constant=(0, 0, 1.0), begin=1 / 3, end=2 / 3)
    before = scene([[0, 0, 0]], [[0, 0, 0]], (field, InducedMoment(susceptibility=1.0)))
    file = tmp_path / "scene.toml"
    file.write_text(before.to_toml(), encoding="utf-8")
    after = Scene.from_toml(file)
    assert next(one for one in after.effects if isinstance(one, MagneticField)).end == 2 / 3
    assert after.digest() == before.digest()
    later = before.replace({"effects.magnetic_field.end": 0.75})
    assert later.digest() != before.digest()
    lines = [str(line) for line in explained(field).parameters]
    assert any("end" in line and "0.666" in line for line in lines), lines


LAWS = {
    "induced": (InducedMoment(susceptibility=1e3), {}),
    "Langevin": (LangevinMoment(temperature=300.0), {"saturation_moment": 1e-6, "domain_moment": 1e-18}),
    "mutual, to a tolerance": (MutualInducedMoment(susceptibility=1e3), {}),
    "mutual, one sweep a step": (MutualInducedMoment(susceptibility=1e3, sweeps=0), {}),
    "mutual, plain sweeps": (MutualInducedMoment(susceptibility=1e3, acceleration="none"), {}),
    "mutual, saturated": (MutualFroehlichMoment(**CARBONYL_IRON.parameters()), {}),
}


SLOW = ("mutual, one sweep a step", "mutual, plain sweeps")
"""Other ways to the mutual moments of an equal field."""


@pytest.mark.parametrize("law", [pytest.param(law, marks=[pytest.mark.slow] * (law in SLOW)) for law in LAWS])
def test_moments_vanish_after_the_end(law):
    """Until then they are those of a field without an end. Without a field each sweep of mutual moments
    reduces them by the same factor: their change, relative to what is left of them, never becomes small."""
    radius, moment = 1e-3, LAWS[law][0]
    place = radius * np.array([[0, 0, 0], [2.02, 0, 0], [0.2, 0, 2.5], [9.0, 0, 0]])

    def final(end, duration):
        (result,) = tisim.run(
            [
                scene(
                    place, 0 * place,
                    (MagneticField(constant=(0, 0, 0.1), end=end), moment, Magnetophoresis(), DipoleDipole()),
                    radius=radius, mass=7e3 * 4 / 3 * np.pi * radius**3, quantities=LAWS[law][1],
                    stepper=Verlet(control=FixedStep(dt=1e-6)), duration=duration,
                )
            ]
        )  # fmt: skip
        result.check()
        return result.state["moment"], result.state["force"]

    always, pulled = final(1e30, 5e-5)
    moments, force = final(5.55e-5, 5e-5)
    np.testing.assert_array_equal(moments, always)
    np.testing.assert_array_equal(force, pulled)
    assert np.abs(pulled).max() > 0
    moments, force = final(5.55e-5, 1e-4)
    assert np.abs(moments).max() <= 1e-20 * np.abs(always).max()
    assert np.abs(force).max() <= 1e-20 * np.abs(pulled).max()


def test_a_charge_flies_straight_before_and_after_a_pulse():
    """A magnetic field between two times turns the velocity by w (end - begin), w = q B/m, on a circle of
    radius v/w; an electric field then adds q E/m times the time for which it acts. Outside of the pulses the
    path is straight."""
    w, push, begin, end = 40.0, 3.0, 0.03, 0.0713
    first, last, duration = 0.08, 0.0937, 0.15
    (result,) = tisim.run(
        [
            scene(
                [[0, 0, 0]], [[1.0, 0, 0]],
                (
                    Lorentz(),
                    MagneticField(constant=(0, 0, w), begin=begin, end=end),
                    ElectricField(constant=(0, 0, push), begin=first, end=last),
                ),
                mass=2.0, quantities={"charge": [2.0]},
                stepper=Collocation(control=StageControl(error=1e-8, per="run")), duration=duration,
            )
        ]
    )  # fmt: skip
    result.check()
    angle = w * (end - begin)
    velocity = np.array([np.cos(angle), -np.sin(angle), push * (last - first)])
    place = np.array([begin + np.sin(angle) / w, (np.cos(angle) - 1) / w, 0])
    place[:2] += velocity[:2] * (duration - end)
    place[2] = push * (last - first) * (duration - (first + last) / 2)
    np.testing.assert_allclose(result.state["velocity"][0], velocity, rtol=0, atol=1e-6)
    np.testing.assert_allclose(result.state["position"][0], place, rtol=0, atol=1e-7)
