"""Worlds of one structure in device memory, and the kernels of their steps."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import cached_property

import numpy as np

from tisim.backend import memory, runtime
from tisim.backend.memory import OutOfMemory, Tree, collected
from tisim.backend.runtime import Runtime
from tisim.backend.thread import in_taichi_thread
from tisim.compiling import compiling
from tisim.engine import law_errors
from tisim.engine.allocation import Allocation
from tisim.engine.assembly import Assembly
from tisim.errors import InputError, RunError, must
from tisim.pairs.half_list import ListSizes
from tisim.program.evaluation_stage import EvaluationStage
from tisim.program.launched_program import LaunchedProgram
from tisim.program.phases import Item, nested
from tisim.program.program import Program
from tisim.program.team import Teams
from tisim.program.world_program import world_programs
from tisim.scene.scene import Scene
from tisim.state.state import FiniteCheck, State
from tisim.state.status import NEVER, WorldStatus


class CompiledWorlds:
    """Compiled worlds are the fields and kernels for one scene structure, a number of worlds and a particle
    capacity.

    They do not know about scenes or results.
    """

    def __init__(self, scene: Scene, worlds: int, capacity: int, schedule: str | None) -> None:
        began = time.perf_counter()
        self.runtime, self.worlds = runtime.current(), worlds
        self.structure = scene.structure()
        awake = schedule != "team" or self.runtime.device == "cpu"
        must(awake, "schedule", "world or particle on this device, as team needs a CPU", schedule)
        self.trees: list[Tree] = []
        self._make(scene, worlds, capacity, schedule)
        self.setup_s = time.perf_counter() - began

    @in_taichi_thread
    def _make(self, scene: Scene, worlds: int, capacity: int, schedule: str | None) -> None:
        """Place all fields, and compile the kernels of a step."""
        try:
            self._allocate(scene, worlds, capacity)
        except OutOfMemory:
            # Try again after freeing cached memory.
            memory.reclaim()
            try:
                self._allocate(scene, worlds, capacity)
            except OutOfMemory as no:
                what, others = f"{no.what} for {worlds} x {capacity} particles", memory.bytes_in_use()
                rule = f"{no.rule}, with {others / 1e9:.3g} GB that others use" if others else no.rule
                raise InputError(f"{what} must be {rule}; received {no.received}") from None
        self.s, self.table = self.allocation.s, self.allocation.table
        self.schedule = schedule or choose(self.assembly.step, self.s, self.runtime)
        self.s.shared = self.schedule != "world"
        self.s.write("status", WorldStatus.ENDED)
        if self.schedule != "particle":
            self._make_teams()
        self._compile()

    def _allocate(self, scene: Scene, worlds: int, capacity: int) -> None:
        with collected() as trees:
            self.allocation = Allocation(scene, worlds, capacity)
        self.trees += trees

    def _make_teams(self) -> None:
        """Make the teams: several threads for a world, or single threads."""
        # Members of a team wait for each other in busy loops, so each needs its own core.
        threads = min(self.runtime.threads, runtime.cores())
        number = threads
        if self.schedule == "team":
            number = min(self.worlds, threads)
            threads = min(threads, number * members(self.assembly.step, self.s, threads))
        with collected() as trees:
            self.teams = Teams(self.worlds, work_of(self.assembly.step, self.s), threads, number)
        self.trees += trees

    def _compile(self) -> None:
        """Compile the kernels of a step; no world may be running."""
        sort, first, step = self.assembly.sort, self.assembly.first, self.assembly.step
        rest_every = sort.every if sort else NEVER
        self.first: Program
        self.program: Program
        if self.schedule == "particle":
            self.first = LaunchedProgram(self.s, first, once=True)
            self.program = LaunchedProgram(self.s, step, rest_every)
        else:
            self.first, self.program = world_programs(self.s, (first, step), self.teams, rest_every)
        self.sort = LaunchedProgram(self.s, sort.items(), once=True) if sort else None
        with law_errors.in_a_line(), compiling():
            for program in (self.program, self.first, self.sort):
                if program and program.items:
                    program.compile()

    @property
    def assembly(self) -> Assembly:
        """Return the items of a step."""
        return self.allocation.assembly

    def list_sizes(self) -> ListSizes:
        """Return sizes that would have held the pair lists as last made."""
        lists = self.assembly.lists
        return lists.wanted(self.assembly.sizes) if lists else ListSizes()

    @in_taichi_thread
    def grow_lists(self, sizes: ListSizes) -> None:
        """Make pair lists of these sizes, and compile the step again for them.

        Raise RunError if there is not enough memory. This is checked before any list is made, and the lists
        then stay as they were.
        """
        before = self.assembly.sizes
        rows = f"lists of {sizes.row} pairs for a particle, {sizes.mean} on average, and of {sizes.near}"
        rows += " for events and step control do not fit in memory"
        needed = self.assembly.list_bytes(sizes), self.assembly.list_bytes(before)
        try:
            try:
                memory.require_lists(*needed)
            except OutOfMemory:
                # Cached memory may be in the way.
                memory.reclaim()
                memory.require_lists(*needed)
        except OutOfMemory as no:
            raise RunError(f"{rows}: {no}") from None
        began, image = time.perf_counter(), self.s.image()
        self.s.write("status", WorldStatus.ENDED)
        try:
            try:
                self._assemble(sizes)
            except OutOfMemory:
                # Try again after freeing cached memory.
                memory.reclaim()
                self._assemble(sizes)
        except RunError as full:
            self._assemble(before)
            raise RunError(f"{rows}: {full}") from None
        finally:
            self.put(image)
            self.setup_s += time.perf_counter() - began

    def _assemble(self, sizes: ListSizes) -> None:
        with collected() as trees:
            self.allocation.assemble(sizes)
        # The fields of the previous lists have been destroyed.
        self.trees = [tree for tree in self.trees if tree.alive] + trees
        self._compile()

    def put(self, image: Mapping[str, np.ndarray]) -> None:
        """Put all worlds back into the state of an image made by ``s.image()``."""
        # A world that failed may have stopped in the middle of a step.
        self.s.fill({**image, "evaluation_stage": EvaluationStage.STEP})
        self.forget_lists()

    def forget_lists(self) -> None:
        """Have pair lists rebuilt before their next use."""
        if self.assembly.lists is not None:
            self.assembly.lists.forget()

    def advance(self, steps: int) -> None:
        """Take at most ``steps`` steps in every running world; large worlds are first sorted in memory if
        that is due."""
        if self.sort:
            self.sort.advance(1)
        self.program.advance(steps)

    @cached_property
    @in_taichi_thread
    def finite_check(self) -> FiniteCheck:
        """Return the check on the device that all quantities are finite, made at first use."""
        with collected() as trees:
            check = FiniteCheck(self.s)
        self.trees += trees
        return check

    def close(self) -> None:
        """Free the device memory. Any later use except closing again raises RunError."""
        for tree in self.trees:
            tree.destroy()


TEAM_FROM = 2000
"""Several threads share a world from this work (in particles) on, if there are more threads than worlds.

