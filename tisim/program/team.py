"""Teams of threads: who is in them, which world they take next, how they wait for each other, and when
each thread takes a world alone, as other programs want the cores too.

Taichi 1.7.4 and Quadrants 1.3.3 cut a parallel loop into a block for each CPU thread that they were started
with, of 512 iterations at least, and hand blocks out in order: each is done by one thread, to its end, before
that thread gets another. So a loop of 512 iterations for each thread has one place for each. Other programs
may want the cores, though: a place may be taken late, when all others are done, so nobody waits for whom he
has not met.

What a member has written others may read once they have met. It counts itself in by an atomic operation, the
last one says so by another, and they look by a third: all of these are sequentially consistent in both
packages (``atomicrmw ... seq_cst`` in what they give to LLVM), on any kind of CPU.
"""

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import BACKEND, ti

LOOKS_WHEN_LATE = 40_000 if BACKEND == "taichi" else 300_000
"""Who has looked so often for the others waits for one that has no core: it takes about 1.5 ms."""
DOUBLED_AT = 40_000
"""In a world with the work of so many particles it is twice as often, as there may be as much to wait for."""
MOST_LOOKS = 2**30
"""Looks are counted in 32 bits."""
TIMES_LATE = 8
"""A team that has waited so often for one without a core parts after the step."""
LINE = 16
"""A number of 8 bytes for each team is so many numbers away from the next one's, in cache lines of its own:
CPUs fetch two of 64 bytes."""
OVER = 2**30
"""The roll of a team is longer than that once nobody can join any more."""

Member = ti.types.struct(team=ti.i32, seat=ti.i32, members=ti.i32)
"""A member knows its team, its own number in it, from 0, and how many there are; there are none where it has
come too late."""


@ti.data_oriented
class Teams:
    """Teams of the CPU threads of a launch take one world after the other.

    work : of a world in a step, in particles that feel those near them alone. threads : so many there are.
    number : of teams, where threads are not alone. turns : of each world, that it may still take.
    """

    def __init__(self, worlds: int, work: int, threads: int, number: int) -> None:
        self.worlds, self.threads, self.number = worlds, threads, number
        self.shared = number < threads
        self.late = min(LOOKS_WHEN_LATE + LOOKS_WHEN_LATE * work // DOUBLED_AT, MOST_LOOKS)
        self.roll, self.arrived, self.said, self.waits, self.drawn = (ti.field(ti.i64) for _ in range(5))
        self.turns = ti.field(ti.i32)
        builder = Builder()
        for column in (self.roll, self.arrived, self.said, self.waits, self.drawn):
            builder.dense(ti.i, threads * LINE).place(column)
        builder.dense(ti.i, worlds).place(self.turns)
        self.tree = Tree(builder)

    @ti.func
    def begin(self, number):
        """Begin team ``number`` anew, before the loop in which its members come."""
        at = number * LINE
        self.roll[at], self.arrived[at], self.said[at], self.waits[at] = 0, 0, 0, 0
        self.drawn[0] = 0

    @ti.func
    def join(self, place, teams):
        """Return who takes this one of all places, dealt to the teams in turns."""
        team = place % teams
        seat, members = 0, 1
        if ti.static(self.shared):
            seat, members = self._enrol(team * LINE, (self.threads - team + teams - 1) // teams)
        return Member(team=team, seat=seat, members=members)

    @ti.func
    def _enrol(self, at, places):
        """Return a seat, and how many members there are: all that have places, or those who have come before
        one of them has waited for long. Exactly one of them ends the roll, and says how long it is."""
        seat, members, looks = ti.atomic_add(self.roll[at], 1), ti.cast(0, ti.i64), 0
        while seat < OVER and members == 0:
            if seat + 1 == places or looks > self.late:
                length = ti.atomic_or(self.roll[at], OVER)
                if length < OVER:
                    ti.atomic_max(self.said[at], length)
            members = self._look(at)
            looks += 1
        return ti.cast(ti.min(seat, OVER), ti.i32), ti.cast(members, ti.i32)

    @ti.func
    def draw(self, me):
        """Return the next world of this member's team; ``worlds`` where there is none left."""
        came, w = self.come(me), 0
        if self.is_last(me, came):
            w = ti.cast(ti.atomic_add(self.drawn[0], 1), ti.i32)
        return ti.min(self.agree(me, came, w), self.worlds)

    @ti.func
    def come(self, me):
        """Come to a meeting, and return a ticket to it."""
        ticket = ti.cast(0, ti.i64)
        if ti.static(self.shared):
            ticket = ti.atomic_add(self.arrived[me.team * LINE], 1)
        return ticket

    @ti.func
    def is_last(self, me, ticket):
        """Return whether all others wait already: what they have done can be read, and they change nothing
        before this member agrees with them."""
        last = True
        if ti.static(self.shared):
            last = ti.cast(ticket, ti.i32) == me.members - 1
        return last

    @ti.func
    def agree(self, me, ticket, value):
        """Return what the last one who came to the meeting says, a whole number from 0 on; wait for it."""
        if ti.static(self.shared):
            # The number of the meeting stands in the upper half of a word, that of members or what is said
            # in the lower one.
            at, meeting = me.team * LINE, (ticket >> 32) + 1
            if self.is_last(me, ticket):
                self.arrived[at] = meeting << 32
                ti.atomic_max(self.said[at], meeting << 32 | value)
            else:
                said, looks = ti.cast(0, ti.i64), 0
                while said >> 32 < meeting:
                    said = self._look(at)
                    looks += 1
                value = ti.cast(said, ti.i32)
                if looks > self.late and ti.cast(ticket, ti.i32) == 0:
                    ti.atomic_add(self.waits[at], 1)
        return value

    @ti.func
    def share(self, me, size):
        """Return where this member's share of so many items begins and ends."""
        begin, end = 0, size
        if ti.static(self.shared):
            each = (size + me.members - 1) // me.members
            begin, end = me.seat * each, ti.min((me.seat + 1) * each, size)
        return begin, end

    @ti.func
    def _look(self, at):
        # A plain load would be taken out of the loop; of this, LLVM makes a fence and a load.
        return ti.atomic_add(self.said[at], 0)

    @ti.func
    def parts(self, me):
        """Return whether the team is to part, as the last one may ask."""
        parts = False
        if ti.static(self.shared):
            parts = self.waits[me.team * LINE] >= TIMES_LATE
        return parts


FIRST_ALONE = 4
"""So many steps by threads alone tell how long they take."""
TRIAL_COST = 0.1
"""Trying teams again is to cost at most this part of the time."""


class TeamTrials:
    """Teams that have parted, as somebody had no core too often, and were slower for it than threads alone,
    are tried again after some time.

    alone : threads take so many steps more of each world alone; 0 where they are in teams. pace : the time of
    a step of one world, then (s).
    """

    def __init__(self, worlds: int) -> None:
        self.worlds, self.alone, self.pace = worlds, 0, 0.0

    def learn(self, taken: int, most: int, seconds: float, parted: bool) -> None:
        """Hear how long a launch took, of at most so many steps of each world, and how many all of them have
        taken; ``parted``: whether they had more to take."""
        if self.alone:
            self.alone -= min(most, self.alone)
            if taken:
                self.pace = seconds / taken
        elif parted and seconds > taken * self.pace:
            of_all = int(seconds / TRIAL_COST / self.pace) if self.pace else 0
            self.alone = max(FIRST_ALONE, of_all // self.worlds)
