"""The core takes effects it has never heard of: all of these are defined here and nowhere else."""

import time

import numpy as np
import pytest
from scipy import stats

from tests.scenes import by_id, fixed, scene, simulate
from tisim import Scene, Simulation, noise
from tisim._taichi import ti
from tisim.effect import Force, Operator, PairForce, parameter
from tisim.effects.impact import Impact
from tisim.errors import InputError
from tisim.operators.agglomeration import Agglomeration
from tisim.state import Field

K_E = 8.9875517873681764e9
"""Coulomb's constant, N m^2/C^2."""


class Coulomb(PairForce):
    """F_i = -k q_i q_j / d^2 n_ij, between all pairs; only this effect needs the charge."""

    needs = ("charge",)
    constant: float = parameter("N m^2/C^2", K_E, gt=0)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return -self.constant(w) * s.charge[w, i] * s.charge[w, j] / distance**3 * separation


class Trap(Force):
    """F = -k (r - c) + m g cos(omega t): a spring to a place, and a force that depends on time."""

    stiffness: float = parameter("N/m", ge=0)
    centre: tuple[float, float, float] = parameter("m", (0.0, 0.0, 0.0))
    shake: tuple[float, float, float] = parameter("m/s^2", (0.0, 0.0, 0.0))
    omega: float = parameter("1/s", 0.0, ge=0)

    @ti.func
    def force(self, s, w, i, t):
        spring = -self.stiffness(w) * (s.position[w, i] - self.centre(w))
        return spring + s.mass[w, i] * self.shake(w) * ti.cast(ti.cos(self.omega(w) * t), s.real)


class RandomKicks(Operator):
    """v += sigma sqrt(dt) normal, three draws for each particle and step; sums what each has received."""

    needs = (Field("kicked", "m/s", 3), "velocity")
    counts = ("kicks",)
    sigma: float = parameter("m/s^1.5", ge=0)

    @ti.func
    def particle(self, s, w, i, dt):
        a = noise.normal(noise.bits(s.seed[w], 77, s.id[w, i], s.steps[w], 0))
        b = noise.normal(noise.bits(s.seed[w], 77, s.id[w, i], s.steps[w], 1))
        kick = self.sigma(w) * ti.sqrt(dt) * ti.cast(ti.Vector([a[0], a[1], b[0]]), s.real)
        s.velocity[w, i] += kick
        s.kicked[w, i] += kick
        ti.atomic_add(s.kicks[w], 1)


WORLDS, CAPACITY = 40, 32


def run(scenes):
    return simulate(scenes, worlds=WORLDS, capacity=CAPACITY)


def charges(position, velocity, charge, trap, mass=1.0, **more):
    effects = (Coulomb(), Trap(**trap))
    return scene(
        position, velocity, effects, mass=mass, quantities={"charge": np.asarray(charge, float)}, **more
    )


def test_forces_are_their_numpy_twin(rng):
    """Random charges in a trap: the force on each, at the start and after a step."""
    scenes = []
    for _ in range(10):
        n = 20
        trap = {
            "stiffness": rng.uniform(0, 5),
            "centre": tuple(rng.normal(size=3)),
            "shake": (1.0, 2.0, 3.0),
            "omega": 4.0,
        }
        scenes.append(
            charges(
                rng.normal(size=(n, 3)),
                rng.normal(size=(n, 3)),
                rng.normal(size=n) * 1e-5,
                trap,
                mass=rng.uniform(1, 2, n),
                dt=1e-3,
            )
        )
    for made, result in zip(scenes, run(scenes), strict=True):
        state, trap = result.state, made.effects[1]
        r, q = state["position"], state["charge"]
        gap = r[None] - r[:, None]
        distance = np.linalg.norm(gap, axis=2) + np.eye(len(r))
        expected = -(K_E * q[:, None] * q / distance**3)[..., None] * gap
        expected = expected.sum(axis=1) - trap.stiffness * (r - np.array(trap.centre))
        expected += state["mass"][:, None] * np.array(trap.shake) * np.cos(trap.omega * result.time)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(state["force"], expected, rtol=1e-13, atol=1e-13 * scale)


