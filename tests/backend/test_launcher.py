"""A launcher runs its own kernel, and costs little."""

import time

import pytest

from tisim.backend import runtime
from tisim.backend.launcher import Launcher
from tisim.backend.taichi import BACKEND, ti
from tisim.backend.thread import in_taichi_thread


@ti.data_oriented
class Counter:
    def __init__(self):
        self.count = ti.field(ti.i32, ())

    @ti.kernel
    def up(self):
        self.count[None] += 1

    @ti.kernel
    def up_and_read(self) -> ti.i32:
        self.count[None] += 1
        return self.count[None]

    @ti.kernel
    def add(self, number: ti.i32, factor: ti.i32) -> ti.i64:
        self.count[None] += number * factor
        return ti.cast(self.count[None], ti.i64) << 33


@in_taichi_thread
def counter():
    runtime.current()
    return Counter()


def test_each_call_runs_the_kernel_of_its_own_object():
    @in_taichi_thread
    def run(one, other):
        up, read, other_read = Launcher(one.up), Launcher(one.up_and_read), Launcher(other.up_and_read)
        # The two alternate: the first call of each compiles.
        return [(up(), read(), other_read()) for _ in range(3)]

    assert run(counter(), counter()) == [(None, 2, 1), (None, 4, 2), (None, 6, 3)]


def test_each_call_uses_its_own_arguments():
    @in_taichi_thread
    def run(one):
        add = Launcher(one.add)
        return [add(number, factor) for number, factor in ((1, 2), (3, -4), (0, 7))]

    assert run(counter()) == [2 << 33, -10 << 33, -10 << 33]


@pytest.mark.skipif(BACKEND != "taichi", reason="Quadrants looks up the kernel itself")
def test_a_launch_costs_less_than_the_call_of_the_kernel():
    @in_taichi_thread
    def times(one):
        launch, call, seconds = Launcher(one.up_and_read), one.up_and_read, []
        for function in (launch, call):
            function()
            begin = time.thread_time()
            for _ in range(300):
                function()
            seconds.append(time.thread_time() - begin)
        return seconds

    # Measured 0.06 to 0.1.
    launched, called = times(counter())
    assert launched < 0.5 * called