Two threads are faster than one with 8000 grains (docs/performance.md) and slower with 500. A team has one
member for each half of this number.
"""
OTHERS_OF_ONE = 40
"""Number of pair partners whose computation takes as long as the rest of a step of one particle.

The step of a grain takes some 80 ns, the force between two charges or dipoles 1 to 2 ns.
"""


def work_of(step: tuple[Item, ...], s: State) -> int:
    """Return the work of one step of a world at full capacity, in particles with short-ranged forces only."""
    # Some phases appear twice in the step but run once.
    others = sum(phase.extent * phase.others for phase in {phase for phase, _ in nested(step)})
    return s.capacity + others // OTHERS_OF_ONE


def members(step: tuple[Item, ...], s: State, threads: int) -> int:
    """Return the largest number of threads for a world; more would mostly wait for each other."""
    return min(threads, max(2, 2 * work_of(step, s) // TEAM_FROM))


def choose(step: tuple[Item, ...], s: State, runtime: Runtime) -> str:
    """Return the schedule with the shortest time per step."""
    if runtime.device != "cpu" or any(phase.long for phase, _ in nested(step)):
        return "particle"
    # One thread for each world is best. Fewer worlds are shared by threads if their work outweighs the
    # waiting.
    many = s.worlds >= runtime.threads
    return "world" if many or work_of(step, s) < TEAM_FROM else "team"