def orbit(steps):
    """Opposite charges on a circle of radius 1 m each about their centre; one period in 2 pi seconds."""
    q = np.sqrt(4.0 / K_E)
    period = 2 * np.pi
    return charges(
        [[1, 0, 0], [-1, 0, 0]],
        [[0, 1, 0], [0, -1, 0]],
        [q, -q],
        {"stiffness": 0.0},
        dt=period / steps,
        steps=steps,
    )


def test_two_body_orbit_closes_at_second_order():
    """Velocity Verlet on a Kepler circle: the error after one period falls as dt^2."""
    steps = 2 ** np.arange(7, 12)
    results = run([orbit(int(n)) for n in steps])
    errors = np.array([np.abs(by_id(r)["position"] - [[1, 0, 0], [-1, 0, 0]]).max() for r in results])
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.02)
    assert errors[-1] < 1e-4
    for result, n in zip(results, steps, strict=True):
        assert result.work["steps"] == n
        np.testing.assert_allclose(result.state["velocity"].sum(axis=0), 0, atol=1e-14 * n)


def potential(state):
    gap = np.linalg.norm(state["position"][0] - state["position"][1])
    return 0.5 * (state["velocity"] ** 2).sum() + K_E * state["charge"].prod() / gap


def test_energy_of_an_eccentric_orbit_does_not_drift():
    """Twenty periods at e = 0.36: the energy error stays that of one step size, and falls as its square."""
    q = np.sqrt(4.0 / K_E)
    results = run(
        [
            charges(
                [[1, 0, 0], [-1, 0, 0]],
                [[0, 0.8, 0], [0, -0.8, 0]],
                [q, -q],
                {"stiffness": 0.0},
                dt=2 * np.pi / n,
                steps=20 * n,
            )
            for n in (500, 1000)
        ]
    )
    coarse, fine = (abs(potential(r.state) / potential(r.start) - 1) for r in results)
    assert coarse < 1e-3
    assert fine < coarse / 3


def test_spring_under_a_force_that_depends_on_time():
    """Forced oscillator from rest, r = g (cos(omega t) - cos(w0 t)) / (w0^2 - omega^2), at second order."""
    stiffness, omega, shake, end = 4.0, 1.3, 0.7, 3.0
    steps = 2 ** np.arange(5, 10)
    made = [
        charges(
            [[0, 0, 0]],
            [[0, 0, 0]],
            [0.0],
            {"stiffness": stiffness, "shake": (shake, 0, 0), "omega": omega},
            dt=end / n,
            steps=int(n),
        )
        for n in steps
    ]
    w0 = np.sqrt(stiffness)
    expected = shake * (np.cos(omega * end) - np.cos(w0 * end)) / (w0**2 - omega**2)
    errors = np.array([abs(r.state["position"][0, 0] - expected) for r in run(made)])
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.05)
    assert errors[-1] < 1e-5


def kicked(sigma=2.0, seed=5, steps=200, n=30):
    effects = (RandomKicks(sigma=sigma),)
    return scene(
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        effects,
        dt=0.01,
        steps=steps,
        quantities={"kicked": np.zeros((n, 3))},
        seed=seed,
    )


def test_an_operator_with_noise_a_field_and_a_counter():
    """Velocities are normal with variance sigma^2 t; the field adds up the kicks; each is counted."""
    results = run([kicked(seed=seed) for seed in range(WORLDS)])
    v = np.concatenate([result.state["velocity"] for result in results])
    assert stats.kstest(v.ravel() / (2.0 * np.sqrt(2.0)), "norm").pvalue > 0.01
    assert v.var() == pytest.approx(8.0, rel=4 * np.sqrt(2 / v.size))
    for result in results:
        np.testing.assert_array_equal(result.state["kicked"], result.state["velocity"])
        assert result.work["kicks"] == 30 * 200
    again = run([kicked(seed=seed) for seed in range(WORLDS)])
    for a, b in zip(results, again, strict=True):
        np.testing.assert_array_equal(a.state["velocity"], b.state["velocity"])


