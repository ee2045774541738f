"""Many impacts at once: resolved in parallel, with the result of resolving them in order, longest overdue
first."""

import numpy as np
import pytest

from tests.scenes import DENSITY, RADIUS, by_id, momentum, scene, simulate
from tisim import InputError
from tisim.effects import Agglomeration, Friction, Impact

MU = 0.2
DT = 1e-7


def laws(hardness):
    return (Impact(hardness=hardness), Friction(coefficient=MU), Agglomeration())


def run(scenes, steps=None):
    return simulate(scenes, worlds=24, capacity=64, steps=steps)


class Reference:
    """One step in NumPy: drift, list the pairs in contact, then resolve them one after another."""

    def __init__(self, start, hardness):
        self.r, self.v = start["position"] + DT * start["velocity"], start["velocity"].copy()
        self.m, self.b, self.hardness = start["mass"].copy(), start["radius"].copy(), hardness
        self.impacts = self.merges = 0

    def due(self, i, j):
        """Time since the surfaces met, overlap over approach speed; negative if there is no impact."""
        gap = self.r[j] - self.r[i]
        distance = np.linalg.norm(gap)
        overlap = self.b[i] + self.b[j] - distance
        approach = (self.v[i] - self.v[j]) @ gap / distance
        return overlap / approach if overlap >= 0 and approach > 0 else -1.0

    def order(self):
        """Pairs in contact, longest overdue first; i is the larger of each."""
        pairs = []
        for a in range(len(self.m)):
            for c in range(a + 1, len(self.m)):
                i, j = (a, c) if self.b[a] >= self.b[c] else (c, a)
                if (due := self.due(i, j)) >= 0:
                    pairs.append((np.float32(due), i + j, i, j))
        return [pair[2:] for pair in sorted(pairs, reverse=True)]

    def impact(self, i, j):
        """Restitution in closed form for a constant hardness, a_0 = 0, a_f = 1; Coulomb friction."""
        n = (self.r[j] - self.r[i]) / np.linalg.norm(self.r[j] - self.r[i])
        u = self.v[i] - self.v[j]
        u_n = u @ n
        u_t = u - u_n * n
        reduced = self.m[i] * self.m[j] / (self.m[i] + self.m[j])
        least = min(self.b[i], self.b[j])
        force = reduced * u_n**2 / (2 * least)
        e = max(1 - np.sqrt(force / (2 * np.pi * least**2 * self.hardness)), 0.0)
        push = reduced * u_n * (1 + e)
        stop = reduced * np.linalg.norm(u_t)
        pull = stop if e == 0 else min(MU * push, stop)
        total = push * n + pull * u_t / np.linalg.norm(u_t)
        self.v[i] -= total / self.m[i]
        self.v[j] += total / self.m[j]
        self.impacts += 1
        if e == 0:
            whole = self.m[i] + self.m[j]
            for q in (self.r, self.v):
                q[i] = (self.m[i] * q[i] + self.m[j] * q[j]) / whole
            self.b[i] = np.cbrt(self.b[i] ** 3 + self.b[j] ** 3)
            self.m[i], self.m[j] = whole, 0.0
            self.merges += 1

    def step(self):
        for i, j in self.order():
            if self.m[i] > 0 and self.m[j] > 0 and self.due(i, j) >= 0:
                self.impact(i, j)
        live = self.m > 0
        return {
            "id": np.flatnonzero(live),
            **{
                n: x[live]
                for n, x in (("position", self.r), ("velocity", self.v), ("mass", self.m), ("radius", self.b))
            },
        }


def jam(rng, hardness, grains=60, sizes=2.0):
    """Grains in a space too small for them: nearly all touch several others."""
    radius = RADIUS * sizes ** rng.uniform(-1, 1, grains)
    return scene(
        rng.uniform(-4e-3, 4e-3, (grains, 3)),
        rng.normal(size=(grains, 3)) * 10,
        laws(hardness),
        radius=radius,
        dt=DT,
    )


def agree(result, expected, reference):
    state = by_id(result)
    np.testing.assert_array_equal(state["id"], expected["id"])
    assert (result.work["impacts"], result.work["merges"]) == (reference.impacts, reference.merges)
    for name, size in (("velocity", 50), ("position", 1e-2), ("mass", None), ("radius", None)):
        scale = size or expected[name].max()
        np.testing.assert_allclose(state[name], expected[name], rtol=0, atol=1e-12 * scale, err_msg=name)


