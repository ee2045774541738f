"""A law that acts and keeps history beyond contact, as a capillary bridge does."""

import numpy as np
import pytest

from tests.scenes import by_id, compiled, scene
from tests.throwaway import Bridge, SoftShell, Trap
from tisim import Simulation
from tisim.backend.taichi import ti
from tisim.effects import PairForce, parameter
from tisim.engine import checkpoint
from tisim.operators import Operator
from tisim.steppers import Trapezoid
from tisim.steppers.implicit.step_control import ErrorControl

RADIUS, MASS, PULL, RUPTURE, STEP = 0.1, 2.0, 3.0, 0.05, 1e-3


def pair(gap, speed, others=0, steps=150):
    """Two grains with a given separation speed, and others far away that precede them in memory."""
    far = 10.0 * np.arange(1, others + 1)[:, None] * [0.0, 1.0, 0.0]
    apart = 0.5 * (2 * RADIUS + gap)
    position = np.concatenate([far, [[-apart, 0, 0], [apart, 0, 0]]])
    velocity = np.zeros_like(position)
    velocity[-2:, 0] = -0.5 * speed, 0.5 * speed
    law = Bridge(pull=PULL, rupture=RUPTURE)
    return scene(position, velocity, (law,), radius=RADIUS, mass=MASS, dt=STEP, steps=steps)


def closing(result):
    """Relative speed of the last two grains, positive if they separate."""
    order = np.argsort(result.state["id"])[-2:]
    return float(np.diff(result.state["velocity"][order, 0])[0])


@pytest.fixture(scope="module")
def simulation():
    made = Simulation(pair(0.0, 1.0, others=60), worlds=4)
    yield made
    made.close()


def test_a_bridge_forms_at_contact_and_breaks_beyond(simulation):
    """A bridge of constant force takes the work PULL * RUPTURE from the pair; without contact there is no
    bridge."""
    fast, slow = 1.0, 0.3
    scenes = [pair(-1e-9, fast, 60), pair(-1e-9, slow, 60), pair(0.5 * RUPTURE, fast, 60), pair(-1e-9, fast)]
    simulation.load(scenes)
    simulation.run()
    broken, held, dry, alone = (closing(result) for result in simulation.results())
    reduced = MASS / 2
    expected = np.sqrt(fast**2 - 2 * PULL * RUPTURE / reduced)
    # It breaks in the step after the rupture distance is passed.
    assert broken == pytest.approx(expected, abs=2 * STEP * PULL / reduced)
    assert dry == fast
    assert alone == broken
    # This pair is too slow to separate: at the end it is on its way back, and the bridge has held all the
    # time.
    assert held == pytest.approx(slow - PULL / reduced * scenes[1].duration, abs=1e-9)


@pytest.mark.slow
def test_an_overflow_of_the_contact_history_is_reported(simulation):
    """A grain is in contact with overlapping larger grains on all sides.

    The overflow of its contact history is reported, so no bridge is lost silently.
    """
    angle = 2 * np.pi * np.arange(18) / 18
    ring = 0.99 * (RADIUS + 1.1 * RADIUS) * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    position = np.concatenate([[[0.0, 0.0, 0.0]], ring])
    made = scene(
        position,
        np.zeros_like(position),
        (Bridge(pull=PULL, rupture=RUPTURE),),
        radius=np.where(np.arange(19) > 0, 1.1 * RADIUS, RADIUS),
        mass=MASS,
        dt=STEP,
        steps=50,
    )
    simulation.load([made])
    simulation.run()
    (result,) = simulation.results()
    assert "more simultaneous contacts than there is room for, at particle 0" in result.status.reason


def test_a_bridge_survives_a_restart(simulation, tmp_path):
    """Beyond contact only the history distinguishes a wet pair from a dry one; the list is rebuilt."""
    made = pair(-1e-9, 1.0, 60)
    simulation.load([made])
    simulation.run(steps=20)
    (now,) = simulation.results()
    gap = np.diff(now.state["position"][np.argsort(now.state["id"])[-2:], 0])[0] - 2 * RADIUS
    assert 0 < gap < RUPTURE
    checkpoint.save(simulation, tmp_path / "between")
    simulation.run()
    (whole,) = simulation.results()
    simulation.load([made])
    checkpoint.restore(simulation, tmp_path / "between")
    simulation.run()
    (again,) = simulation.results()
    for name in ("position", "velocity"):
        np.testing.assert_array_equal(again.state[name], whole.state[name])


