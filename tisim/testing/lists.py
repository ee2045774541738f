"""Whether a scene is the same with cell lists as with a look at all pairs."""

import numpy as np

from tisim.engine.simulation import Simulation
from tisim.errors import must
from tisim.scene.scene import Scene

NO_LISTS = 2**30
"""More particles than any world has: one with so many still looks at all pairs."""


def assert_lists(scene: Scene, simulation: Simulation | None = None) -> None:
    """Assert that a scene comes to the same end, to rounding, with cell lists and with a look at all pairs.

    It does not where a law has too short a ``reach``, or where a stepper or an operator moves particles and
    does not say how far. The scene must have steps that do not depend on which pairs are looked at.

    simulation : one of two worlds that has been compiled for the structure of the scene.
    """
    control = scene.stepper.control
    must(not control.watches_pairs, "step control", "one that does not look at pairs", control.kind())
    made = simulation or Simulation(scene, worlds=2)
    made.load([scene, scene])
    made.s.write("listed_above", np.array([0, NO_LISTS]))
    made.begin()
    _assert_equal(made, "at the start")
    made.run()
    for result in made.results():
        assert result.status.ok, result.status.reason
    _assert_equal(made, "at the end")
    if simulation is None:
        made.close()


def _assert_equal(simulation: Simulation, when: str) -> None:
    """Assert that two worlds are the same, to rounding that steps have had time to magnify."""
    listed, everyone = simulation.results()
    a, b = len(listed.state["mass"]), len(everyone.state["mass"])
    assert a == b, f"{when} there must be {b} particles as with a look at all pairs; received {a} with lists"
    for name, values in everyone.state.items():
        others, start = listed.state[name], everyone.start.get(name)
        precision = np.finfo(values.dtype).eps if values.dtype.kind == "f" else 0.0
        moved = values - start if start is not None and start.shape == values.shape else values
        allowed = np.sqrt(precision) * np.abs(moved).max(initial=0.0)
        allowed += 100 * precision * np.abs(values).max(initial=0.0)
        off = np.abs(values - others).max(initial=0.0)
        assert off <= allowed, (
            f"{name} {when} must be with lists what it is with a look at all pairs, within {allowed:g}; "
            f"received one that is off by {off:g}"
        )
