"""Chains that are followed while a cell is sheared: contacts that break and form, and grains that change
from one chain to another (L21 Fig. 2.10).

The grains between the rafts touch in a single network, in which a chain is no unit of its own. The measure is
therefore the largest number of chains side by side, from raft to raft, that do not share a grain. Chains of
contacts that have lasted since the start of shear become fewer as chains break; the number of all chains
stays if others form in their place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import trapezoid
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra, shortest_path

from tisim import Observer, Result, Scene, Simulation
from tisim.analysis import contacts, disjoint_chains, periodic_sides
from tisim.cases.common.runs import sound
from tisim.cases.mrf_shear.measures import CHAINED
from tisim.cases.mrf_shear.scene import LOWER, STRAIN, UPPER, scene
from tisim.engine.batches import loaded
from tisim.operators import JoinGroup
from tisim.scene.initial_state import Arrays

FRAMES = 100
"""Number of frames of a cell after the start of shear, at equal times."""
CONTACT_ENDS = 0.25
"""Gap between the surfaces of two grains at which their contact has ended, as a fraction of the mean radius.
A contact begins at CHAINED, which is smaller, so that grains that vibrate do not count as parted."""
UNSHEARED = 1e-4
"""Ratio of the shear rate and the strain of the control, a cell that is hardly sheared, to the values of the
sheared cell."""
CHAINS_APART = 4
"""Smallest number of contacts on the shortest way between two grains of different chains."""


class PositionSeries(Observer):
    """Records the positions of each world at FRAMES equal intervals after the start of shear.

    ``rows[w]`` are pairs of time (s) and positions (m) of world w.
    """

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self.times = [np.linspace(shear_begins(one), one.duration, FRAMES + 1) for one in scenes]
        self.rows: list[list[tuple[float, np.ndarray]]] = [[] for _ in scenes]

    def pause(self, simulation: Simulation) -> np.ndarray:
        due = zip(self.times, self.rows, strict=True)
        return np.array([times[len(rows)] if len(rows) < len(times) else np.inf for times, rows in due])

    def observe(self, simulation: Simulation) -> None:
        # The last time is the end of the run, up to rounding.
        due = (1 - 1e-9) * self.pause(simulation)
        for rows, at, state in zip(self.rows, due, simulation.states, strict=True):
            if state.time >= at:
                rows.append((state.time, np.array(state["position"])))


def shear_begins(scene: Scene) -> float:
    """Return the time at which the rafts of a cell are frozen and begin to move, s."""
    return next(float(one.time) for one in scene.effects if isinstance(one, JoinGroup))


@dataclass(frozen=True)
class Followed:
    """A cell whose contacts are followed from the start of shear.

    result : of the run. positions : of the grains in each frame, m, shape (frames, n, 3).
    """

    result: Result
    positions: np.ndarray

    @property
    def part(self) -> np.ndarray:
        """Return the fraction of the time of shear that has passed at each frame, shape (frames,)."""
        return np.linspace(0.0, 1.0, len(self.positions))

    @property
    def number(self) -> int:
        """Return the number of grains."""
        return len(self.group)

    @property
    def group(self) -> np.ndarray:
        """Return the raft of each grain: LOWER, UPPER, or 0 for a free grain."""
        return np.asarray(self.result.state["group"])

    @property
    def free(self) -> np.ndarray:
        """Return whether each grain is free."""
        return self.group == 0

    def state(self, frame: int) -> Arrays:
        """Return positions and radii of the grains in a frame."""
        return {"position": self.positions[frame], "radius": self.result.state["radius"]}

    @cached_property
    def _codes(self) -> list[np.ndarray]:
        """The contacts (i < j) of each frame as sorted numbers i n + j."""
        radius, before, found = self.result.state["radius"], np.empty(0, int), []
        sides = periodic_sides(self.result.scene.domain)
        for position in self.positions:
            close, near = (
                contacts(position, radius, gap * float(radius.mean()), sides)
                for gap in (CHAINED, CONTACT_ENDS)
            )
            old = np.intersect1d(self._code(near), before)
            before = np.union1d(self._code(close), old)
            found.append(before)
        frozen = [self._within_a_raft(codes) for codes in found]
        return [codes[~within] for codes, within in zip(found, frozen, strict=True)]

    def _code(self, pairs: np.ndarray) -> np.ndarray:
        return np.asarray(pairs[:, 0] * self.number + pairs[:, 1])

    def _pairs(self, codes: np.ndarray) -> np.ndarray:
        return np.column_stack(np.divmod(codes, self.number))

    def _within_a_raft(self, codes: np.ndarray) -> np.ndarray:
        """Whether both grains of contacts belong to one raft, in which contacts cannot break."""
        one, other = self.group[self._pairs(codes).T]
        return (one == other) & (one != 0)

    def pairs(self, frame: int) -> np.ndarray:
        """Return the contacts (i < j) in a frame without those within a raft, shape (contacts, 2)."""
        return self._pairs(self._codes[frame])

    def lasting(self, frame: int, since: int = 0) -> np.ndarray:
        """Return the contacts (i < j) that have lasted from an earlier frame to this one, shape
        (contacts, 2)."""
        kept = self._codes[since]
        for codes in self._codes[since + 1 : frame + 1]:
            kept = np.intersect1d(kept, codes)
        return self._pairs(kept)

    @property
    def broken(self) -> float:
        """Return the number of contacts that break in the run, over the number of free grains."""
        changes = zip(self._codes, self._codes[1:], strict=False)
        return sum(len(np.setdiff1d(one, other)) for one, other in changes) / int(self.free.sum())

    @property
    def formed(self) -> float:
        """Return the number of contacts that form in the run, over the number of free grains."""
        changes = zip(self._codes, self._codes[1:], strict=False)
        return sum(len(np.setdiff1d(other, one)) for one, other in changes) / int(self.free.sum())

    def chains(self, pairs: np.ndarray) -> int:
        """Return the number of chains side by side from raft to raft that contacts form."""
        return disjoint_chains(pairs, self.group == LOWER, self.group == UPPER)

    @cached_property
    def spanning(self) -> np.ndarray:
        """Return the number of chains side by side in each frame, shape (frames,)."""
        return np.array([self.chains(self.pairs(frame)) for frame in range(len(self.positions))])

    @cached_property
    def unbroken(self) -> np.ndarray:
        """Return the number of chains side by side of contacts that have lasted since the start of shear, in
        each frame, shape (frames,)."""
        return np.array([self.chains(self.lasting(frame)) for frame in range(len(self.positions))])

    @property
    def lifetime(self) -> float:
        """Return the mean life of the chains at the start of shear, as a part of the run: the area below
        ``unbroken``, over its first value.

        In a cell that is sheared by STRAIN = 1 it is a strain. Chains that outlast the run count as broken at
        its end.
        """
        return float(trapezoid(self.unbroken, self.part) / self.unbroken[0])

    def new_links(self, frame: int) -> np.ndarray:
        """Return the contacts (i < j) in a frame between free grains that were not near each other at the
        start of shear, shape (contacts, 2).

        Near are grains on a way of fewer than CHAINS_APART contacts between free grains.
        """
        new = self._pairs(np.setdiff1d(self._codes[frame], self._codes[0]))
        one, other = new.T
        steps = shortest_path(self._graph(self._between_free(0)), directed=False, unweighted=True)
        return np.asarray(new[self.free[new].all(axis=1) & (steps[one, other] >= CHAINS_APART)])

    def changed(self, frame: int = -1) -> np.ndarray:
        """Return which grains have changed chains by a frame: free grains that have lost a contact of the
        start of shear and have a new link; shape (n,)."""
        lost = self._pairs(np.setdiff1d(self._codes[0], self._codes[frame]))
        parted, joined = np.zeros(self.number, bool), np.zeros(self.number, bool)
        parted[lost], joined[self.new_links(frame)] = True, True
        return parted & joined & self.free

    @property
    def reattached(self) -> float:
        """Return the fraction of the free grains that have changed chains by the end."""
        return float(self.changed().sum() / self.free.sum())

    def shortest_chain(self) -> np.ndarray:
        """Return the grains of the shortest chain from raft to raft at the start of shear, the lowest first;
        empty if there is none."""
        lower, upper = (np.flatnonzero(self.group == raft) for raft in (LOWER, UPPER))
        graph = self._graph(self.pairs(0))
        steps, before, _ = dijkstra(
            graph, directed=False, indices=lower, return_predecessors=True, unweighted=True, min_only=True
        )
        if not np.isfinite(steps[upper]).any():
            return np.empty(0, int)
        chain = [int(upper[np.argmin(steps[upper])])]
        while before[chain[-1]] >= 0:
            chain.append(int(before[chain[-1]]))
        return np.array(chain[::-1])

    def _between_free(self, frame: int) -> np.ndarray:
        """The contacts between free grains in a frame."""
        pairs = self.pairs(frame)
        return np.asarray(pairs[self.free[pairs].all(axis=1)])

    def _graph(self, pairs: np.ndarray) -> Any:
        """Contacts as a sparse matrix."""
        return coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=2 * (self.number,)).tocsr()


def followed(settings: Mapping[str, Any], starts: int) -> tuple[list[Followed], list[Followed]]:
    """Return followed cells of some settings, which include the shear rate, from a number of starts: sheared,
    and not sheared for the same time."""
    strain = UNSHEARED * settings.get("strain", STRAIN)
    slow = {"rate": UNSHEARED * settings["rate"], "strain": strain, "before": strain / 2}
    cells = follow([scene(**{**settings, **one}, seed=seed) for one in ({}, slow) for seed in range(starts)])
    return cells[:starts], cells[starts:]


def follow(scenes: Sequence[Scene]) -> list[Followed]:
    """Return cells of one structure that are run as one batch and followed; RunError if one fails."""
    series = PositionSeries(scenes)
    with loaded(scenes) as simulation:
        simulation.run(observers=[series])
        results = sound(simulation.results())
    return [
        Followed(result, np.array([position for _, position in rows]))
        for result, rows in zip(results, series.rows, strict=True)
    ]
