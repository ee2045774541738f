"""Counts of the kernels that steps launch."""

from collections import Counter

import pytest

from tisim.backend.launcher import Launcher
from tisim.backend.taichi import ti
from tisim.program.launched_program import Visit
from tisim.state.state import State


def assert_launches(simulation, steps, each):
    """Assert that a step of all worlds takes ``each`` launches, besides launches for list rebuilds in fewer
    than half of the steps, and that no field is read.

    A CPU returns the progress of worlds after each launch. A device is asked at the beginning, and then only
    once for several steps; the number of steps grows while no list is due. Few launches find no world to work
    on.
    """
    program = simulation.program
    launched, others, copies = Counter(), Counter(), []
    launch, call = Launcher.__call__, ti.lang.kernel_impl.Kernel.__call__

    def count_launch(launcher, *arguments):
        launched[launcher] += 1
        before = others.copy()
        result = launch(launcher, *arguments)
        # Quadrants calls the kernel for it.
        others.clear()
        others.update(before)
        return result

    def count_call(kernel, *arguments, **options):
        others[kernel.func.__name__] += 1
        return call(kernel, *arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Launcher, "__call__", count_launch)
        patch.setattr(ti.lang.kernel_impl.Kernel, "__call__", count_call)
        patch.setattr(State, "snapshot", lambda *_: copies.append(1))
        program.advance(steps)
    visits = [item.launch for item in program.plan if isinstance(item, Visit)]
    assert len(visits) == each
    (rounds,) = {launched.pop(one.run_and_look if program.asks else one.run) for one in visits}
    assert launched.pop(program.allow) == 1
    if program.asks:
        assert rounds == steps
    else:
        assert steps <= rounds < 2 * steps
        assert launched.pop(program.look) < 0.7 * steps
    # Launches of list rebuilds.
    assert 0 < sum(launched.values()) < steps / 2
    assert not others
    assert not copies
