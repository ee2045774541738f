"""Steps launched unasked, as on a GPU, are those of worlds that are asked after each launch."""

import numpy as np
import pytest

from tisim.backend.memory import collected
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.worlds.fields import CORE
from tisim.worlds.launched_program import LaunchedProgram
from tisim.worlds.phases import Phase, Repeat
from tisim.worlds.state import State
from tisim.worlds.status import NEVER, WorldStatus
from tisim.worlds.world_program import in_pieces, world_programs

WORLDS, STEPS = 5, 60


class Mark(Phase):
    """This phase leaves a trace of its number, and changes what repeats wait for."""

    def __init__(self, s, number):
        self.s, self.number = s, number

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.trace[w] = 0.75 * s.trace[w] + self.number + s.inner[w]
        if ti.static(self.number == 1):
            s.steps[w] += 1
            # A turn in some steps only, in each world by itself, and then up to three of the inner repeat.
            s.outer[w] = ti.cast((s.steps[w] + w) % 5 // 3, ti.i32)
        elif ti.static(self.number == 2):
            s.inner[w] = (s.outer[w] + w + ti.cast(s.steps[w], ti.i32)) % 4
        elif ti.static(self.number == 3):
            s.inner[w] -= 1
        elif ti.static(self.number == 4):
            s.outer[w] -= 1
        elif s.steps[w] == 40 and w == 3:
            s.failed[w] = WorldStatus.NOT_FINITE
        elif s.steps[w] == 50 and w == 4:
            s.status[w] = WorldStatus.ENDED


class While(Repeat):
    """This repeat goes on while a flag is up."""

    def __init__(self, flag, *items, usual):
        super().__init__(items)
        self.flag, self.usual = flag, usual

    @ti.func
    def pending(self, w):
        return self.flag[w]


@pytest.fixture(scope="module")
def made():
    """A state, and a step with a repeat within a repeat that is not in every step."""

    @in_taichi_thread
    def make():
        s = State(WORLDS, 1, CORE, (), ("trace",), ("outer", "inner"))
        one, two, three, four, five, six = (Mark(s, k) for k in range(1, 7))
        inner = While(s.inner, three, usual=1)
        return s, (one, six, While(s.outer, two, inner, four, usual=0), six, five)

    with collected() as trees:
        yield make()
    for tree in trees:
        tree.destroy()


def ends(made, schedule, asks=False):
    """What becomes of the worlds, and how many launches and looks it takes."""
    s, items = made
    s.fill({**dict.fromkeys(s.columns, 0), "pause_time": np.inf, "goal": NEVER})
    looks = []
    if schedule == "world":
        # The list beside it shares items with the step, and is not taken.
        _, program = world_programs(s, (items[1:3], items))
    else:
        program = LaunchedProgram(s, items)
        program.asks, learn = asks, program._learn
        program._learn = lambda found: looks.append(found) or learn(found)
    program.advance(STEPS // 2)
    program.advance(STEPS - STEPS // 2)
    return s.snapshot(("trace", "steps", "status", "outer", "inner")), looks


def test_what_recurs_in_steps_is_a_piece_of_its_own():
    a, b, c, d = (Phase() for _ in range(4))
    pieces, spans = in_pieces(((a, b, c, a), (d, d, b), ()))
    assert pieces == (((a,), (0, 3)), ((b,), (1, 6)), ((c,), (2,)), ((d,), (4, 5)))
    assert spans == (range(4), range(4, 7), range(7, 7))
    assert in_pieces(((a, b, c), (d,))) == ((((a, b, c), (0,)), ((d,), (1,))), (range(1), range(1, 2)))


def test_all_schedules_and_ways_to_ask_take_the_same_steps_and_devices_are_asked_seldom(made):
    expected, _ = ends(made, "world")
    np.testing.assert_array_equal(expected["steps"], [60, 60, 60, 40, 50])
    assert len(set(expected["trace"])) == WORLDS
    for asks in (True, False):
        found, looks = ends(made, "particle", asks)
        for name, values in expected.items():
            np.testing.assert_array_equal(found[name], values, err_msg=f"{name}, asks: {asks}")
        # A world waits in every other step, which asks for more looks than lists of pairs do.
        assert len(looks) < STEPS if not asks else not looks
