"""Steps launched without asking for progress, as on a GPU, and steps by teams of threads are equal to steps
of worlds that are asked after each launch."""

import numpy as np
import pytest

from tests.compare import same_arrays
from tests.conftest import elsewhere_with
from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree, collected
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.program import team
from tisim.program.launched_program import LaunchedProgram
from tisim.program.phases import Phase, Repeat
from tisim.program.tasks import tasks_of
from tisim.program.team import FIRST_ALONE, TRIAL_COST, Teams, TeamTrials
from tisim.program.world_program import in_pieces, in_shares, world_programs
from tisim.state.fields import CORE, CORE_OF_WORLDS, WorldField
from tisim.state.state import State
from tisim.state.status import NEVER, WorldStatus

WORLDS, STEPS, ITEMS = 5, 60, 1000


class Mark(Phase):
    """A phase that leaves a trace of its number, and changes the flags of repeats."""

    def __init__(self, s, number):
        self.s, self.number = s, number

    @ti.func
    def run(self, w, _k):
        s = self.s
        s.trace[w] = 0.75 * s.trace[w] + self.number + s.inner[w]
        if ti.static(self.number == 1):
            s.steps[w] += 1
            # The outer repeat runs in some steps only, independently in each world; the inner one up to three
            # times in it.
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


