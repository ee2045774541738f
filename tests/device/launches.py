"""The kernels that steps launch, counted."""

from collections import Counter

import pytest

from tisim.backend.taichi import ti
from tisim.worlds.launches import Launch
from tisim.worlds.state import State


def assert_launches(simulation, steps, each):
    """A step of all worlds is ``each`` launches, which tell who goes on, and those of lists that are due.

    Nothing else is launched, and no field is read, between two looks. Lists are due in fewer than half of the
    steps.
    """
    kernels, launched, copies = Counter(), Counter(), []
    launch = ti.lang.kernel_impl.Kernel.__call__

    def counted(kernel, *args, **options):
        kernels[kernel.func.__name__] += 1
        launched[args[0]] += 1
        return launch(kernel, *args, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ti.lang.kernel_impl.Kernel, "__call__", counted)
        patch.setattr(State, "snapshot", lambda *_: copies.append(1))
        simulation.program.advance(steps)
    direct = [item for item in simulation.program.plan if isinstance(item, Launch)]
    assert [launched[item] for item in direct] == [steps] * each
    rebuilds = kernels["run"] - each * steps
    assert 0 < rebuilds < steps / 2
    assert kernels == {"_allow": 1, "_count": 1, "run": each * steps + rebuilds}
    assert not copies
