"""Pair forces over the half list, as contact laws use them, with a contact law defined only here."""

import numpy as np
import pytest

from tests.scenes import by_id, compiled, fixed, scene, simulate
from tests.throwaway import SoftShell, SoftShellOfAll
from tisim import Box, Simulation
from tisim.backend.taichi import ti
from tisim.effects import PairForce, parameter
from tisim.engine import checkpoint
from tisim.pairs import pair_chunks
from tisim.steppers import Trapezoid
from tisim.steppers.implicit.step_control import ErrorControl


def shells(kind, rng, images):
    """Polydisperse grains in a box, one of them with more neighbours than a list row holds."""
    radius = np.concatenate([[0.2], rng.uniform(0.005, 0.05, 299)])
    return scene(
        rng.uniform(0.0, 1.0, (300, 3)),
        rng.normal(size=(300, 3)),
        (kind(stiffness=500.0, width=0.04),),
        radius=radius,
        dt=1e-3,
        steps=60,
        domain=Box(low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0), images=images),
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("schedule", "images"), [("world", True), pytest.param("particle", False, marks=pytest.mark.slow)]
)
def test_list_forces_equal_short_ranged_forces_over_all_pairs(images, schedule):
    """After many list rebuilds trajectories agree to rounding and momentum is conserved to rounding."""
    results = []
    for kind in (SoftShell, SoftShellOfAll):
        setup = shells(kind, np.random.default_rng(3), images)
        simulation = Simulation(setup, schedule=schedule)
        simulation.load([setup])
        simulation.run()
        results += simulation.results()
        simulation.close()
    by_list, over_all = results
    np.testing.assert_allclose(by_list.state["velocity"], over_all.state["velocity"], rtol=0, atol=1e-9)
    for result in results:
        assert np.abs(result.state["velocity"] - result.start["velocity"]).max() > 0.1
        before = (result.start["mass"][:, None] * result.start["velocity"]).sum(axis=0)
        after = (result.state["mass"][:, None] * result.state["velocity"]).sum(axis=0)
        np.testing.assert_allclose(after, before, rtol=0, atol=1e-12 * result.state["mass"].sum())


@pytest.mark.long
def test_grains_collide_right_after_one_crosses_a_face():
    """Without images two grains at opposite faces do not interact, but do so one step after a crossing.

    Equal grains exchange their velocities, whenever the list was built. A delayed force would add energy.
    """
    made = scene(
        [[0.975, 0.5, 0.5], [0.23, 0.5, 0.5]],
        [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        (SoftShell(stiffness=500.0, width=0.02),),
        radius=0.1,
        mass=1.0,
        dt=1e-3,
        steps=160,
        domain=Box(low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0), images=False),
    )
    (result,) = simulate([made], capacity=2, schedule="world")
    np.testing.assert_allclose(result.state["velocity"][:, 0], [0.0, 1.0], rtol=0, atol=5e-3)


class Grip(PairForce):
    """A discrete-element contact with linear normal and tangential springs.

    The tangential spring keeps the slip of the surfaces as history and rotates with the pair. Torques act
    about the centres.
    """

    fields = ("spin",)
    short_ranged = True
    memory = 3
    stiffness: float = parameter("N/m", "stiffness", gt=0)
    grip: float = parameter("N/m", "grip", ge=0)

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        depth = s.radius[w, i] + s.radius[w, j] - distance
        force, couple, slid = 0.0 * separation, 0.0 * separation, 0.0 * separation
        if depth >= 0.0:
            n = separation / distance
            slip = s.relative_velocity(w, i, j, separation)
            slip -= (s.radius[w, i] * s.spin[w, i] + s.radius[w, j] * s.spin[w, j]).cross(n)
            new = past + dt * slip
            slid = new - new.dot(n) * n
            force = -self.stiffness(w) * depth * n + self.grip(w) * slid
            couple = n.cross(force)
        return force, s.radius[w, i] * couple, s.radius[w, j] * couple, slid


SIDE, STEP = 1.0, 2e-3
TRIALS = Trapezoid(control=ErrorControl(error=1e-3, tolerance=1e-10, first=1e-4, longest=STEP, shortest=1e-9))
"""Adaptive implicit steps, after which the contact history is updated separately."""


