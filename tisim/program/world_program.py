"""Steps world by world: a thread, or a team of threads, takes a world through many steps in one launch."""

import time

from tisim.backend.launcher import Launcher
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.program.phases import Item, Phase, Repeat
from tisim.program.program import Items, Program, StepRules
from tisim.program.tasks import TASK
from tisim.program.team import Teams, TeamTrials
from tisim.state.state import State
from tisim.state.status import NEVER, WorldStatus

GOES_ON, DONE, PARTED = 0, 1, 2
"""The answer after a turn of a world: continue with the next turn, go to the next world, or part."""

Piece = tuple[Items, tuple[int, ...]]
"""A piece is a sequence of consecutive items, with the places at which it runs."""


def in_pieces(lists: tuple[Items, ...]) -> tuple[tuple[Piece, ...], tuple[range, ...]]:
    """Split lists of items into pieces; return the pieces and the range of places of each list.

    An item that recurs is a piece with several places. The items between two such items form a piece.
    """
    every = [item for items in lists for item in items]
    pieces: dict[Items, list[int]] = {}
    spans, place = [], 0
    for items in lists:
        begin = place
        between: Items = ()
        for item in (*items, None):
            if item is not None and every.count(item) == 1:
                between += (item,)
                continue
            for piece in filter(None, (between, (item,) if item else ())):
                pieces.setdefault(piece, []).append(place)
                place += 1
            between = ()
        spans.append(range(begin, place))
    return tuple((items, tuple(places)) for items, places in pieces.items()), tuple(spans)


def in_shares(items: Items) -> tuple[tuple[tuple[Phase, ...], Item], ...]:
    """Return the items that a team shares, phases and repeats, each with the preceding single-item phases,
    which one member runs."""
    shares: tuple[tuple[tuple[Phase, ...], Item], ...] = ()
    single: tuple[Phase, ...] = ()
    for item in items:
        if isinstance(item, Phase) and item.extent == 1:
            single += (item,)
        else:
            shares += ((single, item),)
            single = ()
    return (*shares, (single[:-1], single[-1])) if single else shares


