"""The kernels that steps launch, counted."""

from collections import Counter

import pytest

from tisim.backend.taichi import ti
from tisim.worlds.launches import Visit
from tisim.worlds.state import State


def assert_launches(simulation, steps, each):
    """A step of all worlds is ``each`` launches, and those of lists that are due; few find nobody whose turn
    it is.

    How far worlds have come is asked when they begin, and then of several steps at once, the more the longer
    no list is due; no field is read. Lists are due in fewer than half of the steps.
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
    rebuilds = kernels["run"] - each * rounds
    assert 0 < rebuilds < steps / 2
    assert steps <= rounds < 2 * steps
    assert kernels.keys() == {"_allow", "_look", "run"}
    assert kernels["_allow"] == 1
    assert kernels["_look"] < 0.7 * steps
    assert not copies
