"""Look whether every quantity is finite, and keep the last good state of every world."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tisim.replay import Image, Replay
from tisim.result import Status
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
)

if TYPE_CHECKING:
    from tisim.simulation import Simulation

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

    good : arrays by field name, with ``time`` (s) and ``count``, of all worlds: those of the last look; those
        of the last good step, where a world has failed.
    faults : world -> (time found, s; what is wrong).
    """

    def __init__(self, simulation: Simulation, image: Image | None = None) -> None:
        """``image`` : where the simulation has been put, when that is not its start."""
        self.simulation, self.s = simulation, simulation.s
        self.replay = Replay(simulation, image)
        self.good = self._snapshot()
        self.faults: dict[int, tuple[float, str]] = {}

    def _snapshot(self) -> Image:
        return self.s.snapshot((*(f.name for f in self.s.told), "time", "count"))

    def look(self) -> None:
        """Stop worlds in which something is wrong, at their last good step; keep others' as good."""
        now = self._snapshot()
        found = self._found(now)
        fresh = [w for w in found if w not in self.faults]
        for name, values in now.items():
            sound = [w for w in range(len(values)) if w not in found]
            self.good[name][sound] = values[sound]
        if fresh:
            self._stop(fresh, now, found)
        else:
            self.replay.keep()

    def _stop(self, fresh: list[int], now: Image, found: dict[int, str]) -> None:
        """Put worlds that have failed where they were last good; so a checkpoint holds that too."""
        live = self.s.image()
        for w in fresh:
            good, then = self.good, now
            # In a start that has failed nothing has been done yet.
            if live["steps"][w] > 0:
                good = self.replay.last_good(w, self._sound)
                then = self._snapshot()
                found = self._found(then)
            self.faults[w] = float(then["time"][w]), found[w]
            status = self.s.read("status")[w]
            for name, values in good.items():
                live[name][w] = values[w]
            for name, kept in self.good.items():
                kept[w] = good[name][w]
            live["status"][w] = NOT_FINITE if status in (RUNNING, ENDED) else status
        self.simulation.put(live)

    def _found(self, now: Image) -> dict[int, str]:
        """What is wrong, by world; ``now`` is a snapshot of how they are."""
        if (self.s.read("blame") == ASKED).any():
            self.simulation.made.inquest.hold()
        found: dict[int, str] = {}
        live = np.arange(self.s.capacity) < now["count"][:, None]
        for f in self.s.told:
            bad = live & ~np.isfinite(now[f.name].reshape(*live.shape, -1)).all(axis=2)
            for w in map(int, np.flatnonzero(bad.any(axis=1))):
                found.setdefault(w, f"{f.name} of particle {now['id'][w][bad[w]].min()} is not finite")
        status = self.s.read("status")
        for w in map(int, np.flatnonzero((status != RUNNING) & (status != ENDED))):
            found[w] = self._fault(w, int(status[w]))
        return found

    def _sound(self, w: int) -> bool:
        return w not in self._found(self._snapshot())

    def status(self, w: int, code: int) -> Status:
        """How a world whose status field holds ``code`` has ended, or that it runs."""
        if w in self.faults:
            when, why = self.faults[w]
            return Status(False, f"found at t = {when:.6g} s: {why}; kept t = {self.good['time'][w]:.6g} s")
        return Status(code == ENDED, REASONS[code])

    def _fault(self, w: int, code: int) -> str:
        """What the kernels have recorded of a failure: reason, effect and particle."""
        blame, who = int(self.s.read("blame")[w]), int(self.s.read("culprit")[w])
        effects = self.simulation.scenes[w].effects
        by = f", by effects.{effects[blame].kind()}" if blame < len(effects) else ""
        reason = REASONS[code]
        if code == UNSETTLED:
            reason += f": a sweep multiplies the change by {self.s.read('sweep_factor')[w]:.3g}"
        return f"{reason}{by}, at particle {who}"
