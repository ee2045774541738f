"""The kernels that steps launch, counted."""

from collections import Counter

import pytest

from tisim.backend.taichi import ti
from tisim.worlds.launches import Visit
from tisim.worlds.state import State


def assert_launches(simulation, steps, each):
    """A step of all worlds is ``each`` launches, and those of lists that are due, in fewer than half of the
    steps; no field is read.

    A CPU tells after each launch how far worlds have come. A device is asked when they begin, and then of
    several steps at once, the more the longer no list is due; few launches find nobody whose turn it is.
    """
    program = simulation.program
    kernels, launched, copies = Counter(), Counter(), []
    launch = ti.lang.kernel_impl.Kernel.__call__

    def counted(kernel, *args, **options):
        kernels[kernel.func.__name__] += 1
        launched[args[0]] += 1
        return launch(kernel, *args, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ti.lang.kernel_impl.Kernel, "__call__", counted)
        patch.setattr(State, "snapshot", lambda *_: copies.append(1))
        program.advance(steps)
    direct = [item.launch for item in program.plan if isinstance(item, Visit)]
    assert len(direct) == each
    (rounds,) = {launched[item] for item in direct}
    run = "run_and_look" if program.asks else "run"
    rebuilds = kernels[run] - each * rounds
    assert 0 < rebuilds < steps / 2
    assert kernels["_allow"] == 1
    if program.asks:
        assert kernels.keys() == {"_allow", run}
        assert rounds == steps
    else:
        assert kernels.keys() == {"_allow", "_look", run}
        assert steps <= rounds < 2 * steps
        assert kernels["_look"] < 0.7 * steps
    assert not copies