class CutOff(SoftShell):
    """A shell much wider than the grains."""

    truncated = True


def grains(seed=5, n=160, steps=150, grip=300.0, others=(), stepper=None):
    """Rubbing grains of three sizes in a periodic box, some overlapping at the start."""
    rng = np.random.default_rng(seed)
    return scene(
        rng.uniform(0.0, SIDE, (n, 3)),
        rng.normal(size=(n, 3)),
        (Grip(stiffness=500.0, grip=grip), *others),
        radius=rng.choice([0.05, 0.07, 0.1], n),
        mass=1.0,
        duration=steps * STEP,
        stepper=stepper or fixed(STEP),
        domain=Box(low=(0.0, 0.0, 0.0), high=(SIDE, SIDE, SIDE)),
    )


def reference(start, steps, stiffness, grip, shell=(0.0, 0.0)):
    """Reference implementation in NumPy: all pairs, history in a matrix, velocity Verlet.

    shell : stiffness and width of additional shells.
    """
    r, v, m, radius = (start[name].copy() for name in ("position", "velocity", "mass", "radius"))
    spin, n = np.zeros_like(v), len(m)
    inertia = 0.4 * m * radius**2
    reach = radius[:, None] + radius
    past = np.zeros((n, n, 3))

    def separation():
        d = r[None] - r[:, None]
        return d - SIDE * np.round(d / SIDE)

    def pairs():
        d = separation()
        distance = np.linalg.norm(d, axis=2) + np.eye(n)
        return d / distance[..., None], distance, (distance <= reach) & ~np.eye(n, dtype=bool)

    def loads():
        normal, distance, touch = pairs()
        force = (-stiffness * (reach - distance)[..., None] * normal + grip * past) * touch[..., None]
        torque = (radius[:, None, None] * np.cross(normal, force)).sum(axis=1)
        depth = np.maximum(shell[1] - (distance - reach), 0.0) * ~np.eye(n, dtype=bool)
        return (force - shell[0] * depth[..., None] * normal).sum(axis=1), torque

    force, torque = loads()
    for _ in range(steps):
        v += 0.5 * STEP * force / m[:, None]
        spin += 0.5 * STEP * torque / inertia[:, None]
        r = (r + STEP * v) % SIDE
        normal, _, touch = pairs()
        turning = radius[:, None] * spin
        slip = v[None] - v[:, None] - np.cross(turning[:, None] + turning[None], normal)
        new = past + STEP * slip
        past = (new - (new * normal).sum(axis=2, keepdims=True) * normal) * touch[..., None]
        force, torque = loads()
        v += 0.5 * STEP * force / m[:, None]
        spin += 0.5 * STEP * torque / inertia[:, None]
    return v, spin


@pytest.mark.slow
@pytest.mark.parametrize("schedule", ["world", "particle"])
def test_contacts_with_history_are_their_numpy_reference(schedule, tmp_path):
    """After many list rebuilds velocity and spin agree, and a restart half-way gives the same bits."""
    setup = grains()
    simulation = compiled(setup, capacity=160, schedule=schedule)
    simulation.load([setup])
    simulation.run(steps=70)
    checkpoint.save(simulation, tmp_path / "half")
    simulation.run()
    (result,) = simulation.results()
    v, spin = reference(result.start, 150, 500.0, 300.0)
    state = by_id(result)
    np.testing.assert_allclose(state["velocity"], v, rtol=0, atol=1e-9)
    np.testing.assert_allclose(state["spin"], spin, rtol=0, atol=1e-8)
    momentum = (state["mass"][:, None] * (state["velocity"] - result.start["velocity"])).sum(axis=0)
    np.testing.assert_allclose(momentum, 0, atol=1e-12 * len(v))
    # The history matters here: without the tangential springs the result differs.
    assert np.abs(reference(result.start, 150, 500.0, 0.0)[0] - v).max() > 0.1
    assert np.abs(spin).max() > 1

    simulation.load([setup])
    checkpoint.restore(simulation, tmp_path / "half")
    simulation.run()
    (again,) = simulation.results()
    for name in ("position", "velocity", "spin"):
        np.testing.assert_array_equal(again.state[name], result.state[name])