def test_every_parameter_may_differ_per_world():
    """Two designs in one batch each get their own numbers, vectors among them, as if alone."""
    one = charges([[1, 0, 0]], [[0, 0, 0]], [0.0], {"stiffness": 1.0, "centre": (0, 1, 0)}, dt=0.1, steps=5)
    two = charges([[1, 0, 0]], [[0, 0, 0]], [0.0], {"stiffness": 9.0, "centre": (0, 0, 2)}, dt=0.05, steps=20)
    together, alone = run([one, two, one]), [run([one])[0], run([two])[0]]
    for a, b in zip(together, [*alone, alone[0]], strict=True):
        assert a.work == b.work
        for name in a.state:
            np.testing.assert_array_equal(a.state[name], b.state[name])
    assert np.abs(together[0].state["position"] - together[1].state["position"]).max() > 0.1


def test_what_no_effect_needs_is_not_allocated():
    """A scene pays for the fields, the bytes, the counters and the phases of its own effects only."""
    core = {"position", "velocity", "mass", "radius", "id"}
    bare = Simulation(scene([[0, 0, 0]], [[0, 0, 0]]), worlds=3, capacity=7)
    assert {f.name for f in bare.s.fields} == core
    assert sum(bare.s.bytes().values()) == 3 * 7 * (8 * (3 + 3 + 1 + 1) + 4)
    assert set(bare.s.counters) == {"steps", "particle_steps"}
    assert not any(
        word in name for name in bare.program.names() for word in ("Force", "Kick", "Survey", "Bid")
    )
    extra = {
        (Trap(stiffness=1),): {"force"},
        (Coulomb(),): {"charge", "force"},
        (RandomKicks(sigma=1),): {"kicked"},
        (Impact(hardness=1),): set(),
        (Impact(hardness=1), Agglomeration()): set(),
    }
    for effects, more in extra.items():
        made = Simulation(scene([[0, 0, 0]], [[0, 0, 0]], effects), worlds=3, capacity=7)
        assert {f.name for f in made.s.fields} == core | more
        assert ("kicks" in made.s.counters) == isinstance(effects[0], RandomKicks)
        made.close()
    bare.close()


def test_other_designs_compile_nothing():
    """Loading and running a second design takes a small part of what the first took."""
    first = scene([[1, 0, 0]], [[0, 0, 0]], (Trap(stiffness=1.0),), dt=0.1, steps=3)
    second = scene([[2, 0, 0], [3, 0, 0]], np.zeros((2, 3)), (Trap(stiffness=7.0),), dt=0.2, steps=3)
    simulation = Simulation(first, worlds=2, capacity=2)
    taken = []
    for made in (first, second):
        began = time.perf_counter()
        simulation.load([made])
        simulation.run()
        taken.append(time.perf_counter() - began)
        assert simulation.results()[0].status.ok
    assert taken[1] < taken[0] / 5
    assert len(simulation.results()[0].state["mass"]) == 2
    simulation.close()


def test_a_scene_of_another_structure_is_refused():
    simulation = Simulation(scene([[0, 0, 0]], [[0, 0, 0]], (Trap(stiffness=1.0),)))
    with pytest.raises(InputError, match="scene must be of the structure compiled; received"):
        simulation.load([scene([[0, 0, 0]], [[0, 0, 0]])])
    simulation.close()


def test_a_scene_finds_them_by_name():
    """No registry: a class that exists can be written in a file."""
    made = charges([[0, 0, 0]], [[0, 0, 0]], [1.0], {"stiffness": 2.0})
    again = Scene.from_dict(made.to_dict())
    assert again.digest() == made.digest()
    assert [type(e) for e in again.effects] == [Coulomb, Trap]
    assert again.stepper == fixed(1e-9)
