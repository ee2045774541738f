"""Simulation: compile once, load many scenes of one structure, run them as a batch of worlds."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from tisim.engine.allocation import parts
from tisim.engine.compiled_worlds import CompiledWorlds
from tisim.engine.crowding import check_places, warn_of_overlaps
from tisim.engine.loading import check_reach, check_start, laid_out, world_columns
from tisim.engine.monitor import Monitor
from tisim.engine.observer import Observers, Observing
from tisim.engine.particle_state import ParticleState
from tisim.engine.result import Result
from tisim.errors import InputError, RunError, Words, is_number, is_whole, must
from tisim.pairs import near_list
from tisim.scene.initial_state import Arrays
from tisim.scene.placed_together import placed_together
from tisim.scene.scene import Scene
from tisim.state.fields import names_of
from tisim.state.status import NEVER, WorldStatus

CHUNK_SECONDS, FIRST = 0.25, 2**16
"""CHUNK_SECONDS is the wall time (s) between two checks of progress, of Ctrl-C and of finite quantities;
FIRST is the total number of particle steps before the first check."""

SCHEDULES = ("world", "team", "particle")


class Simulation(CompiledWorlds):
    """A simulation is compiled for a scene structure, a number of worlds and a particle capacity.

    scene : any scene of the structure; its parameter values do not matter here.
    schedule : "world", "team" or "particle" (see program.py), or None to choose by device and work.

    Loading and running other scenes of the same structure compiles nothing. A simulation must be used by one
    thread at a time.
    """

    def __init__(
        self, scene: Scene, worlds: int = 1, capacity: int | None = None, schedule: str | None = None
    ) -> None:
        must(isinstance(scene, Scene), "scene", "a Scene", scene)
        must(is_whole(worlds, 1), "worlds", "a whole number, at least 1", worlds)
        must(schedule in (*SCHEDULES, None), "schedule", "world, team or particle", schedule)
        super().__init__(scene, worlds, capacity or scene.capacity(), schedule)
        self.scenes: list[Scene] = []
        self.edits: list[list[str]] = []
        self.wall_s = 0.0

    def __repr__(self) -> str:
        names = ", ".join(repr(scene.name) for scene in self.scenes[:3]) + ", ..." * (len(self.scenes) > 3)
        size = f"{self.worlds} worlds of up to {self.s.capacity} particles"
        return f"Simulation({size}, loaded: {names or 'none'})"

    def load(self, scenes: Scene | Sequence[Scene], starts: Sequence[Arrays] | None = None) -> None:
        """Load one scene into each of the first worlds; the other worlds stay empty. Nothing is compiled.

        starts : ``particles.arrays`` of each scene, if the caller has made them already.

        Raises InputError if a scene has another structure or exceeds the capacity.
        """
        self.s.check()
        scenes = [scenes] if isinstance(scenes, Scene) else scenes
        must(0 < len(scenes) <= self.worlds, "number of scenes", f"1 to {self.worlds}", len(scenes))
        for scene in scenes:
            must(scene.structure() == self.structure, "scene", "of the structure compiled", scene.name)
            capacity = scene.capacity()
            must(
                capacity <= self.s.capacity,
                f"particles of scene {scene.name!r}",
                f"at most {self.s.capacity}",
                capacity,
            )
        if starts is None:
            with placed_together(scenes):
                starts = [scene.start() for scene in scenes]
        starts = list(starts)
        for scene, start in zip(scenes, starts, strict=True):
            check_start(self.s.fields, scene, start)
        warn_of_overlaps([check_places(scene, start) for scene, start in zip(scenes, starts, strict=True)])
        self.table.write([parts(scene) for scene in scenes])
        self.scenes, self.starts, self.wall_s = list(scenes), starts, 0.0
        self.edits = [[] for _ in scenes]
        self.s.fill({"pause_time": np.inf, "listed_above": near_list.SMALL_WORLD})
        self.begin()
        try:
            check_reach(self.scenes, self.starts, self.assembly.pairs)
        except InputError:
            # Nothing stays loaded.
            self.scenes = []
            raise
        self.monitor = Monitor(self)
        # The initial state can fail already: too many contacts, an infinite force.
        self.monitor.check_worlds()
        # An effect that does not name its measures is detected now, not at the end.
        self.measures([0])

    @property
    def state(self) -> ParticleState:
        """Return the particles of the single loaded world, readable and writable by name between runs, SI."""
        self._check_loaded()
        must(len(self.scenes) == 1, "simulation", "of one world (or ask states[w])", len(self.scenes))
        return self.states[0]

    @property
    def states(self) -> list[ParticleState]:
        """Return the particles of each loaded world, in order, readable and writable by name between runs,
        SI."""
        return [ParticleState(self, w) for w in range(len(self.scenes))]

    def begin(self) -> None:
        """Set every world to its initial state, and prepare the first step."""
        self._begin()
        while (overflowed := self.s.read("failed") == WorldStatus.LIST_OVERFLOW).any():
            try:
                self.grow_lists(self.list_sizes())
            except RunError as full:
                crowded = np.flatnonzero(overflowed)[0]
                who = self.assembly.crowding(crowded)
                self.scenes = []
                rule = "so far apart that the lists of interacting pairs fit in memory"
                raise InputError(f"particles must be {rule}; received {who}: {full}") from None
            self._begin()

    def _begin(self) -> None:
        self.s.fill({f.name: laid_out(f, self.starts, self.worlds, self.s.capacity) for f in self.s.fields})
        # Pause times and the choice of pair search are set from outside and stay. A goal in steps left from
        # the previous run is cleared, as it would prevent the first forces.
        asked = ("pause_time", "listed_above")
        cleared = dict.fromkeys((name for name in self.s.columns if name not in asked), 0)
        self.s.fill({**cleared, "goal": NEVER, **world_columns(self.scenes, self.starts, self.worlds)})
        self.forget_lists()
        if self.first.items:
            self.first.advance(1)

    def run(
        self,
        until: float | None = None,
        steps: int | None = None,
        observers: Sequence[Observing] = (),
    ) -> None:
        """Run every world to its end, or part of the way; the next call continues from there.

        until : simulated time, s; a world stops at the end of the first step at or after it.
        steps : largest number of further steps of each world.
        observers : observers of the run (see Observer), or functions of this simulation.

        A run in parts takes bitwise the same steps as a single run.
        """
        for _ in self.chunks(until, steps, observers):
            pass

    def chunks(
        self,
        until: float | None = None,
        steps: int | None = None,
        observers: Sequence[Observing] = (),
    ) -> Iterator[None]:
        """Run as ``run`` does, one part at a time; yields after each call of the observers, first before the
        first step."""
        self.s.check()
        self._check_loaded()
        rule = "a number of s of simulated time, at least 0"
        must(until is None or (is_number(until) and until >= 0), "until", rule, until)
        must(steps is None or is_whole(steps, 0), "steps", "a whole number, at least 0", steps)
        all_observers, stop = Observers(observers), np.inf if until is None else until
        self.s.write("goal", NEVER if steps is None else self.s.read("steps") + steps)
        all_observers.observe(self)
        yield
        # A chunk is short enough for prompt progress reports, and long enough that checks cost little.
        chunk = max(8, FIRST // (self.worlds * self.s.capacity))
        pauses_on_device = self.s.read("pause_time")
        while self.is_running(stop):
            pauses = all_observers.pauses(self, stop)
            if not np.array_equal(pauses, pauses_on_device):
                self.s.write("pause_time", pauses)
                pauses_on_device = pauses
            began, compiled = time.perf_counter(), self.setup_s
            self.advance(chunk)
            self.monitor.check_worlds()
            # Steps may have been compiled again for longer lists; that time is not counted.
            seconds = time.perf_counter() - began - (self.setup_s - compiled)
            self.wall_s += seconds
            if seconds < CHUNK_SECONDS / 2:
                chunk = min(2 * chunk, 100_000)
            elif seconds > 2 * CHUNK_SECONDS:
                chunk = max(chunk // 2, 1)
            all_observers.observe(self)
            yield

    def in_order(self, w: int, good: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the indices of the live particles of a world in output order: by id if particles are sorted
        in memory, else in memory order."""
        n = int(good["count"][w])
        return np.argsort(good["id"][w, :n]) if self.sort else np.arange(n)

    def is_running(self, until: float = np.inf) -> bool:
        """Return whether any world still has steps to take before ``until`` (s) or its goal."""
        now = self.s.snapshot(("status", "steps", "goal", "time"))
        going = (now["status"] == WorldStatus.RUNNING) & (now["steps"] < now["goal"])
        return bool((going & (now["time"] < until)).any())

    def fraction(self) -> float:
        """Return the finished fraction of the work, the mean over worlds; 1 for a world that has failed."""
        ended = self.s.read("status")[: len(self.scenes)] != WorldStatus.RUNNING
        return float(np.where(ended, 1.0, self.simulated()).mean())

    def simulated(self) -> np.ndarray:
        """Return the simulated fraction of the duration of each loaded world, shape (worlds,)."""
        n = len(self.scenes)
        now = self.s.snapshot(("time", "reached", "end"))
        parts: np.ndarray = np.maximum(now["time"], now["reached"])[:n] / now["end"][:n]
        return parts

    def remaining_steps(self) -> float:
        """Return the largest number of remaining steps of any world, estimated from its last step size.

        Before the first step, the smallest number of steps that the stepper takes is used.
        """
        n = len(self.scenes)
        running = self.s.read("status")[:n] == WorldStatus.RUNNING
        remaining, dt = (self.s.read("end") - self.s.read("time"))[:n], self.s.read("dt")[:n]
        min_steps = [scene.stepper.min_steps(scene.effects, scene.duration) for scene in self.scenes]
        steps = np.where(dt > 0, remaining / np.where(dt > 0, dt, 1.0), min_steps)
        return float(np.where(running, np.ceil(steps), 0.0).max())

    def ended(self) -> list[int]:
        """Return the loaded worlds that have ended or failed."""
        status = self.s.read("status")[: len(self.scenes)]
        return [int(w) for w in np.flatnonzero(status != WorldStatus.RUNNING)]

    def results(self, worlds: Sequence[int] | None = None) -> list[Result]:
        """Return the results of the loaded worlds, in order: all, or the given ones."""
        self._check_loaded()
        now, good = self.s.snapshot(self.s.columns), self.monitor.last_good
        counts = {name: now[name] for name in self.s.counters}
        results = []
        asked = range(len(self.scenes)) if worlds is None else worlds
        for w, measures in zip(asked, self.measures(asked), strict=True):
            order = self.in_order(w, good)
            state = {f.name: good[f.name][w, order] for f in self.s.reported}
            results.append(
                Result(
                    scene=self.scenes[w],
                    state=state,
                    start={**self.starts[w], "id": np.arange(len(self.starts[w]["mass"]))},
                    time=float(good["time"][w]),
                    work={name: int(count[w]) for name, count in counts.items()},
                    status=self.monitor.status(w, now),
                    wall_s=self.wall_s / len(self.scenes),
                    settings={**self.runtime.described, **self._edited(w)},
                    measures=measures,
                )
            )
        return results

    def measures(self, worlds: Sequence[int]) -> list[dict[str, float]]:
        """Return the current measures of these loaded worlds, by name."""
        quantities = names_of(self.s.world_fields, "measure")
        now, measures = self.s.snapshot(quantities), []
        for w in worlds:
            of_world = {name: float(now[name][w]) for name in quantities}
            makers = [effect for effect in self.scenes[w].effects if effect.offers("measures")]
            if makers:
                good = self.monitor.last_good
                order = self.in_order(w, good)
                state = {f.name: good[f.name][w, order] for f in self.s.reported}
                for effect in makers:
                    made, named = effect.measures(state), tuple(effect.measured())
                    unnamed = [name for name in made if name not in named]
                    must(not unnamed, f"measures of effects.{effect.label}", "named by measured", unnamed)
                    of_world |= made
            measures.append(of_world)
        return measures

    def _check_loaded(self) -> None:
        """Raise InputError before the first ``load``."""
        must(len(self.scenes) > 0, "simulation", "loaded with a scene before that", Words("none"))

    def _edited(self, w: int) -> dict[str, str]:
        """Return the setting that lists the quantities written to a world during its run."""
        return {"edited": "; ".join(self.edits[w])} if self.edits[w] else {}

    def checkpoint(self, path: str | Path) -> None:
        """Write the state of all worlds to a file and replace any existing file; raise RunError if the disk
        is full.

        A simulation of the same scenes continues from it with bitwise the same results (``restore``).
        """
        from tisim.engine import checkpoint

        self._check_loaded()
        checkpoint.save(self, path)

    def restore(self, path: str | Path) -> None:
        """Return to the state in a checkpoint; the scenes of the checkpoint must be loaded.

        Raise InputError if the file is not a checkpoint, is truncated or damaged, or belongs to other scenes,
        another precision or another capacity; the simulation then does not change.
        """
        from tisim.engine import checkpoint

        self._check_loaded()
        checkpoint.restore(self, path)