@pytest.mark.parametrize("hardness", [1e8, 1e6, 1e5], ids=["rebound", "some bond", "most bond"])
def test_many_impacts_equal_serial_resolution(rng, hardness):
    """Eight jammed worlds, with about a hundred simultaneous impacts in each, against the serial
    reference."""
    scenes = [jam(rng, hardness) for _ in range(8)]
    impacts = 0
    for result in run(scenes):
        reference = Reference(result.start, hardness)
        agree(result, reference.step(), reference)
        impacts += reference.impacts
        scale = np.abs(result.start["mass"][:, None] * result.start["velocity"]).sum()
        np.testing.assert_allclose(momentum(result.state), momentum(result.start), rtol=0, atol=1e-15 * scale)
        assert result.state["mass"].sum() == pytest.approx(result.start["mass"].sum(), rel=1e-15)
    assert impacts > 8 * (40 if hardness == 1e8 else 15)


def test_the_order_of_impacts_matters_in_these_worlds(rng):
    """Makes sure that the test above can fail: reverse order gives a different result."""
    start = jam(rng, 1e8)
    (result,) = run([start])
    reference = Reference(result.start, 1e8)
    backwards = reference.order
    reference.order = lambda: backwards()[::-1]
    difference = np.abs(reference.step()["velocity"] - by_id(result)["velocity"]).max()
    assert difference > 0.1


def test_grain_hit_by_twelve_at_once(rng):
    """The twelve neighbours in a close packing approach together: the result equals the reference, and
    momentum is conserved to rounding."""
    around = np.array([[a, b, 0] for a in (-1, 1) for b in (-1, 1)])
    around = np.vstack([np.roll(around, k, axis=1) for k in range(3)]) / np.sqrt(2)
    scenes = []
    for spread in (0.0, 0.1, 0.3):
        position = np.vstack([[[0, 0, 0]], 2 * RADIUS * (1 - 1e-6) * around])
        speed = 3 * (1 + spread * rng.uniform(-1, 1, (12, 1)))
        velocity = np.vstack([[[0.1, 0.2, 0.3]], -speed * around])
        scenes.append(scene(position, velocity, laws(1e8), dt=DT))
    for result in run(scenes):
        assert result.work["impacts"] >= 12
        reference = Reference(result.start, 1e8)
        agree(result, reference.step(), reference)
        scale = np.abs(result.start["mass"][:, None] * result.start["velocity"]).sum()
        np.testing.assert_allclose(momentum(result.state), momentum(result.start), rtol=0, atol=1e-15 * scale)


def test_twelve_bonding_grains_merge_into_one():
    """All twelve hit the grain in the middle and bond: one sphere of 13 grains, at rest in the middle."""
    around = np.array([[a, b, 0] for a in (-1, 1) for b in (-1, 1)])
    around = np.vstack([np.roll(around, k, axis=1) for k in range(3)]) / np.sqrt(2)
    position = np.vstack([[[0, 0, 0]], 2 * RADIUS * (1 - 1e-6) * around])
    velocity = np.vstack([[[0, 0, 0]], -3 * around])
    start = scene(position, velocity, laws(1.0), dt=DT, steps=20)
    (result,) = run([start])
    state = result.state
    assert len(state["mass"]) == 1
    assert result.work["merges"] == 12
    assert state["radius"][0] == pytest.approx(13 ** (1 / 3) * RADIUS, rel=1e-14)
    np.testing.assert_allclose(state["velocity"], 0, atol=1e-14)
    np.testing.assert_allclose(state["position"], 0, atol=1e-17)


def test_middle_grain_of_three_in_contact_from_both_sides():
    """Both outer grains hit the middle one in the same instant: two binary impacts, exact momentum."""
    reach = 2 * RADIUS * (1 - 1e-7)
    start = scene(
        [[-reach, 0, 0], [0, 0, 0], [reach, 0, 0]], [[1.0, 0, 0], [0, 0, 0], [-1.0, 0, 0]], laws(1e9), dt=DT
    )
    for steps, impacts in ((1, 2), (4000, 3)):
        (result,) = run([start.replace({"duration": steps * DT})])
        # One after another: the first gives its speed to the middle grain, which then hits the other; and
        # once more.
        assert result.work["impacts"] == impacts
        np.testing.assert_allclose(momentum(result.state), 0, atol=1e-20)
    v = by_id(result)["velocity"][:, 0]
    assert v[0] < v[1] < v[2]


