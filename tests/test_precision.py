"""Single precision: the same scenes as in test_schedules, in a process of their own."""

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
