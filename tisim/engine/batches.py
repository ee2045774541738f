"""Many scenes run as batches of worlds on compiled simulations, which are kept for later scenes."""

from __future__ import annotations

import dataclasses
import threading
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, overload

from tisim.backend import memory, runtime
from tisim.components.component import rounded
from tisim.console import shown_progress
from tisim.engine.crowding import check_places
from tisim.engine.observer import Observer
from tisim.engine.result import Result, Status
from tisim.engine.shared_room import SharedRooms
from tisim.engine.simulation import Simulation
from tisim.errors import InputError, must
from tisim.scene.initial_state import Arrays
from tisim.scene.placed_together import placed_together
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from tisim.io.recording import Recording


BATCH_PARTICLES = 300_000
"""Largest number of particles in all worlds of a batch; it bounds the memory to some hundred MB."""
IDLE_SIMULATIONS = 8
"""At most this many compiled simulations are kept for later calls."""
SPARE, WASTE = 4096, 8
"""A kept simulation is reused only if its total capacity is at most SPARE particles, or WASTE times the
capacity needed, because all of it is loaded and checked."""
FEW_WORLDS, FEW_NUMBERS = 8, 100_000
"""A small scene, with at most ``FEW_NUMBERS`` in its lists, is compiled for ``FEW_WORLDS`` worlds, because a
few more worlds of it are often run later."""
BATCH_NUMBERS = 200_000_000
"""Most numbers in the lists of all worlds of a batch, 1.6 GB."""

Progress = Callable[[float], None]


def progress_of_part(progress: Progress, finished_parts: int, parts: int) -> Progress:
    """Return a function that converts the progress of one of several equal parts to overall progress.

    finished_parts : number of the ``parts`` that are already finished.
    """
    return lambda fraction: progress((finished_parts + fraction) / parts)