@ti.data_oriented
class WorldKernel(StepRules):
    """This kernel takes worlds through one of several lists of items, again and again.

    All lists are compiled into one kernel, in which a recurring item appears once: compiling a pair search
    takes seconds. Each world is taken by a team, whose members share the items of every phase. The last
    member to finish a phase evaluates every condition that depends on its results.
    """

    def __init__(self, s: State, lists: tuple[Items, ...], rest_every: int, teams: Teams) -> None:
        super().__init__(s, rest_every)
        self.teams = teams
        self.pieces, self.spans = in_pieces(lists)
        self.advance = Launcher(self._advance)

    @ti.kernel
    def _advance(self, steps: ti.i32, most: ti.i32, teams: ti.i32, begin: ti.i32, end: ti.i32) -> ti.i64:
        """Take worlds through turns, each from place ``begin`` to ``end``; return the number of turns of all
        worlds.

        The number is negative if no world goes on.

        steps : turns that every running world is allowed; 0 keeps the remaining ones.
        most : largest number of turns in this launch. teams : number of teams of about equal size.
        """
        taken, going = ti.cast(0, ti.i64), 0
        ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            if steps > 0:
                self._allow_world(w, steps)
                self.teams.turns[w] = steps
            taken += self.teams.turns[w]
        ti.loop_config(serialize=True)
        for number in range(self.teams.threads):
            self.teams.begin(number)
        ti.loop_config(parallelize=self.teams.threads)
        for k in range(self.teams.threads * TASK):
            if k % TASK == 0:
                self._take_worlds(self.teams.join(k // TASK, teams), most, begin, end)
        ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            taken -= self.teams.turns[w]
            going = ti.max(going, ti.cast(self._goes_on(w), ti.i32))
        return ti.select(going > 0, taken, -taken)

    @ti.func
    def _goes_on(self, w):
        return self.s.status[w] == WorldStatus.RUNNING and self.teams.turns[w] > 0 and not self._waits(w)

    @ti.func
    def _take_worlds(self, me, most, begin, end):
        going = me.members > 0
        while going:
            w = self.teams.next_world(me)
            going = w < self.s.worlds
            if going:
                going = self._take_world(w, me, most, begin, end)

    @ti.func
    def _take_world(self, w, me, most, begin, end):
        """Take a world through its turns; return whether the team stays together."""
        turn, answer = -1, GOES_ON
        while answer == GOES_ON:
            turn += 1
            came = self.teams.barrier(me)
            if self.teams.is_last(me, came):
                answer = self._end_turn(w, me, turn, most)
            answer = self.teams.broadcast(me, came, answer)
            if answer == GOES_ON:
                for place in range(begin, end):
                    for piece in ti.static(self.pieces):
                        if self._is_at(piece, place):
                            self._run(piece[0], w, me)
        return answer != PARTED

    @ti.func
    def _end_turn(self, w, me, turn, most):
        """Count a finished turn, and return how to go on."""
        turns = ti.static(self.teams.turns)
        self._stop_failed(w)
        if turn > 0:
            turns[w] = turns[w] - 1
        answer = ti.select(self._goes_on(w) and turn < most, GOES_ON, DONE)
        if turn > 0 and self.teams.parts(me):
            answer = PARTED
        return answer

    @ti.func
    def _is_at(self, piece: ti.template(), place):  # type: ignore[valid-type]
        here = False
        for each in ti.static(piece[1]):
            here = here or place == each
        return here

    @ti.func
    def _run(self, items: ti.template(), w, me):  # type: ignore[valid-type]
        for single, item in ti.static(in_shares(items)):
            if ti.static(isinstance(item, Repeat)):
                self._repeat(single, item, w, me)
            else:
                self._share(single, item, w, me)

    @ti.func
    def _repeat(self, single: ti.template(), repeat: ti.template(), w, me):  # type: ignore[valid-type]
        first, pending = True, 1
        while pending > 0:
            came = self.teams.barrier(me)
            if self.teams.is_last(me, came):
                if first:
                    self._run_alone(single, w)
                pending = ti.cast(self._is_running(w) and repeat.pending(w) > 0, ti.i32)
            pending, first = self.teams.broadcast(me, came, pending), False
            if pending > 0:
                self._run(repeat.items, w, me)

    @ti.func
    def _share(self, single: ti.template(), phase: ti.template(), w, me):  # type: ignore[valid-type]
        came, size = self.teams.barrier(me), 0
        if self.teams.is_last(me, came):
            self._run_alone(single, w)
            size = self._size(phase, w)
        begin, end = self.teams.share(me, self.teams.broadcast(me, came, size))
        for k in range(begin, end):
            phase.run(w, k)

    @ti.func
    def _run_alone(self, phases: ti.template(), w):  # type: ignore[valid-type]
        for phase in ti.static(phases):
            for k in range(self._size(phase, w)):
                phase.run(w, k)

    @ti.func
    def _is_running(self, w):
        """Return whether a world is running, after all items of the previous phase have finished."""
        self._stop_failed(w)
        return self.s.status[w] == WorldStatus.RUNNING

    @ti.func
    def _size(self, phase: ti.template(), w):  # type: ignore[valid-type]
        """Return the current number of items of a phase."""
        size = 0
        if self._is_running(w):
            if ti.static(phase.conditional):
                if phase.when(w) > 0:
                    size = phase.size(w)
            else:
                size = phase.size(w)
        return size


class WorldProgram(Program):
    """This program runs one of the lists of items of a kernel."""

    def __init__(self, kernel: WorldKernel, items: Items, places: range) -> None:
        self.kernel, self.items, self.places = kernel, items, places
        self.trials = TeamTrials(kernel.s.worlds)

    @in_taichi_thread
    def advance(self, steps: int) -> None:
        self.kernel.s.check()
        going = self._launch(steps, steps)
        while going:
            going = self._launch(0, steps)

    def _launch(self, allowed: int, steps: int) -> bool:
        """Take at most this many steps of each world, and return whether any world goes on."""
        teams, most = self.kernel.teams, steps
        number = teams.number
        if self.trials.alone:
            number, most = teams.threads, min(steps, self.trials.alone)
        began = time.perf_counter()
        taken = self.kernel.advance(allowed, most, number, self.places.start, self.places.stop)
        self.trials.learn(abs(taken), most, time.perf_counter() - began, parted=taken > 0)
        return bool(taken > 0)

    @in_taichi_thread
    def compile(self) -> None:
        self.kernel.advance(0, 0, self.kernel.teams.threads, self.places.start, self.places.stop)


def world_programs(
    s: State, lists: tuple[Items, ...], teams: Teams, rest_every: int = NEVER
) -> list[WorldProgram]:
    """Return a program for each list of items, all with one kernel."""
    kernel = WorldKernel(s, lists, rest_every, teams)
    return [WorldProgram(kernel, items, places) for items, places in zip(lists, kernel.spans, strict=True)]
