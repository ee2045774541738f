"""The contract of loaded worlds: the part of a simulation that monitors, replays and checkpoints use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from tisim.backend.runtime import Runtime
from tisim.engine.assembly import Assembly
from tisim.pairs.half_list import ListSizes
from tisim.program.launched_program import LaunchedProgram
from tisim.program.program import Program
from tisim.scene.scene import Scene
from tisim.state.state import FiniteCheck, State


class Worlds(Protocol):
    """Worlds are the loaded scenes of a batch and their state, between two steps; ``Simulation`` is one.

    worlds : number of worlds in memory, of which the first are loaded. scenes : the loaded scenes, in order.
    s : the state of all worlds. edits : descriptions of the quantities written to each loaded world.
    wall_s : wall time (s) of the run. first : prepares the first step. sort : sorts particles in memory; None
    if they keep their order.
    """

    worlds: int
    scenes: list[Scene]
    s: State
    runtime: Runtime
    edits: list[list[str]]
    wall_s: float
    first: Program
    sort: LaunchedProgram | None

    @property
    def assembly(self) -> Assembly:
        """Return the items of a step."""

    @property
    def finite_check(self) -> FiniteCheck:
        """Return the check on the device that all quantities are finite."""

    def put(self, image: Mapping[str, np.ndarray]) -> None:
        """Put all worlds back into the state of an image, a copy of their state made by ``s.image()``."""

    def begin(self) -> None:
        """Set every world to its initial state, and prepare the first step."""

    def advance(self, steps: int) -> None:
        """Take at most this number of steps in every running world."""

    def is_running(self, until: float = np.inf) -> bool:
        """Return whether any world has steps to take before ``until`` (s) or its goal, a number of steps."""

    def list_sizes(self) -> ListSizes:
        """Return sizes that would have held the pair lists as last made."""

    def grow_lists(self, sizes: ListSizes) -> None:
        """Make pair lists of these sizes, and compile the step again for them."""

    def in_order(self, w: int, good: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the indices of the live particles of a world in output order.

        good : quantities of all worlds by name, such as those of the last good state.
        """

    def measures(self, worlds: Sequence[int]) -> list[dict[str, float]]:
        """Return the current measures of these loaded worlds, by name."""
