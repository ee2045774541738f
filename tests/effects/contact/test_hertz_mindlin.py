"""Hertz and Mindlin against a NumPy reference, and the forces of one contact along a given path."""

import numpy as np
import pytest

from tests.effects.contact.grains import CAPACITY, USUAL, WORLDS, grains, heap, reference, run
from tests.scenes import by_id, compiled
from tisim import Material
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects import Granular, RestitutionDamping
from tisim.materials.materials import Materials, Touching
from tisim.pairs.contact_memory import NO_PARTNER, PARTNERS

# Grains overlap deeply at the start here, on purpose.
pytestmark = pytest.mark.filterwarnings("ignore::tisim.errors.StartWarning")

E_STAR = USUAL["young"] / (2 * (1 - USUAL["poisson"] ** 2))
G_STAR = USUAL["young"] / (4 * (2 - USUAL["poisson"]) * (1 + USUAL["poisson"]))
DT = 1e-5
"""s, of a step along a path."""
GRIP, PRESSED, EASED, SLID = 1e6, 0.02, 0.005, 1e-3
"""Infinite friction; overlaps and a displacement, m."""


@in_taichi_thread
@ti.kernel
def _along(law: ti.template(), normal: ti.types.ndarray(), path: ti.types.ndarray(), out: ti.types.ndarray()):
    """Forces along a path of overlap and slip, with R* = 1 m and m* = 1 kg."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        at_wall = ti.Vector([1.0, 3.5, 2.5, 2.5])
        past, before = ti.Vector.zero(ti.f64, 4), ti.Vector([normal[0, 0], normal[0, 1], normal[0, 2]])
        for k in range(path.shape[0]):
            n = ti.Vector([normal[k, 0], normal[k, 1], normal[k, 2]])
            along = n.dot(before)
            tilt, before = (before - along * n) / (1.0 + along), n
            slip = ti.Vector([path[k, 1], path[k, 2], path[k, 3]])
            force, _couple, known = law.contact(
                0, 0, n, path[k, 0], 1.0, 1.0, at_wall, slip, 0.0 * slip, tilt, 0.0, past, DT
            )
            past = known
            for c in ti.static(range(3)):
                out[k, c], out[k, 3 + c] = force[c], known[c]


def along(normal, overlap, moved, **law):
    """Force and contact history at each point of a path of one contact. ``moved`` : tangential displacement
    of its surfaces since the point before, m."""
    one = grains([[0, 0, 0]], [[0, 0, 0]], law=law)
    simulation = compiled(one, WORLDS, CAPACITY)
    simulation.load([one])
    (bound,) = simulation.assembly.effects.of(Granular)
    path, out = np.column_stack([overlap, moved / DT]), np.zeros((len(moved), 6))
    _along(bound, np.ascontiguousarray(np.broadcast_to(normal, moved.shape), float), path, out)
    return out[:, :3], out[:, 3:]


@pytest.mark.long
def test_steps_equal_the_reference(rng):
    """Unlike grains that overlap, spin and slide, in a cell; many stick, many slide."""
    made = [heap(rng, friction=0.1 + 0.2 * k, restitution=0.3 + 0.2 * k) for k in (0, 3)]
    for steps in (1, 300):
        for one, result in zip(made, run(made, steps=steps), strict=True):
            known, state = reference(one), by_id(result)
            known.run(steps, 2e-4)
            for name, values in (("position", known.x), ("velocity", known.v), ("spin", known.w)):
                np.testing.assert_allclose(state[name], values, rtol=0, atol=1e-11 * np.abs(values).max())
            assert steps == 1 or min(known.sliding, known.sticking) > 1000
            assert np.abs(known.v - result.start["velocity"]).max() > (0.03 if steps == 1 else 3)


def test_force_and_stiffness_of_hertz_and_mindlin():
    """At rest, 4/3 E* sqrt(R*) delta^1.5; displaced sideways a little, 8 G* a more per metre."""
    force, elastic = along([0, 0, 1], [PRESSED, PRESSED], np.array([[0, 0, 0], [1e-6, 0, 0]]), restitution=1)
    np.testing.assert_allclose(force[0], [0, 0, -4 / 3 * E_STAR * PRESSED**1.5], rtol=1e-14)
    np.testing.assert_allclose(force[1, 0], 8 * G_STAR * PRESSED**0.5 * 1e-6, rtol=1e-14)
    np.testing.assert_array_equal(elastic[1], [force[1, 0], 0, 0])


def test_the_contact_history_rotates_with_the_pair():
    """Displaced sideways, then rotated by 2 rad about a transverse axis: the force keeps its magnitude and
    rotates too."""
    turns = 400
    angle = np.linspace(0, 2, turns + 1)
    normal = np.stack([0 * angle, np.sin(angle), np.cos(angle)], axis=1)
    moved = np.zeros((turns + 1, 3))
    moved[0] = [3e-6, 4e-6, 0]
    _, elastic = along(normal, np.full(turns + 1, PRESSED), moved)
    np.testing.assert_allclose(np.linalg.norm(elastic, axis=1), np.linalg.norm(elastic[0]), rtol=1e-12)
    assert np.abs((elastic * normal).sum(axis=1)).max() < 1e-12 * np.abs(elastic).max()
    # Each rotation is a projection and a rescaling, which slightly turns the component along the axis.
    ahead = np.linalg.norm(elastic[0]) * np.array([0.6, 0.8 * np.cos(2), -0.8 * np.sin(2)])
    np.testing.assert_allclose(elastic[-1], ahead, atol=0.01 * np.linalg.norm(ahead))


def test_coulombs_limit_includes_damping_and_ends_at_once():
    """After long sliding, the force is mu F_n; when the motion reverses, it decreases at once as the spring
    does."""
    moved = np.zeros((30, 3))
    moved[:20, 0], moved[20:, 0] = 1e-3, -1e-7
    force, _ = along([0, 0, 1], np.full(30, PRESSED), moved, restitution=1.0, friction=0.3)
    limit = 0.3 * 4 / 3 * E_STAR * PRESSED**1.5
    np.testing.assert_allclose(force[10:20, 0], limit, rtol=1e-14)
    back = limit - 8 * G_STAR * PRESSED**0.5 * 1e-7 * np.arange(1, 11)
    np.testing.assert_allclose(force[20:, 0], back, rtol=1e-12)


def test_a_closed_path_gains_no_work():
    """Pressed, sheared, unloaded, sheared back and pressed again: half (S_1 - S_0) u^2 is dissipated, and
    nothing is gained."""
    n = 500
    still, down = np.zeros(n), np.linspace(PRESSED, EASED, n)
    overlap = np.concatenate([still + PRESSED, down, still + EASED, down[::-1]])
    aside = np.concatenate([still + SLID / n, still, still - SLID / n, still])
    moved = np.column_stack([aside, 0 * aside, -np.gradient(overlap)])
    force, elastic = along([0, 0, 1], overlap, moved, restitution=1.0, friction=GRIP)
    middle = force[:, 0] - 0.5 * np.diff(elastic[:, 0], prepend=0)
    stiffness = 8 * G_STAR * np.sqrt([PRESSED, EASED])
    lost = 0.5 * (stiffness[0] - stiffness[1]) * SLID**2
    assert (middle * aside).sum() == pytest.approx(lost, rel=1e-9)
    np.testing.assert_allclose(elastic[-1], 0, atol=1e-9 * np.abs(elastic).max())


def test_the_history_is_stored_on_the_smaller_grain(rng):
    """With more contacts than the capacity of a grain: the smaller grain stores the history, as it has few
    larger neighbours."""
    small, size = 40, 0.05
    turn, height = np.pi * (1 + 5**0.5) * np.arange(small), 1 - 2 * (np.arange(small) + 0.5) / small
    aside = np.sqrt(1 - height**2)
    around = np.stack([aside * np.cos(turn), aside * np.sin(turn), height], axis=1)
    place = np.concatenate([[[0.0, 0.0, 0.0]], (1.0 + 0.98 * size) * around])
    radius = np.concatenate([[1.0], np.full(small, size)])
    made = grains(place, 0.01 * rng.normal(size=place.shape), rng.normal(size=place.shape),
                  law={"young": 1e5}, radius=radius, mass=30 * radius**3, dt=1e-4, steps=20)  # fmt: skip
    (result,) = run([made])
    known, state = reference(made), by_id(result)
    known.run(20, 1e-4)
    for name, values in (("position", known.x), ("velocity", known.v), ("spin", known.w)):
        np.testing.assert_allclose(state[name], values, rtol=0, atol=1e-11 * np.abs(values).max())
    partners = state["granular_partners"]
    assert (partners[0] == NO_PARTNER).all()
    assert ((partners[1:] == 0).sum(axis=1) == 1).sum() > PARTNERS


@pytest.mark.long
def test_momentum_and_angular_momentum_are_conserved(rng):
    """Grains of unlike sizes and masses, far from any wall, that stick and slide."""
    n = 40
    radius, place = rng.uniform(0.1, 0.3, n), rng.uniform(0, 1.2, (n, 3))
    made = grains(place, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), law={"young": 1e5},
                  radius=radius, mass=rng.uniform(1, 3, n), dt=2e-4, steps=500)  # fmt: skip
    (result,) = run([made])

    def sums(state):
        momentum = state["mass"][:, None] * state["velocity"]
        inertia = 0.4 * state["mass"] * state["radius"] ** 2
        turning = np.cross(state["position"], momentum) + inertia[:, None] * state["spin"]
        return np.concatenate([momentum.sum(axis=0), turning.sum(axis=0)])

    assert np.abs(result.state["spin"] - result.start["spin"]).max() > 3
    np.testing.assert_allclose(sums(result.state), sums(result.start), rtol=0, atol=3e-12 * n)


def test_a_law_of_one_material():
    """E* and G* of two equal grains, and the constant c of their damping."""
    (alike,) = Materials({"grain": Material(**USUAL)}, {}).touching()
    assert alike.effective_young == pytest.approx(E_STAR, rel=1e-15)
    assert alike.effective_shear == pytest.approx(G_STAR, rel=1e-15)
    assert RestitutionDamping().mix(Touching(("a", "b"), *[Material(restitution=1)] * 2, None)) == {"loss": 0}
