"""Single precision: the same scenes as in test_schedules, in a process of their own."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.scenes import energy
from tests.test_schedules import WORLDS


def world(elsewhere, precision, w):
    head = f"{precision}/{w}/"
    found = {key.removeprefix(head): values for key, values in elsewhere.items() if key.startswith(head)}
    start = {key.removeprefix("start/"): values for key, values in found.items() if key.startswith("start/")}
    return {key: values for key, values in found.items() if "/" not in key}, start


@pytest.mark.parametrize("w", range(len(WORLDS)))
def test_single_precision_stays_finite_and_keeps_mass_and_energy(elsewhere, w):
    state, start = world(elsewhere, "single precision", w)
    for name, values in state.items():
        assert np.isfinite(values).all(), name
        if name not in ("id", "pieces", "work"):
            assert values.dtype == np.float32, name
    state = {name: np.asarray(values, float) for name, values in state.items()}
    assert state["mass"].sum() == pytest.approx(start["mass"].sum(), rel=1e-6)
    before, after = energy(start), energy(state)
    assert after == pytest.approx(before, rel=2e-5)
    momentum = [(s["mass"][:, None] * s["velocity"]).sum(axis=0) for s in (start, state)]
    size = (start["mass"] * np.linalg.norm(start["velocity"], axis=1)).sum()
    np.testing.assert_allclose(momentum[1], momentum[0], rtol=0, atol=2e-6 * size)
    volume = [(s["radius"] ** 3).sum() for s in (start, state)]
    assert volume[1] == pytest.approx(volume[0], rel=1e-5)
    low, high = WORLDS[w].domain.bounds()
    assert (state["position"] >= low.astype(np.float32)).all()
    assert (state["position"] < high.astype(np.float32)).all()


def test_single_and_double_precision_agree_on_how_much_merges(elsewhere):
    """Chaotic trajectories part; the numbers of grains left, each within 3 sqrt(N), do not."""
    for w in range(len(WORLDS)):
        single, double = (len(world(elsewhere, p, w)[0]["mass"]) for p in ("single precision", "one thread"))
        assert abs(single - double) <= 3 * np.sqrt(double)


COLD = """
import subprocess
import sys
from pathlib import Path

import numpy as np
import tisim
from tests.scenes import head_on
from tisim import runtime
from tisim.effects.heating import Heating
from tisim.effects.impact import Impact
from tisim.effects.softening import Softening

runtime.start(precision="f32")
for hardness, activation, temperature in ((1e5, 2e5, 300.0), (1e6, 1e3, 0.0), (1e9, 1e3, 1e-3)):
    effects = (Impact(hardness=hardness), Heating(heat_capacity=1e9), Softening(activation_energy=activation))
    result = tisim.run(head_on(0.01, effects, quantities={"temperature": temperature}))
    print(result.status.ok, result.work["impacts"], result.work["bonds"], result.work["unsettled"])
"""


def test_grains_too_hard_for_single_precision_rebound():
    """exp(Q / (R T)) is capped where hardness still fits f32: nothing turns into a NaN that bonds."""
    root = Path(__file__).parents[1]
    done = subprocess.run([sys.executable, "-c", COLD], capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.splitlines()[-3:] == ["True 1 0 0"] * 3