class Mix(Phase):
    """Every item reads a value that another member of a team wrote in the phase before."""

    def __init__(self, s, source, target):
        self.s, self.source, self.target, self.extent = s, source, target, ITEMS

    @ti.func
    def size(self, w):
        return ITEMS - ti.cast(self.s.steps[w], ti.i32) % 7

    @ti.func
    def run(self, w, k):
        other = self.source[w, (k + ITEMS // 2) % ITEMS]
        self.target[w, k] = 1103515245 * other + k + self.s.inner[w]


class While(Repeat):
    """A repeat that continues while a flag is positive."""

    def __init__(self, flag, *items, usual):
        super().__init__(items)
        self.flag, self.usual = flag, usual

    @ti.func
    def pending(self, w):
        return self.flag[w]


@in_taichi_thread
def make():
    """A state with two columns of items, and a step with nested repeats, which do not run in every step."""
    own = (WorldField("trace", "real"), WorldField("outer", "integer"), WorldField("inner", "integer"))
    s = State(WORLDS, 1, CORE, (*CORE_OF_WORLDS, *own))
    columns, builder = (ti.field(ti.i32), ti.field(ti.i32)), Builder()
    builder.dense(ti.ij, (WORLDS, ITEMS)).place(*columns)
    s.mixed, s.mixed_tree = columns, Tree(builder)
    one, two, three, four, five, six = (Mark(s, k) for k in range(1, 7))
    there, back = Mix(s, *columns), Mix(s, *columns[::-1])
    inner = While(s.inner, there, three, usual=1)
    return s, (one, there, six, While(s.outer, two, back, inner, four, usual=0), six, five, back)


@pytest.fixture(scope="module")
def made():
    """The result of ``make``."""
    with collected() as trees:
        yield make()
    for tree in trees:
        tree.destroy()


def ends(made, schedule, asks=False, threads=1, number=1, steps=STEPS):
    """The final states of the worlds, and the launches or queries for progress."""
    s, items = made
    s.fill({**dict.fromkeys(s.columns, 0), "pause_time": np.inf, "goal": NEVER})
    in_taichi_thread(lambda: [column.fill(0) for column in s.mixed])()
    looks = []
    if schedule == "particle":
        program = LaunchedProgram(s, items)
        program.asks, learn = asks, program._learn
        program._learn = lambda found: looks.append(found) or learn(found)
    else:
        # The first list shares items with the step, and is not run.
        _, program = world_programs(s, (items[2:4], items), Teams(WORLDS, ITEMS, threads, number))
        launch = program._launch
        program._launch = lambda *a: looks.append(a) or launch(*a)
    program.advance(steps // 2)
    program.advance(steps - steps // 2)
    mixed = in_taichi_thread(lambda: [column.to_numpy() for column in s.mixed])()
    return {**s.snapshot(("trace", "steps", "status", "outer", "inner")), "mixed": np.array(mixed)}, looks


def test_phases_common_to_steps_form_their_own_pieces():
    a, b, c, d = (Phase() for _ in range(4))
    pieces, spans = in_pieces(((a, b, c, a), (d, d, b), ()))
    assert pieces == (((a,), (0, 3)), ((b,), (1, 6)), ((c,), (2,)), ((d,), (4, 5)))
    assert spans == (range(4), range(4, 7), range(7, 7))
    assert in_pieces(((a, b, c), (d,))) == ((((a, b, c), (0,)), ((d,), (1,))), (range(1), range(1, 2)))


def test_all_schedules_take_the_same_steps(made):
    expected, _ = ends(made, "world")
    np.testing.assert_array_equal(expected["steps"], [60, 60, 60, 40, 50])
    assert len(set(expected["trace"])) == WORLDS
    for asks in (True, False):
        found, looks = ends(made, "particle", asks)
        same_arrays(found, expected, f"asks: {asks}")
        # A world waits in every other step, which takes more queries than pair lists do.
        assert len(looks) < STEPS if not asks else not looks


IN_TIME, IN_STEPS, NEVER_WAITED_FOR = 10**9, 1000, -1
TEAMS = (
    *((2, 1, IN_TIME, STEPS), (3, 1, IN_TIME, 6), (8, 1, IN_TIME, 6)),
    *((8, 3, IN_STEPS, STEPS), (8, 1, NEVER_WAITED_FOR, STEPS)),
)
"""Number of threads (Taichi has eight), number of teams, polls before the other threads count as late, and
steps. With fewer cores, threads wait long for each other."""


def of_eight_threads():
    """Differences between the steps of these teams and of single threads."""
    made, wrong = make(), []
    expected = {steps: ends(made, "world", steps=steps)[0] for steps in (6, STEPS)}
    for threads, number, late, steps in TEAMS:
        team.LOOKS_WHEN_LATE = late
        try:
            same_arrays(ends(made, "team", False, threads, number, steps)[0], expected[steps], "")
        except AssertionError as difference:
            wrong.append(f"{threads} threads in {number} teams, {late}: {difference}")
    return wrong


@pytest.mark.slow
@pytest.mark.skipif(runtime.cores() < 2, reason="threads that wait for each other awake have a core each")
def test_teams_take_the_same_steps_late_or_not():
    assert elsewhere_with("threads=8")("engine.test_launches", "of_eight_threads") == []


def test_a_parted_team_is_tried_again(made, monkeypatch):
    """Here it parts after each step; single threads then run some steps before the next trial."""
    expected, _ = ends(made, "world", threads=2, number=2)
    monkeypatch.setattr(team, "TIMES_LATE", 0)
    found, launches = ends(made, "team", False, 2, 1)
    same_arrays(found, expected, "parting")
    assert len(launches) > STEPS * WORLDS / 50
    # A thread that no other waits for does not belong to the team.
    monkeypatch.setattr(team, "LOOKS_WHEN_LATE", -1)
    found, _ = ends(made, "team", False, 64, 1)
    same_arrays(found, expected, "without each other")


def test_phases_with_one_item_are_not_shared():
    one, two, three = (Phase() for _ in range(3))
    many = Phase()
    many.extent = 2
    repeat = Repeat((many,))
    assert in_shares((one, two, many, repeat, three)) == (((one, two), many), ((), repeat), ((), three))
    assert in_shares((one, two)) == (((one,), two),)


def test_teams_are_tried_again_at_little_cost():
    trials = TeamTrials(worlds=2)
    trials.learn(100, 100, 1.0, parted=False)
    assert not trials.alone
    # The time of steps by single threads is not known yet.
    trials.learn(100, 100, 1.0, parted=True)
    assert trials.alone == FIRST_ALONE
    trials.learn(FIRST_ALONE, FIRST_ALONE, 2e-3 * FIRST_ALONE, parted=True)
    assert not trials.alone
    # First the team is faster even so, then slower.
    trials.learn(100, 1000, 0.19, parted=True)
    assert not trials.alone
    trials.learn(100, 1000, 0.21, parted=True)
    assert trials.alone == pytest.approx(0.21 / TRIAL_COST / 2e-3 / 2, abs=1)


@pytest.mark.parametrize(
    ("extent", "kind", "worlds", "threads", "tasks"),
    [
        (2000, "light", 1, 2, 2),
        (2000, "long", 1, 2, 8),
        (2000, "heavy", 1, 2, 8),
        (500, "light", 1, 2, 1),
        (100, "long", 8, 2, 2),
        (100, "heavy", 390, 2, 2),
        (100, "long", 390, 16, 16),
        (3, "long", 1, 2, 2),
        (2000, "light", 1, 16, 3),
    ],
)
def test_tasks_of_a_phase_are_balanced(extent, kind, worlds, threads, tasks):
    """2000 particles are not divided into three tasks for two threads, one of which would idle; a single
    world with a large capacity is shared, too."""
    phase = Phase()
    phase.extent, phase.long, phase.light = extent, kind == "long", kind != "heavy"
    assert tasks_of(phase, worlds, threads) == tasks
