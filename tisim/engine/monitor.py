"""Monitors check that every quantity is finite, and keep the last good state of every world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from tisim.effects.base import Shaped
from tisim.engine.replay import Image, Replay
from tisim.engine.result import RUNNING, Status
from tisim.engine.worlds import Worlds
from tisim.errors import RunError
from tisim.pairs.half_list import ListSizes
from tisim.state.status import ASKED, NO_ONE, WorldStatus

if TYPE_CHECKING:
    from collections.abc import Iterator

REASONS: dict[int, str] = {
    WorldStatus.RUNNING: RUNNING,
    WorldStatus.ENDED: "reached its end",
    WorldStatus.NOT_FINITE: "a quantity is not finite",
    WorldStatus.OUT_OF_CAPACITY: "more particles than the capacity",
    WorldStatus.CONTACT_OVERFLOW: "more simultaneous contacts than there is room for",
    WorldStatus.NOT_CONVERGED: "the iteration of a self-consistent quantity does not converge",
    WorldStatus.OVERLAPPING: "overlaps of the start were not removed; allow more time or a lower density",
    WorldStatus.BOX_TOO_NARROW: "bodies longer than half the periodic box; take more bodies",
    WorldStatus.POSITION_LOST: "a step so long or so fast that rounding loses the place in the box",
    WorldStatus.STEP_TOO_SHORT: "the implicit equations of a step cannot be solved even at the shortest step",
    WorldStatus.FORCE_TOO_STEEP: "a force so strong that it requires a step shorter than the shortest",
    WorldStatus.NOT_POSITIVE_DEFINITE: "the diffusion matrix is not positive definite",
    WorldStatus.STEP_TOO_LONG: "a step too long for the forces, whose critical time step is 2/omega",
    WorldStatus.LIST_OVERFLOW: "more near pairs than their list has room for",
    WorldStatus.OUTRUN: "a step so long that grains may pass through each other",
}


LARGE = 4096
"""From this total number of particles on, a check by a kernel is faster than copying the particles."""


class Monitor:
    """A monitor holds the last good state of a loaded batch and the faults found in it.

    last_good : arrays by field name, with ``time`` (s) and ``count``, of all worlds, as of the last check
    between two steps; for a failed world, as of its last good step.
    faults : world -> (time of the fault in s, description).
    """

    def __init__(self, simulation: Worlds, image: Image | None = None) -> None:
        """Begin to monitor a simulation.

        image : the state that the simulation was set to, or its state before the step under way; None at the
        initial state.
        """
        self.simulation, self.s = simulation, simulation.s
        self.replay = Replay(simulation, image)
        names = (*self._names(), "time", "count")
        self._last_good = (
            self.s.snapshot(names) if image is None else {name: image[name].copy() for name in names}
        )
        self._outdated = np.zeros(self.s.worlds, bool)
        self.faults: dict[int, tuple[float, str]] = {}
        large = self.s.worlds * self.s.capacity >= LARGE
        self.finite_check = simulation.finite_check if large else None
        # Particles with individual clocks are synchronized only at some checks, so the good state is copied
        # at each.
        self.shared_clock = not any(field.name == "own_interval" for field in self.s.fields)

    @property
    def last_good(self) -> Image:
        """Return the last good state, after reading from the device the worlds that have advanced since."""
        if self._outdated.any():
            outdated, self._outdated = self._outdated, np.zeros_like(self._outdated)
            now = self.s.snapshot(self._last_good)
            for name, good_values in self._last_good.items():
                good_values[outdated] = now[name][outdated]
        return self._last_good

    def check_worlds(self) -> None:
        """Stop worlds with a fault at their last good step; record the states of the others as good."""
        lazy = self.finite_check is not None and self.shared_clock
        now = self.s.snapshot(self.s.columns) if lazy else self._snapshot()
        finite = (
            self._finite(now)
            if self.finite_check is None
            else (now["failed"] == 0) & self.finite_check.finite_worlds()
        )
        # A failed world restored from a checkpoint has a good state, and its status says that it failed.
        wrong = ~finite | ~np.isin(now["status"], (WorldStatus.RUNNING, WorldStatus.ENDED))
        known = ~wrong & (now["underway"] == 0)
        if lazy:
            self._outdated |= known
        elif known.all():
            self._last_good = {name: now[name] for name in self._last_good}
        else:
            for name, good_values in self._last_good.items():
                good_values[known] = now[name][known]
        wrong[list(self.faults)] = False
        if wrong.any():
            self._stop(np.flatnonzero(wrong))
        self.replay.save_image()

    def _snapshot(self) -> Image:
        return self.s.snapshot((*self._names(), *self.s.columns))

    def _names(self) -> tuple[str, ...]:
        return tuple(f.name for f in self.s.reported)

    def _stop(self, worlds: np.ndarray) -> None:
        """Put failed worlds back to their last good step, from which a step fails again.

        A checkpoint then stores that state, and the cause of the failure is found again after a restore.
        """
        live, sizes = self.s.image(), self.simulation.list_sizes()
        goals, overflowed = live["goal"].copy(), live["failed"][worlds] == WorldStatus.LIST_OVERFLOW
        try:
            good = self.replay.last_good(worlds, self._finite)
            longest = np.zeros(self.s.worlds)
            if (self.s.read("failing_effect") == ASKED).any():
                longest = self.simulation.assembly.failure_attribution.name_failing_effect()
            then = self._snapshot()
            for name, values in live.items():
                values[worlds] = good[name][worlds]
            failed = then["failed"][worlds]
            live["status"][worlds] = np.where(failed > 0, failed, WorldStatus.NOT_FINITE)
            # A world with an overflowed list continues with a longer list. During the replay lists are
            # rebuilt at other times, so they may overflow where they did not before, or not at all.
            again = failed == WorldStatus.LIST_OVERFLOW
            crowded = worlds[again | (overflowed & self._finite(then)[worlds])]
            ended = live["time"][crowded] >= live["end"][crowded]
            live["status"][crowded] = np.where(ended, WorldStatus.ENDED, WorldStatus.RUNNING)
            live["failed"][crowded] = 0
            live["failing_particle"][crowded], live["goal"][crowded] = NO_ONE, goals[crowded]
        finally:
            self.simulation.put(live)
        sizes = sizes.joined(self.simulation.list_sizes())
        for w in map(int, np.setdiff1d(worlds, crowded)):
            self.faults[w] = float(then["time"][w]), self._fault(w, then, float(longest[w]))
        self._outdated[worlds] = False
        for name, good_values in self._last_good.items():
            good_values[worlds] = good[name][worlds]
        if len(crowded):
            self._grow(crowded, sizes, then)

    def _grow(self, crowded: np.ndarray, sizes: ListSizes, then: Image) -> None:
        """Lengthen the lists of crowded worlds, which then continue; without enough memory they fail."""
        try:
            self.simulation.grow_lists(sizes)
        except RunError as full:
            status, failed = self.s.read("status"), then["failed"]
            status[crowded] = WorldStatus.LIST_OVERFLOW
            self.s.write("status", status)
            for w in map(int, crowded):
                who = ""
                if failed[w] == WorldStatus.LIST_OVERFLOW:
                    who = f", at particle {then['failing_particle'][w]}"
                self.faults[w] = float(then["time"][w]), f"{REASONS[WorldStatus.LIST_OVERFLOW]}{who}: {full}"

    def _not_finite(self, now: Image) -> Iterator[tuple[str, np.ndarray]]:
        """Yield each quantity with a mask of the live particles, (worlds, capacity), for which it is not
        finite."""
        live = np.arange(self.s.capacity) < now["count"][:, None]
        for f in self.s.reported:
            yield f.name, live & ~np.isfinite(now[f.name].reshape(*live.shape, -1)).all(axis=2)

    def _finite(self, now: Image) -> np.ndarray:
        """Return for each world whether no step has failed and every quantity is finite."""
        finite = now["failed"] == 0
        for _, broken in self._not_finite(now):
            finite &= ~broken.any(axis=1)
        return finite

    def status(self, w: int, now: Image) -> Status:
        """Return whether and how a world has ended.

        now : ``status``, ``ending_effect`` and the counters of all worlds.
        """
        if w in self.faults:
            when, why = self.faults[w]
            return Status(
                False, f"found at t = {when:.6g} s: {why}; kept t = {self.last_good['time'][w]:.6g} s"
            )
        effects = self.simulation.scenes[w].effects
        code, by = int(now["status"][w]), int(now["ending_effect"][w])
        if code == WorldStatus.ENDED and by < len(effects):
            return Status(True, f"{effects[by].ends}, by effects.{effects[by].label}")
        for counter, why in self.simulation.scenes[w].stepper.ends.items():
            if code == WorldStatus.ENDED and now[counter][w]:
                return Status(True, why)
        return Status(code == WorldStatus.ENDED, REASONS[code])

    def _fault(self, w: int, then: Image, longest: float) -> str:
        """Describe the fault of a world: the failure recorded by the kernels, or the quantity that is not
        finite.

        longest : the longest step (s) for which the force that stopped the world would be finite; 0 if
        unknown.
        """
        code = int(then["failed"][w])
        if code == 0:
            for name, broken in self._not_finite(then):
                if broken[w].any():
                    return f"{name} of particle {then['id'][w][broken[w]].min()} is not finite"
        failing_effect, who = int(then["failing_effect"][w]), int(then["failing_particle"][w])
        scene = self.simulation.scenes[w]
        reason = REASONS[code or WorldStatus.NOT_FINITE]
        if code == WorldStatus.OUTRUN:
            return f"{reason}: {self._outrun(w, then)}"
        if code == WorldStatus.NOT_CONVERGED:
            reason += f": a sweep multiplies the change by {then['sweep_factor'][w]:.3g}"
        if code == WorldStatus.STEP_TOO_LONG:
            step = float(then["dt"][w])
            critical = 2 * step / float(then["step_excess"][w]) ** 0.5
            reason += f": the step is {step:.3g} s, the critical one at most {critical:.3g} s"
        where = ""
        if failing_effect < len(scene.effects):
            effect = scene.effects[failing_effect]
            reason += f", by effects.{effect.label}"
            stops = effect.failure_hint(scene.effects, scene.domain) if code == WorldStatus.NOT_FINITE else ""
            where = f" (this happens if {stops})" if stops else ""
            if 0.0 < longest < 0.999 * then["dt"][w]:
                where += f"; the step is {then['dt'][w]:.4g} s, and the force is finite up to {longest:.3g} s"
        return f"{reason}{where}" if who == NO_ONE else f"{reason}, at particle {who}{where}"

    @np.errstate(over="ignore")
    def _outrun(self, w: int, then: Image) -> str:
        """Name the particle of a world that moves too far in a step, and the step below which it does not."""
        n, dt = int(then["count"][w]), float(then["dt"][w])
        # The squares of large speeds and spins overflow, but not their norms.
        speed = np.hypot.reduce(then["velocity"][w, :n] - then["frame"][w], axis=1)
        smallest, what = float(then["radius"][w, :n].min()), "radius"
        for one in self.simulation.scenes[w].effects:
            if isinstance(one, Shaped):
                # Points of a body may move by its rotation, and it is thinner than the sphere around it.
                speed = speed + np.hypot.reduce(then["spin"][w, :n], axis=1) * then["radius"][w, :n]
                smallest, what = smallest * one.derived_rows()["slenderness"][0], "half extent"
        who = int(np.argmax(speed))
        moved = f"particle {then['id'][w][who]} moves by {speed[who] * dt:.3g} m relative to the others"
        passed = f"{moved} in {dt:.4g} s, and the smallest {what} is {smallest:.3g} m"
        if speed[who] == 0.0:
            return passed
        return f"{passed}; it must be below {smallest / speed[who]:.3g} s, and far shorter if particles touch"


class MonitoredWorlds(Worlds, Protocol):
    """Worlds with the monitor that keeps their last good state."""

    monitor: Monitor
