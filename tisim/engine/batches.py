"""Many scenes, a batch of worlds at a time, on compiled simulations that are kept for the next ones."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, overload

from tisim.backend import memory, runtime
from tisim.engine.crowding import check_places
from tisim.engine.result import Result, Status
from tisim.engine.simulation import Simulation
from tisim.errors import InputError, must
from tisim.scene.initial_state import Arrays
from tisim.scene.placed_together import placed_together
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from tisim.io.recording import Recording
    from tisim.io.trajectory import Trajectory


BATCH_PARTICLES = 300_000
"""All worlds of a batch have this many particles at most, which bounds its memory to some hundred MB."""
IDLE_SIMULATIONS = 8
"""At most this many compiled simulations are kept for later calls."""
SPARE, WASTE = 4096, 8
"""A kept simulation serves where it has room for at most so many particles, or so many times what is needed:
all of its room is loaded and looked at."""
FEW_WORLDS = 8
"""A small scene is compiled for so many worlds, as what one world of it shows is often asked of a few."""

Progress = Callable[[float], None]


def progress_of_part(progress: Progress, finished_parts: int, parts: int) -> Progress:
    """Return the function that reports the progress of one of several equal parts as that of the whole.

    finished_parts : how many of the ``parts`` are over already.
    """
    return lambda fraction: progress((finished_parts + fraction) / parts)


class Batches:
    """Batches make results of scenes: those of one structure (effects, options, domain, stepper) run side by
    side.

    limit : the largest number of worlds of a batch. A world is yielded when it has ended, while others go on,
    so that whoever keeps results loses little when stopped.
    """

    def __init__(self, limit: int = 256) -> None:
        must(limit >= 1, "batch", "at least 1", limit)
        self.limit = limit
        self._idle: list[Simulation] = []
        _all.add(self)

    def run(
        self,
        scenes: Sequence[Scene],
        progress: Progress | None = None,
        strict: bool = True,
        trajectory: Trajectory | None = None,
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as worlds end, after those whose start cannot be made.

        progress : called with the finished fraction of this call, 0..1. strict : raise the InputError of a
        start that cannot be made; otherwise it becomes a failed Result. trajectory : made for these scenes;
        records them.
        """
        starts: dict[int, Arrays] = {}
        groups: dict[Any, list[int]] = {}
        failures: dict[int, str] = {}
        with placed_together(scenes):
            for index, scene in enumerate(scenes):
                try:
                    start = scene.start()
                    # Before anything is compiled, and so that a search goes on without it.
                    check_places(scene, start)
                except InputError as error:
                    if strict:
                        raise
                    failures[index] = str(error)
                else:
                    starts[index] = start
                    groups.setdefault(scene.structure(), []).append(index)
        for index, reason in failures.items():
            failed = Status(False, reason)
            yield index, Result(scenes[index], {}, {}, 0.0, {}, failed, 0.0, runtime.current().described)
        finished_scenes = len(failures)
        for members in groups.values():
            with self._simulation([scenes[k] for k in members]) as simulation:
                for begin in range(0, len(members), simulation.worlds):
                    batch = members[begin : begin + simulation.worlds]
                    simulation.load([scenes[k] for k in batch], [starts.pop(k) for k in batch])
                    observers = [trajectory.recorder(simulation, batch)] if trajectory else []
                    handed_on: set[int] = set()
                    for _ in simulation.chunks(observers=observers):
                        new = [w for w in simulation.ended() if w not in handed_on]
                        yield from zip((batch[w] for w in new), simulation.results(new), strict=True)
                        handed_on.update(new)
                        if progress:
                            progress((finished_scenes + len(batch) * simulation.fraction()) / len(scenes))
                    finished_scenes += len(batch)

    @contextmanager
    def _simulation(self, scenes: Sequence[Scene]) -> Iterator[Simulation]:
        """Yield a compiled simulation for scenes of one structure, which nobody else uses meanwhile."""
        capacity = max(scene.capacity() for scene in scenes)
        worlds = max(1, min(len(scenes), self.limit, BATCH_PARTICLES // capacity))
        simulation = self._reusable(scenes[0].structure(), worlds, capacity)
        if simulation is None:
            _restart_taichi()
            capacity = rounded(capacity)
            few = FEW_WORLDS if FEW_WORLDS * capacity <= SPARE else 1
            worlds = max(1, min(max(few, rounded(worlds)), self.limit, BATCH_PARTICLES // capacity))
            simulation = Simulation(scenes[0], worlds, capacity)
        try:
            yield simulation
        finally:
            with _lock:
                self._idle.append(simulation)
                old, self._idle = self._idle[:-IDLE_SIMULATIONS], self._idle[-IDLE_SIMULATIONS:]
            for each in old:
                each.close()

    def _reusable(self, structure: Any, worlds: int, capacity: int) -> Simulation | None:
        """Return the smallest idle simulation that serves, taken out of the idle ones; None where none
        does."""
        most = max(SPARE, WASTE * worlds * capacity)
        with _lock:
            self._idle = [each for each in self._idle if each.s.alive]
            serve = [
                each
                for each in self._idle
                if each.structure == structure
                and each.worlds >= worlds
                and each.s.capacity >= capacity
                and each.worlds * each.s.capacity <= most
            ]
            if not serve:
                return None
            best = min(serve, key=lambda each: each.worlds * each.s.capacity)
            self._idle.remove(best)
            return best

    def close(self) -> None:
        """Give the device memory back, of all that does not run."""
        with _lock:
            old, self._idle = self._idle, []
        for each in old:
            each.close()


_lock = threading.Lock()
"""This lock is held while a simulation changes hands."""
_all: weakref.WeakSet[Batches] = weakref.WeakSet()


def rounded(number: int) -> int:
    """Return the next number up whose binary digits are all 0 after the first three.

    A size is compiled in: so scenes of like sizes share what is compiled, in this process and in those that
    find it on the disk.
    """
    unit = 1 << max(0, number.bit_length() - 3)
    return -(-number // unit) * unit


def _restart_taichi() -> None:
    """Start Taichi anew where it has grown, and nothing would be lost but simulations that are kept idle."""
    if memory.needs_restart():
        _close_if_nothing_runs()
        memory.renew()


def _close_if_nothing_runs() -> None:
    """Close the simulations that all Batches keep idle, unless something else is in use."""
    with _lock:
        idle = [each for batches in _all for each in batches._idle]
        needed = not memory.in_use() <= {tree for each in idle for tree in each.trees}
    if not needed:
        _close_idle()


def _close_idle() -> None:
    """Give the memory back of what all Batches keep idle."""
    for batches in list(_all):
        batches.close()


memory.reclaimers.append(_close_idle)


_batches = Batches()


@overload
def run(scenes: Scene, progress: Progress | None = None, record: Recording | None = None) -> Result: ...


@overload
def run(
    scenes: Sequence[Scene], progress: Progress | None = None, record: Recording | None = None
) -> list[Result]: ...


def run(
    scenes: Scene | Sequence[Scene], progress: Progress | None = None, record: Recording | None = None
) -> Result | list[Result]:
    """Run a scene, or many as one batch; return its Result, or theirs in order.

    progress : called about four times a second with the finished fraction, 0..1. record : a trajectory to
    write, such as ``Recording("flow.h5", frames=100)``; it does not change the results.
    What has been compiled is kept for later calls. A world's result is the same bits alone or in a batch.
    Several threads may call at once: each waits for its turn. ``progress`` may call this in turn.
    Raises InputError when a start cannot be made or lacks what an effect needs. A run that fails on its way
    returns a Result, whose ``status`` says so: who does not read that is warned (see Result).
    """
    if isinstance(scenes, Scene):
        return run([scenes], progress, record)[0]
    sound = isinstance(scenes, Sequence) and all(isinstance(scene, Scene) for scene in scenes)
    must(sound, "scenes", "a Scene or a list of them (Scene.from_toml reads a file)", scenes)
    with runtime.turn:
        if record is None:
            results = dict(_batches.run(scenes, progress))
        else:
            with record.create(scenes, runtime.current().precision) as trajectory:
                results = dict(_batches.run(scenes, progress, trajectory=trajectory))
    return [results[index].watched() for index in range(len(scenes))]
