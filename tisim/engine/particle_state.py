"""The particles of a world between runs, by name and in SI: ``simulation.state["velocity"]``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from tisim.effects.base import DerivedQuantity
from tisim.engine.crowding import check_places, warn_of_overlaps
from tisim.engine.loading import check_field, check_start
from tisim.engine.monitor import Monitor, MonitoredWorlds
from tisim.errors import Words, must
from tisim.forces.loads import FORCE, TORQUE
from tisim.scene.initial_state import check_sizes
from tisim.state.status import NEVER, WorldStatus


class ParticleState(Mapping[str, np.ndarray]):
    """A particle state gives access to the live particles of a loaded world: arrays of shape (n,) or (n, 3),
    SI, by field name.

    The arrays equal those of a Result at this moment and are read-only; assignment writes:
    ``state["velocity"] = 2.0 * state["velocity"]``. Written values must be finite and valid as an initial
    state of the present particles. ``id``, forces and derived quantities cannot be written, as they follow
    from the rest. After a write pair lists are rebuilt, and derived quantities and forces are computed as at
    the beginning of a run. Time, counters, other worlds and the internal state of an implicit stepper, such
    as its next step size, do not change.

    The scene does not describe such an edited world completely. Its Result lists each written field and the
    time under ``settings["edited"]``; ``Result.start`` stays the loaded initial state.
    """

    def __init__(self, simulation: MonitoredWorlds, world: int) -> None:
        self._simulation, self._world = simulation, world

    @property
    def time(self) -> float:
        """Return the current time (s) of the world."""
        return float(self._simulation.monitor.last_good["time"][self._world])

    def __getitem__(self, name: str) -> np.ndarray:
        must(name in self, "quantity of particles", f"one of {', '.join(self)}", name)
        good = self._simulation.monitor.last_good
        values: np.ndarray = good[name][self._world, self._simulation.in_order(self._world, good)]
        values.flags.writeable = False
        return values

    def __setitem__(self, name: str, values: Any) -> None:
        fields = {f.name: f for f in self._simulation.s.reported}
        derived = {e.quantity for e in self._simulation.scenes[0].effects if isinstance(e, DerivedQuantity)}
        derived |= {"id", FORCE.name, TORQUE.name} | {f.name for f in fields.values() if f.slots}
        writable = [field for field in fields if field not in derived]
        must(name in writable, "quantity to write", f"one of {', '.join(writable)}", name)
        new, whole = _numbers(name, values, fields[name].integer), dict(self)
        check_field(fields[name], new, len(whole["mass"]))
        must(bool(np.isfinite(new).all()), f"particles.{name}", "finite", new[~np.isfinite(new)][:1])
        if name in ("mass", "radius"):
            check_sizes(name, fields[name].unit, new)
        scene = self._simulation.scenes[self._world]
        check_start(self._simulation.s.fields, scene, {**whole, name: new})
        warn_of_overlaps([check_places(scene, {**whole, name: new})])
        _edit(self._simulation, self._world, name, new)

    def __contains__(self, name: object) -> bool:
        return name in tuple(self)

    def __iter__(self) -> Iterator[str]:
        return (f.name for f in self._simulation.s.reported)

    def __len__(self) -> int:
        return len(self._simulation.s.reported)

    def __repr__(self) -> str:
        return f"<state of world {self._world} at {self.time:g} s: {', '.join(self)}>"

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)


def _numbers(name: str, values: Any, whole: bool) -> np.ndarray:
    """Convert values to an array of floats; raise InputError if they are not numbers."""
    try:
        array = np.asarray(values)
    except ValueError:
        array = np.asarray(str(values))
    must(array.dtype.kind in "biuf", f"particles.{name}", "numbers", values)
    floats: np.ndarray = array.astype(float)
    must(not whole or bool((floats == np.rint(floats)).all()), f"particles.{name}", "whole numbers", values)
    return floats


def _edit(simulation: MonitoredWorlds, w: int, name: str, values: np.ndarray) -> None:
    """Write a quantity of a world between two steps, and recompute everything that depends on it."""
    s = simulation.s
    now, before = s.image(), simulation.monitor.replay.whole()
    status, goal, pauses = now["status"].copy(), now["goal"].copy(), s.read("pause_time")
    reason = simulation.monitor.status(w, now).reason
    must(status[w] == WorldStatus.RUNNING, "world to write to", "one that runs", reason)
    must(
        now["underway"][w] == 0,
        "world to write to",
        "between two steps",
        Words("one whose step is under way"),
    )
    now[name][w, simulation.in_order(w, now)] = values
    # Reset as at the beginning of a run, for this world only.
    for quantity, start in (("approach_time", np.inf), ("fastest", 0.0), ("events", 0)):
        now[quantity][w] = start
    now["status"][:], now["status"][w], now["goal"][:] = WorldStatus.ENDED, WorldStatus.RUNNING, NEVER
    _begin_again(simulation, now)
    while (simulation.s.read("failed") == WorldStatus.LIST_OVERFLOW).any():
        simulation.grow_lists(simulation.list_sizes())
        _begin_again(simulation, now)
    after = s.image()
    status[w] = after["status"][w]
    simulation.put({**after, "status": status, "goal": goal, "pause_time": pauses})
    for column, old in before.items():
        old[w] = status[w] if column == "status" else after[column][w]
    simulation.edits[w].append(f"{name} at t = {float(after['time'][w]):.6g} s")
    simulation.monitor = Monitor(simulation, before)
    simulation.monitor.check_worlds()


def _begin_again(simulation: MonitoredWorlds, now: Mapping[str, np.ndarray]) -> None:
    """Set the worlds to an image, and prepare the next step of the running ones."""
    simulation.put(now)
    simulation.s.write("pause_time", np.inf)
    if simulation.first.items:
        simulation.first.advance(1)
