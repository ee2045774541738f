"""Extreme cases of steppers: a sudden force, steps after a contact, and hard cases with other steppers than
their own."""

from functools import partial

import numpy as np
import pytest

from tests.hard.judging import holds
from tests.scenes import by_id, compiled, fixed, scene, simulate
from tests.throwaway import SoftShellOfAll
from tisim.cases.hard.ratios import masses_a_million_apart
from tisim.cases.hard.singular import fall_into_a_singularity
from tisim.cases.hard.springs import stiff_springs
from tisim.effects import Contact, NearField, Tether
from tisim.steppers import Collocation, ErrorControl, StageControl, Trapezoid

WORLDS = 16
TRAPEZOID, COLLOCATION = {"error": 1e-6, "tolerance": 1e-8}, {"error": 1e-8}
STEPPERS = {
    "trapezoid": lambda limits: Trapezoid(control=ErrorControl(**TRAPEZOID, **limits)),
    "anderson": lambda limits: Trapezoid(
        control=ErrorControl(**TRAPEZOID, **limits), acceleration="anderson"
    ),
    "collocation": lambda limits: Collocation(control=StageControl(**COLLOCATION, **limits)),
}


NAMES = [pytest.param(name, marks=pytest.mark.slow) for name in STEPPERS]


def adaptive(name, first, longest, **more):
    """A stepper with error-controlled steps that start at ``first`` (s)."""
    return STEPPERS[name]({"first": first, "longest": longest, "shortest": 1e-14, **more})


def forced(
    position, velocity, stepper, duration, tether=0.0, shell=1e-100, width=1e-100, near=(0, 0), **more
):
    """Particles on springs within elastic shells; they attract by near[0]/d and repel by near[1]/d^2."""
    effects = (
        SoftShellOfAll(stiffness=shell, width=width),
        NearField(alpha1=near[0], alpha2=near[1]),
        Tether(stiffness=(tether,) * 3),
    )
    return scene(position, velocity, effects, stepper=stepper, duration=duration, **more)


def run(scenes):
    return simulate(scenes, worlds=WORLDS, capacity=2)


def good(results):
    for result in results:
        assert result.status.ok, result.status.reason
    return results


@pytest.mark.slow
@pytest.mark.parametrize("name", ["anderson", "collocation"])
@pytest.mark.parametrize("case", [stiff_springs, masses_a_million_apart, fall_into_a_singularity])
def test_other_steppers_keep_the_bounds(case, name):
    holds(case, partial(adaptive, name))


@pytest.mark.slow
def test_verlet_with_masses_a_million_apart():
    holds(masses_a_million_apart, lambda **_: fixed(2e-5))


MEETINGS = 1e-3 + 1e-4 * (1 - np.append(np.geomspace(1e-9, 1, 13), [0.3, 0.7]))
"""Times (s) between the ends of the tenth and the eleventh step of 1e-4 s, and just before the latter."""


@pytest.mark.parametrize("name", [*NAMES, "verlet"])
def test_a_sudden_force(name):
    """Two shells meet at 200 m/s after a flight in the longest steps, each a tenth of the shell.

    They rebound as a linear spring does: v' = -v, half a period later.
    """
    k, m, v, width = 2e6, 1.0, 100.0, 0.2
    contact = np.pi / np.sqrt(2 * k / m)
    assert v * np.sqrt(m / (2 * k)) < width, "the spring must stop them before their centres meet"
    stepper = fixed(1e-6) if name == "verlet" else adaptive(name, 1e-4, 1e-4)
    places = 1e-9 + width / 2 + v * np.array([MEETINGS, 2.5e-3 - MEETINGS])
    speed, more = [[v, 0, 0], [-v, 0, 0]], {"shell": k, "width": width, "radius": 1e-9, "mass": m}
    scenes = [
        forced([[-half, 0, 0], [half, 0, 0]], speed, stepper, 2.5e-3 + contact, **more) for half in places[0]
    ]
    for place, result in zip(places[1], good(run(scenes)), strict=True):
        state = by_id(result)
        np.testing.assert_allclose(state["velocity"][:, 0], [-v, v], rtol=5e-6)
        np.testing.assert_allclose(state["position"][:, 0], [-place, place], rtol=5e-6)


@pytest.mark.slow
def test_steps_grow_again_after_a_contact():
    """Grains of any speed that meet in mid-step rebound with their energy, in few steps.

    The stepper must not keep the short steps of the contact because of an outdated contraction rate.
    """
    radius, speeds = 1e-3, np.geomspace(0.1, 100, 10)
    scenes = [
        scene(
            radius * np.array([[-5, 0, 0], [5, 0, 0]]),
            [[v, 0, 0], [-v, 0, 0]],
            (Contact(stiffness=1e11),),
            radius=radius,
            stepper=Collocation(control=StageControl(longest=longest * radius / v)),
            duration=12 * radius / v,
        )
        for v in speeds
        # With two long steps the grains would pass without detecting each other.
        for longest in (0.3, 0.9)
    ]
    simulation = compiled(scenes[0], worlds=len(scenes), capacity=2)
    simulation.load(scenes)
    simulation.run(steps=1000)
    for v, result in zip(np.repeat(speeds, 2), good(simulation.results()), strict=True):
        np.testing.assert_allclose(by_id(result)["velocity"][:, 0], [-v, v], rtol=1e-5)
        assert result.work["steps"] < 100
