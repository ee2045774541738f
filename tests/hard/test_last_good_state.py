"""A world that fails gives back the state of its last good step, whenever anybody has looked."""

import numpy as np
import pytest

from tests.scenes import compiled, fixed, scene
from tisim._taichi import ti
from tisim.effect import Force, parameter
from tisim.effects.impact import Impact
from tisim.steppers.brownian import Brownian
from tisim.steppers.drift_limit import DriftLimit
from tisim.steppers.implicit_control import IterationControl
from tisim.steppers.trapezoid import Trapezoid

WHEN = 0.783
"""s, when things go wrong."""


class Late(Force):
    """A spring towards the middle, which after a time is stiffer, beyond all measure where asked for."""

    when: float = parameter("s", WHEN)
    stiffness: float = parameter("N/m", 1.0)
    later: float = parameter("N/m", 1.0)

    @ti.func
    def force(self, s, w, i, t):
        return ti.select(t > self.when(w), -self.later(w), -self.stiffness(w)) * s.position[w, i]


def one(stepper, **options):
    return scene([[1.0, 0, 0]], [[0.0, 1, 0]], (Late(**options),), mass=[1.0], stepper=stepper, duration=1.0)


def not_finite():
    """1e308 N/m are too many for a step."""
    return one(fixed(1e-4), later=1e308), 1e-4, "is not finite"


def stuck():
    """The longest step, which is the shortest too, is too long for the spring."""
    control = IterationControl(first=1e-3, longest=1e-3, shortest=1e-3)
    return one(Trapezoid(control=control), later=1e9), 1e-3, "cannot be solved even at the shortest step"


def steep():
    """A Brownian particle that a force would move too far in the shortest step."""
    control = DriftLimit(longest=1e-4, shortest=1e-5)
    stepper = Brownian(temperature=300.0, viscosity=1e-3, control=control)
    return one(stepper, stiffness=1e-9, later=1e9), 1e-4, "shorter than the shortest"


def crowded():
    """Sixty grains, all within reach of each other at once."""
    place = np.random.default_rng(3).normal(size=(60, 3))
    place /= np.linalg.norm(place, axis=1)[:, None]
    radius = 1e-3
    speed = (1.0 - 0.9 * radius) / 0.78
    made = scene(place, -speed * place, (Impact(hardness=1e30),), radius=radius, dt=1e-2, duration=1.0)
    return made, 1e-2, "more simultaneous contacts"


@pytest.mark.parametrize(
    "made",
    [
        not_finite,
        pytest.param(stuck, marks=pytest.mark.slow),
        pytest.param(steep, marks=pytest.mark.slow),
        pytest.param(crowded, marks=pytest.mark.slow),
    ],
)
def test_the_state_is_that_of_the_last_step_before_the_failure(made):
    start, step, fault = made()
    simulation = compiled(start, worlds=2)
    kept = []
    for stretches in (1, 7):
        simulation.load([start, start.replace({"duration": WHEN / 2})])
        for _ in range(stretches):
            simulation.run(steps=None if stretches == 1 else 2000)
        bad, good = simulation.results()
        assert good.status.ok
        assert not bad.status.ok
        assert fault in bad.status.reason
        when, until = (
            float(part.split("t = ")[1].split(" s")[0]) for part in bad.status.reason.split("kept")
        )
        assert until == pytest.approx(bad.time, rel=1e-5)
        assert bad.time <= when <= bad.time + 1.001 * step
        kept.append(bad)
    assert kept[0].status == kept[1].status
    for name, values in kept[0].state.items():
        np.testing.assert_array_equal(values, kept[1].state[name])
    # A run that stops there by itself has the same state, and the next step fails.
    simulation.load([start])
    simulation.run(steps=kept[0].work["steps"])
    (there,) = simulation.results()
    assert there.time == kept[0].time
    for name, values in there.state.items():
        np.testing.assert_array_equal(values, kept[0].state[name])
    assert simulation.fraction() < 1
    simulation.run(steps=1)
    assert simulation.results()[0].status == kept[0].status