class Batches:
    """Batches runs scenes and yields their results; scenes of one structure (effects, options, domain,
    stepper) run side by side. Most lists, such as the fibres of a magnet, may have different lengths.

    limit : the largest number of worlds of a batch.

    A world is yielded when it has ended, while the others continue. A caller that stores results therefore
    loses little when it is stopped.
    """

    def __init__(self, limit: int = 256) -> None:
        must(limit >= 1, "batch", "at least 1", limit)
        self.limit = limit
        self._idle: list[Simulation] = []
        self._rooms = SharedRooms()
        _all.add(self)

    def run(
        self,
        scenes: Sequence[Scene],
        progress: Progress | None = None,
        strict: bool = True,
        recorder: Callable[[Simulation, list[int]], Observer] | None = None,
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) as worlds end; scenes without a valid initial state come first.

        progress : called with the finished fraction of this call, 0..1.
        strict : raise the InputError of an invalid initial state; otherwise it becomes a failed Result.
        recorder : returns the observer that records a loaded simulation, given the index into scenes of each
            of its worlds.
        """
        starts: dict[int, Arrays] = {}
        failures: dict[int, str] = {}
        with placed_together(scenes):
            for index, scene in enumerate(scenes):
                try:
                    start = scene.start()
                    # Checked before anything is compiled, so that a search can go on without this scene.
                    check_places(scene, start)
                except InputError as error:
                    if strict:
                        raise
                    failures[index] = str(error)
                else:
                    starts[index] = start
        roomy = dict(zip(starts, self._rooms.scenes([scenes[k] for k in starts]), strict=True))
        groups: dict[Any, list[int]] = {}
        for index, scene in roomy.items():
            groups.setdefault(scene.structure(), []).append(index)
        yield from _refused(scenes, failures)
        finished_scenes = len(failures)
        for structure, members in groups.items():
            with self.simulation(structure, [roomy[k] for k in members]) as simulation:
                for begin in range(0, len(members), simulation.worlds):
                    batch = members[begin : begin + simulation.worlds]
                    refused = _load(simulation, batch, roomy, starts, strict)
                    yield from _refused(scenes, refused)
                    finished_scenes += len(refused)
                    batch = [k for k in batch if k not in refused]
                    if not batch:
                        continue
                    observers = [recorder(simulation, batch)] if recorder else []
                    handed_on: set[int] = set()
                    for _ in simulation.chunks(observers=observers):
                        new = [w for w in simulation.ended() if w not in handed_on]
                        for w, result in zip(new, simulation.results(new), strict=True):
                            yield batch[w], dataclasses.replace(result, scene=scenes[batch[w]])
                        handed_on.update(new)
                        if progress:
                            progress((finished_scenes + len(batch) * simulation.fraction()) / len(scenes))
                    finished_scenes += len(batch)

    @contextmanager
    def simulation(self, structure: Any, scenes: Sequence[Scene], least: int = 1) -> Iterator[Simulation]:
        """Yield a compiled simulation for scenes of this structure, reserved for this caller meanwhile.

        least : number of worlds that it has at least, whatever the limits of a batch.
        """
        capacity, numbers = max(scene.capacity() for scene in scenes), max(1, scenes[0].room_size())
        worlds = min(len(scenes), max(least, self._most(capacity, numbers)))
        simulation = self._reusable(structure, worlds, capacity, numbers)
        if simulation is None:
            _restart_taichi()
            capacity = rounded(capacity)
            few = FEW_WORLDS if FEW_WORLDS * capacity <= SPARE and numbers <= FEW_NUMBERS else 1
            worlds = min(max(few, rounded(worlds)), max(least, self._most(capacity, numbers)))
            simulation = Simulation(scenes[0], worlds, capacity)
        try:
            yield simulation
        finally:
            with _lock:
                self._idle.append(simulation)
                old, self._idle = self._idle[:-IDLE_SIMULATIONS], self._idle[-IDLE_SIMULATIONS:]
            for each in old:
                each.close()

    def _most(self, capacity: int, numbers: int) -> int:
        """Return the largest number of worlds of a batch for a capacity and the numbers in the lists of a
        world."""
        return min(self.limit, BATCH_PARTICLES // capacity, max(1, BATCH_NUMBERS // numbers))

    def _reusable(self, structure: Any, worlds: int, capacity: int, numbers: int) -> Simulation | None:
        """Take the smallest suitable simulation out of the idle ones; return None if none is suitable.

        numbers : in the lists of a world, which are the same in all simulations of a structure.
        """
        most = max(SPARE, WASTE * worlds * capacity)
        most_worlds = max(FEW_WORLDS * FEW_NUMBERS // numbers, WASTE * worlds)
        with _lock:
            self._idle = [each for each in self._idle if each.s.alive]
            serve = [
                each
                for each in self._idle
                if each.structure == structure
                and each.worlds >= worlds
                and each.s.capacity >= capacity
                and each.worlds * each.s.capacity <= most
                and each.worlds <= most_worlds
            ]
            if not serve:
                return None
            best = min(serve, key=lambda each: each.worlds * each.s.capacity)
            self._idle.remove(best)
            return best

    def close(self) -> None:
        """Free the device memory of all idle simulations."""
        with _lock:
            old, self._idle = self._idle, []
        for each in old:
            each.close()


def _load(
    simulation: Simulation,
    batch: list[int],
    scenes: Mapping[int, Scene],
    starts: dict[int, Arrays],
    strict: bool,
) -> dict[int, str]:
    """Load the scenes of a batch; return the reason for each that is refused, by index. These are left out.

    A simulation refuses all scenes that are loaded together with one that it cannot load.
    """
    refused: dict[int, str] = {}
    own = {k: starts.pop(k) for k in batch}
    try:
        simulation.load([scenes[k] for k in batch], list(own.values()))
    except InputError:
        if strict:
            raise
        for k in batch:
            try:
                simulation.load([scenes[k]], [own[k]])
            except InputError as error:
                refused[k] = str(error)
        sound = [k for k in batch if k not in refused]
        if sound:
            simulation.load([scenes[k] for k in sound], [own[k] for k in sound])
    return refused


def _refused(scenes: Sequence[Scene], reasons: Mapping[int, str]) -> Iterator[tuple[int, Result]]:
    """Yield a failed result for each refused scene."""
    for index, reason in reasons.items():
        failed = Status(False, reason)
        yield index, Result(scenes[index], {}, {}, 0.0, {}, failed, 0.0, runtime.current().described)


_lock = threading.Lock()
"""Held while a simulation is taken from or returned to the idle ones."""
_all: weakref.WeakSet[Batches] = weakref.WeakSet()


def _restart_taichi() -> None:
    """Restart Taichi if its memory has grown and only idle simulations would be lost."""
    if memory.needs_restart():
        _close_if_nothing_runs()
        memory.renew()


def _close_if_nothing_runs() -> None:
    """Close the idle simulations of all Batches, unless other memory is in use."""
    with _lock:
        idle = [each for batches in _all for each in batches._idle]
        needed = not memory.in_use() <= {tree for each in idle for tree in each.trees}
    if not needed:
        _close_idle()


def _close_idle() -> None:
    """Free the memory of all idle simulations of all Batches."""
    for batches in list(_all):
        batches.close()


memory.reclaimers.append(_close_idle)


_batches = Batches()


@contextmanager
def loaded(scenes: Sequence[Scene]) -> Iterator[Simulation]:
    """Yield a simulation into which scenes of one structure are loaded, for callers that change or read
    states between parts of a run.

    The simulation is kept for later calls, as those of ``run`` are. Kernels are never freed, so a search that
    made a new one for each design would need more and more memory.
    """
    with runtime.turn, _batches.simulation(scenes[0].structure(), scenes, len(scenes)) as simulation:
        simulation.load(scenes)
        yield simulation


@overload
def run(
    scenes: Scene, progress: Progress | bool | None = None, record: Recording | None = None
) -> Result: ...


@overload
def run(
    scenes: Sequence[Scene], progress: Progress | bool | None = None, record: Recording | None = None
) -> list[Result]: ...


def run(
    scenes: Scene | Sequence[Scene], progress: Progress | bool | None = None, record: Recording | None = None
) -> Result | list[Result]:
    """Run one scene, or many as one batch; return its Result, or a list of Results in order.

    progress : called about four times a second with the finished fraction, 0..1. True shows a progress bar,
    on a terminal or in a notebook.
    record : a trajectory to write, such as ``Recording("flow.h5", frames=100)``; it does not change the
    results.

    Compiled simulations are kept for later calls. The result of a world is bitwise the same alone and in a
    batch. Several threads may call at once; each waits for its turn. ``progress`` may itself call ``run``.

    Raises InputError if an initial state cannot be made or lacks a quantity that an effect needs. A run that
    fails later returns a Result whose ``status`` gives the reason; a caller that does not read it gets a
    warning (see Result).
    """
    if isinstance(scenes, Scene):
        return run([scenes], progress, record)[0]
    if progress is True:
        with shown_progress("running") as shown:
            return run(scenes, shown, record)
    sound = isinstance(scenes, Sequence) and all(isinstance(scene, Scene) for scene in scenes)
    must(sound, "scenes", "a Scene or a list of them (Scene.from_toml reads a file)", scenes)
    with runtime.turn:
        if record is None:
            results = dict(_batches.run(scenes, progress or None))
        else:
            with record.recorders(scenes, runtime.current().precision) as recorder:
                results = dict(_batches.run(scenes, progress or None, recorder=recorder))
    return [results[index].watched() for index in range(len(scenes))]