@pytest.mark.slow
def test_the_contact_history_is_bounded_and_cleared():
    """No grain keeps more entries than contacts, each pair is stored once, and distant grains store
    nothing."""
    setup = grains()
    (result,) = simulate([setup], capacity=160, schedule="world")
    state = by_id(result)
    d = state["position"][None] - state["position"][:, None]
    d -= SIDE * np.round(d / SIDE)
    radius = state["radius"]
    touch = (np.linalg.norm(d, axis=2) <= radius[:, None] + radius) & ~np.eye(len(radius), dtype=bool)
    partners = [(i, int(j)) for i, row in enumerate(state["grip_partners"]) for j in row if j >= 0]
    assert len(partners) > 50
    assert {tuple(sorted(pair)) for pair in partners} == {tuple(pair) for pair in np.argwhere(np.triu(touch))}
    assert len(partners) == touch.sum() / 2
    assert all(radius[i] <= radius[j] for i, j in partners)


def run_in_chunks(setup, slots, monkeypatch):
    """Result with chunks of ``slots`` slots."""
    monkeypatch.setattr(pair_chunks, "CHUNK_SLOTS", slots)
    simulation = Simulation(setup, capacity=160, schedule="world")
    simulation.load([setup])
    simulation.run()
    (result,) = simulation.results()
    simulation.close()
    return result


SHELL = {"stiffness": 5.0, "width": 0.25}


@pytest.mark.slow
def test_contacts_within_a_far_cut_off_equal_the_reference(monkeypatch):
    """Grains that lose contact within the cut-off of another law lose their history.

    Some pairs extend over two chunks.
    """
    result = run_in_chunks(grains(others=(CutOff(**SHELL),), steps=75), 64, monkeypatch)
    state, shell = by_id(result), tuple(SHELL.values())
    v, spin = reference(result.start, 75, 500.0, 300.0, shell)
    np.testing.assert_allclose(state["velocity"], v, rtol=0, atol=1e-9)
    np.testing.assert_allclose(state["spin"], spin, rtol=0, atol=1e-8)
    # Both laws act.
    assert np.abs(reference(result.start, 75, 500.0, 300.0)[0] - v).max() > 0.1
    assert np.abs(reference(result.start, 75, 500.0, 0.0, shell)[0] - v).max() > 0.1


@pytest.mark.slow
def test_contacts_in_implicit_steps_equal_all_pairs(monkeypatch):
    """After an implicit step the history is updated separately, also if the other law sums over all pairs."""
    over_all, cut = (
        by_id(run_in_chunks(grains(others=(kind(**SHELL),), stepper=TRIALS), slots, monkeypatch))
        for kind, slots in ((SoftShellOfAll, 512), (CutOff, 64))
    )
    for name in ("velocity", "spin"):
        np.testing.assert_allclose(cut[name], over_all[name], rtol=0, atol=1e-8, err_msg=name)
    partners = (np.sort(state["grip_partners"], axis=1) for state in (cut, over_all))
    np.testing.assert_array_equal(*partners)


@pytest.mark.slow
def test_writing_a_state_does_not_advance_contacts():
    """Overwriting velocities with their own values must not advance the slip."""
    setup = grains()
    simulation = compiled(setup, capacity=160, schedule="world")
    simulation.load([setup])
    simulation.run(steps=50)
    before = {name: simulation.state[name] for name in ("grip_partners", "grip_past")}
    simulation.state["velocity"] = simulation.state["velocity"]
    np.testing.assert_array_equal(simulation.state["grip_partners"], before["grip_partners"])
    assert np.abs(before["grip_past"]).max() > 1e-3
    np.testing.assert_allclose(simulation.state["grip_past"], before["grip_past"], rtol=0, atol=1e-15)


@pytest.mark.long
def test_reading_states_does_not_change_the_history():
    """Unused slots included, the state does not depend on how often the history has been stored."""
    setup, ends = grains(), []
    for parts in (1, 10):
        simulation = compiled(setup, capacity=160, schedule="world")
        simulation.load([setup])
        for _ in range(parts):
            simulation.run(steps=150 // parts)
        ends += simulation.results()
    for name, values in ends[0].state.items():
        np.testing.assert_array_equal(values, ends[1].state[name], err_msg=name)
