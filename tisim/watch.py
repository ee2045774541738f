"""Look whether every quantity is finite, and keep the last good state of every world."""

from __future__ import annotations

import numpy as np

from tisim.inquest import Inquest
from tisim.result import Status
from tisim.scene import Scene
from tisim.state import (
    ASKED,
    CROWDED,
    ENDED,
    FULL,
    INDEFINITE,
    LOST,
    NOT_FINITE,
    RUNNING,
    STEEP,
    STUCK,
    UNSETTLED,
    State,
)

REASONS = {
    RUNNING: "running",
    ENDED: "reached its end",
    NOT_FINITE: "a quantity is not finite",
    FULL: "more fragments than there is room for",
    CROWDED: "more simultaneous contacts than there is room for",
    UNSETTLED: "a quantity that particles settle among themselves does not converge",
    LOST: "a step so long or so fast that rounding loses the place in the box",
    STUCK: "the implicit equations of a step cannot be solved even at the shortest step",
    STEEP: "a force so strong that it asks for a step shorter than the shortest",
    INDEFINITE: "the diffusion matrix is not positive definite",
}


class Watch:
    """The last good state of a loaded batch, and what has gone wrong in it.

    good : arrays by field name, with ``time`` (s) and ``count``, of all worlds.
    faults : world -> (time found, s; what is wrong).
    """

    def __init__(self, s: State, scenes: list[Scene], inquest: Inquest) -> None:
        self.s, self.scenes, self.inquest = s, scenes, inquest
        self.good = self._snapshot()
        self.faults: dict[int, tuple[float, str]] = {}

    def _snapshot(self) -> dict[str, np.ndarray]:
        return {name: self.s.read(name) for name in (*(f.name for f in self.s.told), "time", "count")}

    def look(self) -> None:
        """Stop worlds in which something is not finite; keep the others' state as the last good one."""
        now, status = self._snapshot(), self.s.read("status")
        worlds = len(status)
        live = np.arange(self.s.capacity) < now["count"][:, None]
        found: dict[int, str] = {}
        for f in self.s.told:
            bad = live & ~np.isfinite(now[f.name].reshape(worlds, self.s.capacity, -1)).all(axis=2)
            for w in map(int, np.flatnonzero(bad.any(axis=1))):
                found.setdefault(w, f"{f.name} of particle {now['id'][w][bad[w]].min()} is not finite")
        if (self.s.read("blame") == ASKED).any():
            self.inquest.hold()
        for w in map(int, np.flatnonzero((status != RUNNING) & (status != ENDED))):
            found[w] = self._fault(w, int(status[w]))
        fresh = [w for w in found if w not in self.faults]
        for w in fresh:
            self.faults[w] = float(now["time"][w]), found[w]
        sound = np.array([w not in found for w in range(worlds)])
        for name, values in now.items():
            self.good[name][sound] = values[sound]
        if fresh:
            # So that a checkpoint holds it too, and not what has failed.
            for name, values in now.items():
                values[fresh] = self.good[name][fresh]
                self.s.write(name, values)
            status[~sound & (status == RUNNING)] = NOT_FINITE
            self.s.write("status", status)

    def status(self, w: int, code: int) -> Status:
        """How a world whose status field holds ``code`` has ended, or that it runs."""
        if w in self.faults:
            when, why = self.faults[w]
            return Status(False, f"found at t = {when:.6g} s: {why}; kept t = {self.good['time'][w]:.6g} s")
        return Status(code == ENDED, REASONS[code])

    def _fault(self, w: int, code: int) -> str:
        """What the kernels have recorded of a failure: reason, effect and particle."""
        blame, who = int(self.s.read("blame")[w]), int(self.s.read("culprit")[w])
        effects = self.scenes[w].effects
        by = f", by effects.{effects[blame].kind()}" if blame < len(effects) else ""
        reason = REASONS[code]
        if code == UNSETTLED:
            reason += f": a sweep multiplies the change by {self.s.read('sweep_factor')[w]:.3g}"
        return f"{reason}{by}, at particle {who}"
