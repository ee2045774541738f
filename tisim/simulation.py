"""Compile once, load many, run: a batch of worlds of one structure."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from tisim import runtime
from tisim.binding import Table, connect
from tisim.effect import Effect, Force, Operator, PairEvent, PairForce
from tisim.errors import InputError, must
from tisim.events import Close, Contacts, Rearrange, Rounds, Survey, SurveyAgain
from tisim.forces import FORCE, SumForces, SumForcesAgain
from tisim.mutual import Mutual
from tisim.neighbours import Neighbours
from tisim.particles import Arrays
from tisim.program import Phase, Program, Repeat
from tisim.result import Result
from tisim.scene import Scene
from tisim.state import BOOKS, CLOCK, ENDED, MOTION, RUNNING, State, resolve_fields
from tisim.steppers.stepper import Parts, Stepper
from tisim.steppers.verlet import Finish
from tisim.watch import Watch

CHUNK_SECONDS = 0.25
"""Wall time between looks at progress, at Ctrl-C and at whether every quantity is finite."""


class Simulation:
    """Compiled for the structure of a scene, a number of worlds and a capacity of particles.

    scene : any scene of the structure; its values do not matter here.
    schedule : "world" or "particle" (see program.py), or None to choose by device and size.
    Loading and running other scenes of the same structure compiles nothing.
    """

    def __init__(
        self, scene: Scene, worlds: int = 1, capacity: int | None = None, schedule: str | None = None
    ) -> None:
        must(worlds >= 1, "worlds", "at least 1", worlds)
        began = time.perf_counter()
        self.runtime, self.worlds = runtime.current(), worlds
        self.structure = scene.structure()
        capacity = capacity or scene.capacity()
        # Fields and lists of a particle come to some hundred bytes; refused here, not in the compiler.
        needed, there = 300 * worlds * capacity, runtime.memory()
        rule = f"within the {there / 1e9:.0f} GB of this machine"
        must(needed <= there, f"memory for {worlds} x {capacity} particles", rule, f"{needed / 1e9:.0f} GB")
        self.schedule = schedule or self._choose(capacity)
        must(self.schedule in ("world", "particle"), "schedule", "world or particle", schedule)
        forces = any(isinstance(e, Force | PairForce) for e in scene.effects)
        fields = resolve_fields((*(n for e in scene.effects for n in e.needs), *((FORCE,) if forces else ())))
        counters = tuple(dict.fromkeys(name for e in scene.effects for name in e.counts))
        self.s = State(worlds, capacity, fields, counters)
        parts = self._parts(scene)
        self.table = Table(parts, worlds, self.runtime.real)
        *effects, domain, control = (self.table.bind(part) for part in parts)
        connect(effects)
        self._compose(scene.stepper, tuple(effects), domain, control)
        self.s.status.fill(ENDED)
        self.program.compile()
        if self.first.items:
            self.first.compile()
        self.scenes: list[Scene] = []
        self.wall_s, self.setup_s = 0.0, time.perf_counter() - began

    @staticmethod
    def _parts(scene: Scene) -> list[Any]:
        return [*scene.effects, scene.domain, scene.stepper.control]

    def _choose(self, capacity: int) -> str:
        # A world per thread needs as many worlds as threads; one small world is faster without launches.
        small = capacity * self.worlds <= 20_000
        many = self.worlds >= self.runtime.threads
        return "world" if self.runtime.device == "cpu" and (small or many) else "particle"

    def _compose(self, stepper: Stepper, effects: tuple[Effect, ...], domain: Any, control: Any) -> None:
        """The phases of a step, and those that prepare the first one."""
        s = self.s
        events = tuple(e for e in effects if isinstance(e, PairEvent))
        operators = tuple(e for e in effects if isinstance(e, Operator))
        forces = tuple(e for e in effects if isinstance(e, Force))
        pair_forces = tuple(e for e in effects if isinstance(e, PairForce))
        short_ranged = tuple(e for e in pair_forces if e.short_ranged)
        surveyed = bool(events) or control.watches_pairs
        near = Neighbours(s, domain, short_ranged) if surveyed or short_ranged else None
        mutual = Mutual(near) if near and short_ranged else None
        contacts = Contacts(s, domain, events) if surveyed else None
        self.parts = [part for part in (s, self.table, near, mutual, contacts) if part is not None]
        self.near, self.contacts = near, contacts

        forced = bool(forces or pair_forces)
        parts = Parts(s, control, domain, operators, near, forced)
        step: list[Phase | Repeat] = [*stepper.before_forces(parts)]
        first: list[Phase | Repeat] = []
        listed = mutual.phases() if mutual else near.phases() if near else ()
        step += listed
        first += listed
        if forced:
            summed = SumForces(s, domain, forces, pair_forces, mutual)
            step += [summed]
            first += [summed]
        step += stepper.after_forces(parts)
        if near and contacts:
            survey = Survey(near, contacts, control)
            step += [survey]
            first += [survey, Close(contacts)]
        if events and contacts:
            step += [Rounds(contacts)]
        if events or operators:
            step += [Rearrange(s, domain, operators, near)]
        if near and contacts and (events or operators) and control.watches_pairs:
            step += [*listed, SurveyAgain(near, contacts, control)]
        if forced and (events or operators):
            step += [*listed, SumForcesAgain(s, domain, forces, pair_forces, mutual)]
        if contacts:
            step += [Close(contacts)]
        self.program = Program(s, (*step, Finish(s)), self.schedule)
        self.first = Program(s, tuple(first), self.schedule)

    def load(self, scenes: Sequence[Scene], starts: Sequence[Arrays] | None = None) -> None:
        """Put one scene in each of the first worlds; the others stay empty. No compilation.

        starts : ``particles.arrays`` of each scene, where the caller has made them already.
        Raises InputError when a scene is of another structure, or larger than the capacity.
        """
        self.s.check()
        must(0 < len(scenes) <= self.worlds, "number of scenes", f"1 to {self.worlds}", len(scenes))
        for scene in scenes:
            must(scene.structure() == self.structure, "scene", "of the structure compiled", scene.name)
            room = scene.capacity()
            must(
                room <= self.s.capacity,
                f"particles of scene {scene.name!r}",
                f"at most {self.s.capacity}",
                room,
            )
        starts = list(starts or (scene.particles.arrays(scene.domain, scene.seed) for scene in scenes))
        for scene, start in zip(scenes, starts, strict=True):
            self._fits(scene, start)
        columns = {f.name: self._blank(f) for f in self.s.fields}
        for w, start in enumerate(starts):
            for name, column in columns.items():
                n = len(start["mass"])
                column[w, :n] = np.arange(n) if name == "id" else start.get(name, 0)
        for name, column in columns.items():
            self.s.write(name, column)
        counts = np.array([len(start["mass"]) for start in starts] + [0] * (self.worlds - len(starts)))
        self._reset(scenes, starts, counts)
        self.table.write([self._parts(scene) for scene in scenes])
        self.scenes, self.starts, self.wall_s = list(scenes), starts, 0.0
        if self.near is not None:
            self.near.stale.fill(1)
        if self.first.items:
            self.first.advance(1)
        self.watch = Watch(self.s, self.scenes)
        # A start can fail already: more contacts than there is room for, an infinite force.
        self.watch.look()

    def _blank(self, f: Any) -> np.ndarray:
        shape = (self.worlds, self.s.capacity) + ((3,) if f.components == 3 else ())
        real = np.float64 if self.runtime.precision == "f64" else np.float32
        return np.ones(shape, dtype=np.int32 if f.integer else real) * (f.name in ("mass", "radius"))

    def _fits(self, scene: Scene, start: Arrays) -> None:
        low, high = scene.domain.bounds()
        if low is not None:
            inside = ((start["position"] >= low) & (start["position"] < high)).all()
            must(bool(inside), "particles.position", "inside the domain", "a particle outside")
        known = {f.name for f in self.s.fields} | {"temperature"}
        for name in start:
            must(
                name in known, f"particles.{name}", f"a field of the scene ({', '.join(sorted(known))})", name
            )
        for f in self.s.fields:
            wanted = (len(start["mass"]),) + ((3,) if f.components == 3 else ())
            shape = start[f.name].shape if f.name in start else wanted
            must(shape == wanted, f"particles.{f.name}", f"of shape {wanted}", shape)
        cold = start.get("temperature", np.zeros(1)).min()
        must(cold >= 0, "particles.temperature", "at least 0 K", float(cold))
        missing = {n for e in scene.effects for n in e.needs if isinstance(n, str)} - start.keys()
        if missing:
            names = ", ".join(sorted(missing))
            raise InputError(
                f"particles must be given {names}, which effects of the scene need; received none"
            )

    def _reset(self, scenes: Sequence[Scene], starts: list[Arrays], counts: np.ndarray) -> None:
        for name in (*CLOCK, *BOOKS, *self.s.counters):
            getattr(self.s, name).fill(0)
        empty = self.worlds - len(scenes)
        for name in MOTION:
            getattr(self.s, name).fill(0)
        frame = [np.average(a["velocity"], axis=0, weights=a["mass"]) for a in starts]
        self.s.write("frame", np.array(frame + [np.zeros(3)] * empty))
        self.s.write("seed", np.array([scene.seed for scene in scenes] + [0] * empty))
        self.s.write("count", counts.astype(np.int32))
        self.s.write("next_id", counts.astype(np.int32))
        self.s.write("status", np.array([RUNNING] * len(scenes) + [ENDED] * empty, dtype=np.int32))
        self.s.write("end", np.array([scene.duration for scene in scenes] + [0.0] * empty))
        self.s.write(
            "volume", np.array([_volume(*pair) for pair in zip(scenes, starts, strict=True)] + [1.0] * empty)
        )
        self.s.approach_time.fill(np.inf)
        self.s.culprit.fill(2**31 - 1)
        self.s.blame.fill(2**31 - 1)

    def run(self, progress: Callable[[float], None] | None = None, steps: int | None = None) -> None:
        """Run every world to its end, or for at most ``steps`` more steps each.

        progress : called about four times a second with the fraction done, 0..1.
        """
        for _ in self.chunks(steps):
            if progress:
                progress(self.fraction())

    def chunks(self, steps: int | None = None) -> Iterator[None]:
        """The same in stretches of some steps, about four a second: between them, whoever runs this may look
        at the state, save a checkpoint, or stop for good or for a while."""
        self.s.check()
        done, chunk = 0, 8
        while (self.s.read("status") == RUNNING).any() and (steps is None or done < steps):
            n = chunk if steps is None else min(chunk, steps - done)
            began = time.perf_counter()
            self.program.advance(n)
            self.watch.look()
            taken = time.perf_counter() - began
            self.wall_s += taken
            done += n
            if taken < CHUNK_SECONDS / 2:
                chunk = min(2 * chunk, 100_000)
            elif taken > 2 * CHUNK_SECONDS:
                chunk = max(chunk // 2, 1)
            yield

    def fraction(self) -> float:
        """Part of the simulated time that is done, the mean over worlds; 1 for a world that has failed."""
        n = len(self.scenes)
        ended = self.s.read("status")[:n] != RUNNING
        return float(np.where(ended, 1.0, self.s.read("time")[:n] / self.s.read("end")[:n]).mean())

    def ended(self) -> list[int]:
        """The loaded worlds that run no more, for good or ill."""
        status = self.s.read("status")[: len(self.scenes)]
        return [int(w) for w in np.flatnonzero(status != RUNNING)]

    def results(self, worlds: Sequence[int] | None = None) -> list[Result]:
        """Loaded worlds read back: those asked for, or all of them, in order."""
        tallies = {name: self.s.read(name) for name in self.s.counters}
        status, good = self.s.read("status"), self.watch.good
        found = []
        for w in range(len(self.scenes)) if worlds is None else worlds:
            n = int(good["count"][w])
            found.append(
                Result(
                    scene=self.scenes[w],
                    state={f.name: good[f.name][w, :n].copy() for f in self.s.fields},
                    start=self.starts[w],
                    time=float(good["time"][w]),
                    work={name: int(tally[w]) for name, tally in tallies.items()},
                    status=self.watch.status(w, int(status[w])),
                    wall_s=self.wall_s / len(self.scenes),
                    settings=self.runtime.settings,
                )
            )
        return found

    def close(self) -> None:
        """Give the device memory back."""
        for part in self.parts:
            part.destroy()


def _volume(scene: Scene, start: Arrays) -> float:
    low, high = scene.domain.bounds()
    if low is None or high is None:
        reach = start["radius"].max()
        low, high = start["position"].min(axis=0) - reach, start["position"].max(axis=0) + reach
    return float(np.prod(high - low))
