"""A grain becomes NaN during a run in one of three worlds: it is named, and the other worlds are
unaffected."""

import numpy as np
import pytest

from tests.scenes import compiled, energy, fixed, flow, simulate
from tisim.backend.taichi import ti
from tisim.operators import Operator
from tisim.operators.base import parameter


class Poison(Operator):
    """At a given step, makes one quantity of one particle not finite; a flag selects the quantity."""

    fields = ("temperature",)
    at_step: float = parameter("", "at step", 0.0)
    victim: float = parameter("", "victim", 0.0)
    velocity: float = parameter("", "velocity", 0.0)
    position: float = parameter("", "position", 0.0)
    temperature: float = parameter("", "temperature", 0.0)
    overflow: float = parameter("", "overflow", 0.0)

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.steps[w] == self.at_step(w) and s.id[w, i] == self.victim(w):
            if self.velocity(w) > 0.0:
                s.velocity[w, i][1] = ti.math.nan
            if self.position(w) > 0.0:
                s.position[w, i][2] = ti.math.nan
            if self.temperature(w) > 0.0:
                s.temperature[w, i] = ti.math.nan
            if self.overflow(w) > 0.0:
                s.velocity[w, i][0] = 1e300 * 1e300


def poisoned(quantity, when=50, seed=9):
    base = flow(seed=seed, grains=30, hardness=1e7, duration=2e-4, stepper=fixed(1e-6))
    poison = Poison(at_step=when, victim=17, **{quantity: 1.0} if quantity else {})
    return type(base)(
        **{**{n: getattr(base, n) for n in type(base).model_fields}, "effects": (*base.effects, poison)}
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("quantity", "fault"),
    [
        ("velocity", "velocity of particle 17 is not finite"),
        # Detected in the move itself, before the cause is known.
        ("position", "a quantity is not finite, at particle 17"),
        ("temperature", "temperature of particle 17 is not finite"),
        ("overflow", "velocity of particle 17 is not finite"),
    ],
    ids=["velocity", "position", "temperature", "overflow"],
)
def test_is_named_and_kept_apart(quantity, fault):
    clean = poisoned(None, seed=1)
    batch = [clean, poisoned(quantity), poisoned(None, seed=2)]
    simulation = compiled(clean, worlds=3, capacity=32)
    simulation.load(batch)
    for _ in range(40):
        simulation.run(steps=5)
    one, bad, two = simulation.results()
    assert not bad.status.ok
    reason = bad.status.reason
    assert fault in reason
    fault_time, kept_time = (float(part.split("t = ")[1].split(" s")[0]) for part in reason.split("kept"))
    assert 49e-6 * (1 - 1e-9) <= fault_time <= 55e-6 * (1 + 1e-9)
    assert kept_time == pytest.approx(bad.time, rel=1e-5)
    assert 44e-6 < bad.time < 51e-6
    assert all(np.isfinite(values).all() for values in bad.state.values())
    assert energy(bad.state) == pytest.approx(energy(bad.start), rel=1e-12)
    for good, scene_of in ((one, clean), (two, batch[2])):
        assert good.status.ok
        (alone,) = simulate([scene_of], worlds=3, capacity=32)
        for name, values in good.state.items():
            np.testing.assert_array_equal(values, alone.state[name])
