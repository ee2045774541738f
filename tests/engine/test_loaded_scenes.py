"""Scenes that are loaded into a kept simulation, for callers that change states between parts of a run."""

import numpy as np
import pytest

from tisim import Box, Cloud, Scene, run
from tisim.effects import Gravity, Impact
from tisim.engine import batches
from tisim.engine.batches import Batches, loaded
from tisim.errors import InputError
from tisim.steppers import FixedStep, Verlet


def falling(seed, **changes):
    """A scene of five particles that fall."""
    parts = {
        "particles": Cloud(number=5, radius=1e-4, density=1e3),
        "effects": [Gravity()],
        "domain": Box(low=(-1.0, -1.0, -1.0), high=(1.0, 1.0, 1.0)),
        "duration": 1e-2,
        "stepper": Verlet(control=FixedStep(dt=1e-3)),
        "seed": seed,
    }
    return Scene(**{**parts, **changes})


def test_a_scene_that_cannot_be_loaded_fails_alone_in_a_search():
    """A box in which a grain could touch another one twice is refused when scenes are loaded, after their
    start has been made."""
    hard = {"effects": [Impact(hardness=1e5)], "stepper": Verlet(control=FixedStep(dt=1e-3))}
    wide = [falling(seed, **hard) for seed in range(3)]
    narrow = wide[1].replace({"particles.radius": 0.55, "particles.number": 2})
    scenes = [wide[0], narrow, wide[2]]
    own = Batches()
    results = dict(own.run(scenes, strict=False))
    assert [results[k].status.ok for k in range(3)] == [True, False, True]
    assert "box must be at least" in results[1].status.reason
    for k in (0, 2):
        (alone,) = dict(own.run([scenes[k]])).values()
        assert np.array_equal(results[k].state["position"], alone.state["position"])
    assert not dict(own.run([narrow], strict=False))[0].status.ok
    with pytest.raises(InputError, match="box must be at least"):
        dict(own.run(scenes))
    own.close()


def test_a_simulation_is_kept_and_gives_the_bits_of_run():
    scenes = [falling(seed) for seed in range(2)]
    kept = []
    for one in scenes:
        with loaded([one]) as simulation:
            simulation.run(until=5e-3)
            simulation.run()
            (result,) = simulation.results()
            kept.append(simulation)
        assert np.array_equal(result.state["position"], run(one).state["position"])
    assert kept[0] is kept[1]


def test_all_scenes_are_loaded_at_once_whatever_the_size_of_a_batch(monkeypatch):
    monkeypatch.setattr(batches, "BATCH_PARTICLES", 10)
    scenes = [falling(seed, domain=Box(low=(-2.0, -1.0, -1.0), high=(1.0, 1.0, 1.0))) for seed in range(3)]
    with loaded(scenes) as simulation:
        assert len(simulation.states) == 3
    assert all(result.status.ok for result in run(scenes))


def test_a_start_is_loaded_whatever_was_done_before():
    one = falling(3)
    with loaded([one]) as simulation:
        simulation.states[0]["velocity"] = np.full((5, 3), 2.0)
    with loaded([one]) as simulation:
        assert np.array_equal(simulation.states[0]["velocity"], one.start()["velocity"])
    with (
        pytest.raises(InputError, match="structure"),
        loaded([one, falling(4, stepper=Verlet(control=FixedStep(dt=1e-3)), effects=[])]),
    ):
        pass