def closing_in(number, delay):
    """Grains around one that they touch, all at 2 m/s towards it; later indices arrive earlier."""
    angle = 2 * np.pi * np.arange(number) / number
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(number)], axis=1)
    place = (2 * RADIUS * (1 - 1e-7) + 2.0 * delay * np.arange(number)[::-1, None]) * out
    return scene(
        np.vstack([[[0, 0, 0]], place]), np.vstack([[[0, 0, 0]], -2.0 * out]), laws(2e8), dt=DT, steps=2000
    )


@pytest.mark.parametrize("number", [2, 3, 4])
def test_a_tie_equals_the_limit_of_successive_impacts(number):
    """Of impacts in one instant the one with the highest indices comes first, as if it were
    slightly earlier."""
    tie, near = run([closing_in(number, delay) for delay in (0.0, 1e-13)])
    assert tie.work["impacts"] >= number
    assert tie.work == near.work
    np.testing.assert_allclose(by_id(tie)["velocity"], by_id(near)["velocity"], rtol=0, atol=1e-12)
    scale = 2.0 * number * tie.state["mass"][0]
    np.testing.assert_allclose(momentum(tie.state), momentum(tie.start), rtol=0, atol=1e-15 * scale)
    energy = [(state["velocity"] ** 2).sum() for state in (tie.start, tie.state)]
    assert energy[1] < energy[0]


def test_three_grains_in_a_row():
    """Newton's cradle with restitution e = 1 - v/v*: binary impacts transmit the pulse, in closed form."""
    hardness, speed = 2e6, 2.0
    critical = np.sqrt(3 * hardness / (2 * DENSITY))
    v, impacts = np.array([speed, 0.0, 0.0]), 0
    while True:
        hits = [k for k in (0, 1) if v[k] > v[k + 1]]
        if not hits:
            break
        k = hits[-1] if impacts else 0
        approach = v[k] - v[k + 1]
        e = max(1 - approach / 2 / critical, 0)
        mean = v[k : k + 2].mean()
        v[k], v[k + 1] = mean - e * approach / 2, mean + e * approach / 2
        impacts += 1
    assert impacts >= 3, "the first grain must catch up with the second"
    start = scene(
        [[0, 0, 0], [2 * RADIUS, 0, 0], [4 * RADIUS, 0, 0]],
        [[speed, 0, 0], [0, 0, 0], [0, 0, 0]],
        laws(hardness),
        dt=1e-5,
        steps=20_000,
    )
    (result,) = run([start])
    assert result.work["impacts"] == impacts
    np.testing.assert_allclose(by_id(result)["velocity"][:, 0], v, rtol=0, atol=1e-12)


def test_too_many_contacts_give_a_clear_failure(rng, monkeypatch):
    """Sixty grains in one place: impossible for hard spheres. If such a start passes validation, the run
    stops at once with a message."""
    n = 60
    start = scene(rng.normal(size=(n, 3)) * 1e-5, rng.normal(size=(n, 3)), laws(1e9), dt=1e-12, steps=10)
    with pytest.raises(InputError, match="at most 8 pairs overlap for each of them; received about"):
        run([start])
    with monkeypatch.context() as patch:
        patch.setattr("tisim.engine.simulation.check_places", lambda scene, start: [])
        (result,) = run([start])
    assert not result.status.ok
    # No particle is named: the order of threads decides which pair exceeds the capacity.
    assert "more simultaneous contacts than there is room for; kept t = 0 s" in result.status.reason
    assert result.time == 0.0
    for name in ("position", "velocity", "mass"):
        np.testing.assert_array_equal(result.state[name], result.start[name])
    # The next scene, in which two grains meet, is not affected.
    place, speed = RADIUS * (1 - 1e-9), [[1.0, 0, 0], [-1.0, 0, 0]]
    (after,) = run([scene([[-place, 0, 0], [place, 0, 0]], speed, laws(1e9), dt=1e-12)])
    assert after.status.ok
    assert after.work["impacts"] == 1
