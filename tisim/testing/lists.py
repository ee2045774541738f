"""Test that a scene ends in the same state with cell lists and with a check of all pairs."""

import numpy as np

from tisim.engine.simulation import Simulation
from tisim.errors import must
from tisim.pairs.neighbour_rows import ALL_PAIRS
from tisim.scene.scene import Scene


def assert_lists(scene: Scene, simulation: Simulation | None = None) -> None:
    """Assert that a scene ends in the same state, to rounding, with cell lists and with a check of all pairs.

    It fails if the ``reach`` of a law is too short, or if a stepper or an operator moves particles without
    reporting the distance. The step sizes must not depend on the pairs that are checked.

    simulation : a simulation of two worlds compiled for the structure of the scene; created if not given.
    """
    control = scene.stepper.control
    must(not control.watches_pairs, "step control", "one that does not depend on pairs", control.kind())
    made = simulation or Simulation(scene, worlds=2)
    made.load([scene, scene])
    made.s.write("listed_above", np.array([0, ALL_PAIRS]))
    made.begin()
    _assert_equal(made, "at the start")
    made.run()
    for result in made.results():
        assert result.status.ok, result.status.reason
    _assert_equal(made, "at the end")
    if simulation is None:
        made.close()


def _assert_equal(simulation: Simulation, when: str) -> None:
    """Assert that the worlds with and without lists agree, allowing for rounding errors amplified by the
    steps."""
    with_lists, all_pairs = simulation.results()
    received, expected = len(with_lists.state["mass"]), len(all_pairs.state["mass"])
    rule = f"{when} there must be {expected} particles as with a check of all pairs"
    assert received == expected, f"{rule}; received {received} with lists"
    for name, values in all_pairs.state.items():
        others, start = with_lists.state[name], all_pairs.start.get(name)
        precision = np.finfo(values.dtype).eps if values.dtype.kind == "f" else 0.0
        moved = values - start if start is not None and start.shape == values.shape else values
        allowed = np.sqrt(precision) * np.abs(moved).max(initial=0.0)
        allowed += 100 * precision * np.abs(values).max(initial=0.0)
        off = np.abs(values - others).max(initial=0.0)
        assert off <= allowed, (
            f"{name} {when} must be the same with lists as with a check of all pairs, within {allowed:g}; "
            f"received one that is off by {off:g}"
        )
