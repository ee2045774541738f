"""Steps world by world: a thread takes a world through many of them in one launch."""

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.worlds.launches import TASK
from tisim.worlds.phases import Repeat
from tisim.worlds.program import Program, StepRules
from tisim.worlds.routes import Items
from tisim.worlds.state import State
from tisim.worlds.status import NEVER, WorldStatus

Piece = tuple[Items, tuple[int, ...]]
"""A piece is items that follow each other, and the places at which they are taken."""


def in_pieces(lists: tuple[Items, ...]) -> tuple[tuple[Piece, ...], tuple[range, ...]]:
    """Return lists of items in pieces, and the places that each list takes.

    An item that recurs is a piece, taken at several places; so is all that lies between two of those.
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


@ti.data_oriented
class WorldKernel(StepRules):
    """This kernel takes worlds through one of several lists of items, again and again.

    One kernel is made of all lists, in which an item that recurs stands once: a search for pairs takes
    seconds to compile.
    """

    def __init__(self, s: State, lists: tuple[Items, ...], rest_every: int = NEVER) -> None:
        super().__init__(s, rest_every)
        self.pieces, self.spans = in_pieces(lists)

    @ti.kernel
    def advance(self, steps: ti.i32, begin: ti.i32, end: ti.i32):
        """Take at most ``steps`` steps of every running world, each from place ``begin`` to ``end``."""
        for k in range(self.s.worlds * TASK):
            if k % TASK == 0:
                w = k // TASK
                self._allow_world(w, steps)
                step = 0
                while self.s.status[w] == WorldStatus.RUNNING and step < steps and not self._waits(w):
                    for place in range(begin, end):
                        for piece in ti.static(self.pieces):
                            if self._is_at(piece, place):
                                self._run(piece[0], w)
                    step += 1

    @ti.func
    def _is_at(self, piece: ti.template(), place):  # type: ignore[valid-type]
        here = False
        for each in ti.static(piece[1]):
            here = here or place == each
        return here

    @ti.func
    def _run(self, items: ti.template(), w):  # type: ignore[valid-type]
        for item in ti.static(items):
            if self.s.status[w] == WorldStatus.RUNNING:
                if ti.static(isinstance(item, Repeat)):
                    while self.s.status[w] == WorldStatus.RUNNING and item.pending(w) > 0:
                        self._run(item.items, w)
                else:
                    self._loop(item, w)
                    self._stop_failed(w)

    @ti.func
    def _loop(self, phase: ti.template(), w):  # type: ignore[valid-type]
        if ti.static(phase.conditional):
            if phase.when(w) > 0:
                for k in range(phase.size(w)):
                    phase.run(w, k)
        else:
            for k in range(phase.size(w)):
                phase.run(w, k)


class WorldProgram(Program):
    """This program is one of the lists of items of a kernel."""

    def __init__(self, kernel: WorldKernel, items: Items, places: range) -> None:
        self.kernel, self.items, self.places = kernel, items, places

    @in_taichi_thread
    def advance(self, steps: int) -> None:
        self.kernel.s.check()
        self.kernel.advance(steps, self.places.start, self.places.stop)

    @in_taichi_thread
    def compile(self) -> None:
        self.kernel.advance(0, self.places.start, self.places.stop)


def world_programs(s: State, lists: tuple[Items, ...], rest_every: int = NEVER) -> list[WorldProgram]:
    """Return a program for each list of items, of one kernel."""
    kernel = WorldKernel(s, lists, rest_every)
    return [WorldProgram(kernel, items, places) for items, places in zip(lists, kernel.spans, strict=True)]
