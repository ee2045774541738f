"""The contact history of grains is kept when others among them merge and break; against NumPy."""

import numpy as np
import pytest

from tests.effects.contact.grains import heap, reference
from tests.scenes import by_id, simulate
from tisim.backend.taichi import ti
from tisim.effects import parameter
from tisim.operators import AddsParticles

# Grains overlap deeply at the start here, on purpose.
pytestmark = [
    pytest.mark.long,
    pytest.mark.filterwarnings("ignore::tisim.errors.StartWarning"),
]

GRAINS, BEFORE, AFTER, DT = 60, 100, 100, 2e-4
PIECE = 0.15
"""m; distance between a grain and the piece that breaks off it."""


class MergeAndBreak(AddsParticles):
    """At a given time, once, one grain is merged into another, and half of a third breaks off."""

    when: float = parameter("s", "time", ge=0)
    taken: float = parameter("", "id of the grain that is taken up", ge=0)
    taker: float = parameter("", "id of the grain that takes it up", ge=0)
    broken: float = parameter("", "id of the grain that breaks", ge=0)

    def capacity(self, masses):
        return len(masses) + 1

    @ti.func
    def acts(self, s, w):
        return ti.cast(s.time[w] >= self.when(w) and s.time[w] - s.dt[w] < self.when(w), ti.i32)

    @ti.func
    def world(self, s, w):
        gone, kept, half = 0, 0, 0
        for i in range(s.count[w]):
            gone = ti.select(s.id[w, i] == ti.cast(self.taken(w), ti.i32), i, gone)
            kept = ti.select(s.id[w, i] == ti.cast(self.taker(w), ti.i32), i, kept)
            half = ti.select(s.id[w, i] == ti.cast(self.broken(w), ti.i32), i, half)
        s.mass[w, kept] = s.mass[w, kept] + s.mass[w, gone]
        s.remove(w, gone)
        s.mass[w, half] = 0.5 * s.mass[w, half]
        piece = s.append(w, half)
        s.position[w, piece][0] = s.position[w, piece][0] + PIECE


def bed(seed, **which):
    made = heap(np.random.default_rng(seed), GRAINS, dt=DT, steps=BEFORE + AFTER)
    event = MergeAndBreak(when=(BEFORE - 0.5) * DT, **which)
    return made.model_copy(update={"effects": (*made.effects, event)})


def grow(known, i):
    """The piece of grain i, the last grain of the reference, without any contact history."""
    for name in ("x", "v", "w", "radius", "mass", "held", "material"):
        values = getattr(known, name)
        setattr(known, name, np.concatenate([values, values[i : i + 1]]))
    n = len(known.x)
    known.x[-1, 0] += PIECE
    known.held[-1] = 0.0
    past = np.zeros((n, n, *known.past.shape[2:]))
    past[:-1, :-1] = known.past
    known.past = past


@pytest.mark.parametrize("which", [(0, 30, 59), (59, 0, 30), (30, 59, 0)])
def test_other_grains_are_not_affected(which):
    """Indices change, the new grain reuses the slot of the merged one, and lists are rebuilt."""
    taken, taker, broken = which
    made = bed(5, taken=taken, taker=taker, broken=broken)
    (result,) = simulate([made], capacity=GRAINS + 4)
    assert result.status.ok, result.status.reason
    found, known = by_id(result), reference(made)
    known.run(BEFORE, DT)
    slid = np.abs(known.past).reshape(GRAINS, GRAINS, -1).max(axis=2)
    assert (np.delete(np.delete(slid, which, axis=0), which, axis=1) > 0).sum() > 50
    known.mass[taker] += known.mass[taken]
    known.mass[broken] *= 0.5
    grow(known, broken)
    known.remove(taken)
    known.run(AFTER, DT)
    assert len(found["mass"]) == GRAINS
    np.testing.assert_array_equal(found["mass"], known.mass)
    np.testing.assert_allclose(found["velocity"], known.v, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found["spin"], known.w, rtol=0, atol=1e-8)