def tried(made, effects, **control):
    """A scene with an adaptive implicit stepper, and the simulation that runs it."""
    stepper = Trapezoid(control=ErrorControl(**{"shortest": 1e-9, **control}))
    changed = made.model_copy(update={"effects": effects, "stepper": stepper})
    return changed, compiled(changed, worlds=2, capacity=80)


@pytest.mark.slow
def test_a_rejected_trial_keeps_the_contact_history():
    """The first attempt moves a wet pair far out of range and is rejected.

    The pair stays wet and oscillates about the balance of bridge and soft shell, as after a short first step.
    """
    ends = []
    laws = Bridge(pull=PULL, rupture=RUPTURE), SoftShell(stiffness=500.0, width=0.02), Trap(stiffness=0.0)
    for first in (1e-4, 0.5):
        made = pair(-1e-9, 0.0, steps=400)
        made, simulation = tried(made, laws, error=1e-4, tolerance=1e-5, first=first, longest=1.0)
        simulation.load(made)
        simulation.run()
        (result,) = simulation.results()
        assert result.work["rejections"] > 0
        ends.append(np.diff(result.state["position"][:, 0])[0] - 2 * RADIUS)
    assert 0 < ends[0] < RUPTURE
    assert ends[1] == pytest.approx(ends[0], abs=1e-4)


@pytest.mark.slow
def test_a_contact_after_the_last_trial_of_a_step_is_recorded():
    """Pairs at 40 distances are pulled together in steps whose single trial is far from the end point.

    Lists that are rebuilt at every move and lists with a larger skin must record the same contacts.
    """
    gap, rows = np.linspace(1e-4, 1.5e-2, 40), 10.0 * np.arange(40)
    sides = [np.stack([side * (RADIUS + 0.5 * gap), rows, 0 * rows], axis=1) for side in (-1, 1)]
    laws = Bridge(pull=1e-3, rupture=1e-9), SoftShell(stiffness=1e-9, width=1e-9), Trap(stiffness=100.0)
    made = scene(np.concatenate(sides), np.zeros((80, 3)), laws, radius=RADIUS, mass=1.0, steps=1)
    made = made.model_copy(update={"duration": 0.5})
    made, simulation = tried(made, laws, error=1.0, tolerance=0.5, first=0.05, longest=0.05)
    simulation.load([made, made.model_copy(update={"skin": 1e-6})])
    simulation.run(steps=6)
    usual, narrow = (by_id(result)["bridge_past"] for result in simulation.results())
    assert 20 < (usual > 0).sum() < 40
    np.testing.assert_array_equal(narrow, usual)


class Afar(PairForce):
    """A constant force within ten radii."""

    fields = ("radius",)
    short_ranged = True
    push: float = parameter("N", "push", gt=0)

    @ti.func
    def reach(self, s, w, i):
        return 10.0 * s.radius[w, i]

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        near = distance <= s.radius[w, i] + s.radius[w, j] + 10.0 * s.radius[w, i]
        return -ti.select(near, self.push(w) / distance, 0.0) * separation


class Grow(Operator):
    """Increases the radii at a constant rate."""

    fields = ("radius",)
    rate: float = parameter("m/s", "rate", gt=0)

    @ti.func
    def particle(self, s, w, i, t, dt):
        s.radius[w, i] += self.rate(w) * dt


@pytest.mark.slow
def test_a_growing_interaction_range_acts_at_once():
    """Radii of 0.1 + 0.1 t interact over 1.3 m when 12 radii reach that far, which is after 84 steps."""
    made = scene(
        [[0.0, 0.0, 0.0], [1.3, 0.0, 0.0]],
        np.zeros((2, 3)),
        (Afar(push=1.0), Grow(rate=0.1)),
        radius=0.1,
        mass=1.0,
        dt=STEP,
        steps=110,
    )
    simulation = Simulation(made)
    simulation.load(made)
    simulation.run()
    (result,) = simulation.results()
    simulation.close()
    assert closing(result) == pytest.approx(2 * STEP * (110 - 83.5), abs=2.1 * STEP)
