"""Teams of threads that share a world: membership, the next world, barriers, and the fallback to single
threads.

Threads take worlds alone while other programs also use the cores.

Taichi 1.7.4 and Quadrants 1.3.3 cut a parallel loop into one block for each CPU thread, of at least 512
iterations, and hand out the blocks in order. One thread runs a block to its end before it gets another. A
loop of 512 iterations for each thread therefore has one block for each thread. If other programs use the
cores, however, a block may start only when all others are done, so a thread must never wait for one that has
not joined.

After a barrier each member can read the values written by the others. Members count themselves in by an
atomic operation, the last one publishes a value by another, and the others poll by a third. All of these are
sequentially consistent in both packages (``atomicrmw ... seq_cst`` in their LLVM code), on any kind of CPU.
"""

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import BACKEND, ti

LOOKS_WHEN_LATE = 40_000 if BACKEND == "taichi" else 300_000
"""Number of polls after which a member assumes that another one has no core; about 1.5 ms."""
DOUBLED_AT = 40_000
"""The number of polls is doubled in a world with the work of this many particles, as waits are longer
there."""
MOST_LOOKS = 2**30
"""Limit of the 32-bit poll counter."""
TIMES_LATE = 8
"""A team that has waited this often for a member without a core parts after the step."""
LINE = 16
"""Numbers of 8 bytes between the counters of two teams, so that each is in cache lines of its own: CPUs fetch
two lines of 64 bytes."""
ROLL_CLOSED = 2**30
"""The roll of a team exceeds this value once nobody can join any more."""

Member = ti.types.struct(team=ti.i32, seat=ti.i32, members=ti.i32)
"""A member has its team, its seat in it, from 0, and the number of members; 0 members if it came too late."""


@ti.data_oriented
class Teams:
    """Teams of the CPU threads of a launch; each team takes one world after the other.

    work : work of a world in a step, in particles with short-ranged forces only. threads : number of threads.
    number : number of teams, if threads do not work alone. turns : turns that each world may still take.
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
        """Reset team ``number``, before the loop in which its members join."""
        at = number * LINE
        self.roll[at], self.arrived[at], self.said[at], self.waits[at] = 0, 0, 0, 0
        self.drawn[0] = 0

    @ti.func
    def join(self, place, teams):
        """Return the member for a block of the loop; blocks are dealt to the teams in turn."""
        team = place % teams
        seat, members = 0, 1
        if ti.static(self.shared):
            seat, members = self._enrol(team * LINE, (self.threads - team + teams - 1) // teams)
        return Member(team=team, seat=seat, members=members)

    @ti.func
    def _enrol(self, at, places):
        """Return a seat and the number of members: all expected threads, or those that joined before one
        waited too long.

        Exactly one member closes the roll and publishes its length.
        """
        seat, members, looks = ti.atomic_add(self.roll[at], 1), ti.cast(0, ti.i64), 0
        while seat < ROLL_CLOSED and members == 0:
            if seat + 1 == places or looks > self.late:
                length = ti.atomic_or(self.roll[at], ROLL_CLOSED)
                if length < ROLL_CLOSED:
                    ti.atomic_max(self.said[at], length)
            members = self._look(at)
            looks += 1
        return ti.cast(ti.min(seat, ROLL_CLOSED), ti.i32), ti.cast(members, ti.i32)

    @ti.func
    def next_world(self, me):
        """Return the next world of the team of this member; ``worlds`` if none is left."""
        came, w = self.barrier(me), 0
        if self.is_last(me, came):
            w = ti.cast(ti.atomic_add(self.drawn[0], 1), ti.i32)
        return ti.min(self.broadcast(me, came, w), self.worlds)

    @ti.func
    def barrier(self, me):
        """Arrive at a barrier, and return a ticket for it."""
        ticket = ti.cast(0, ti.i64)
        if ti.static(self.shared):
            ticket = ti.atomic_add(self.arrived[me.team * LINE], 1)
        return ticket

    @ti.func
    def is_last(self, me, ticket):
        """Return whether this member is the last to arrive. It can then read all results of the others, and
        they change nothing until it broadcasts."""
        last = True
        if ti.static(self.shared):
            last = ti.cast(ticket, ti.i32) == me.members - 1
        return last

    @ti.func
    def broadcast(self, me, ticket, value):
        """Wait for the barrier and return the value broadcast by the last member, an integer from 0 on."""
        if ti.static(self.shared):
            # The upper half of the word has the number of the barrier; the lower half has the number of
            # members or the value.
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
        """Return the beginning and the end of this member's share of the items."""
        begin, end = 0, size
        if ti.static(self.shared):
            each = (size + me.members - 1) // me.members
            begin, end = me.seat * each, ti.min((me.seat + 1) * each, size)
        return begin, end

    @ti.func
    def _look(self, at):
        # The compiler would move a plain load out of the loop; LLVM turns this into a fence and a load.
        return ti.atomic_add(self.said[at], 0)

    @ti.func
    def parts(self, me):
        """Return whether the team is to part; only the last member may call this."""
        parts = False
        if ti.static(self.shared):
            parts = self.waits[me.team * LINE] >= TIMES_LATE
        return parts


FIRST_ALONE = 4
"""Number of single-thread steps that are timed."""
TRIAL_COST = 0.1
"""Largest fraction of the time that repeated trials of teams may cost."""


class TeamTrials:
    """Team trials decide when teams are tried again after they have parted.

    Teams part if a member too often has no core and if they are slower than single threads.

    alone : further steps of each world by single threads; 0 while teams are used.
    pace : time of a step of one world by a single thread (s).
    """

    def __init__(self, worlds: int) -> None:
        self.worlds, self.alone, self.pace = worlds, 0, 0.0

    def learn(self, taken: int, most: int, seconds: float, parted: bool) -> None:
        """Record the time of a launch.

        taken : steps taken by all worlds together. most : largest number of steps of each world. parted :
        whether worlds had further steps to take.
        """
        if self.alone:
            self.alone -= min(most, self.alone)
            if taken:
                self.pace = seconds / taken
        elif parted and seconds > taken * self.pace:
            of_all = int(seconds / TRIAL_COST / self.pace) if self.pace else 0
            self.alone = max(FIRST_ALONE, of_all // self.worlds)
