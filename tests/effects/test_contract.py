"""The core accepts effects that it does not know: the effects of tests/throwaway.py."""

import copy
import time

import numpy as np
import pytest
from scipy import stats

from tests import extremes
from tests.scenes import fixed, scene, simulate
from tests.throwaway import K_E, WORLDS, Coulomb, RandomKicks, Trap, charges, run
from tisim import InputError, Scene, Simulation
from tisim.describe.explain import known_effects
from tisim.effects import Agglomeration, ContactFriction, Force, Impact, Lorentz, PairForce, Tether


def test_forces_equal_their_numpy_reference(rng):
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
    for setup, result in zip(scenes, run(scenes), strict=True):
        state, trap = result.state, setup.effects[1]
        r, q = state["position"], state["charge"]
        gap = r[None] - r[:, None]
        distance = np.linalg.norm(gap, axis=2) + np.eye(len(r))
        expected = -(K_E * q[:, None] * q / distance**3)[..., None] * gap
        expected = expected.sum(axis=1) - trap.stiffness * (r - np.array(trap.centre))
        expected += state["mass"][:, None] * np.array(trap.shake) * np.cos(trap.omega * result.time)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(state["force"], expected, rtol=1e-13, atol=1e-13 * scale)


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
    """Velocities are normal with variance sigma^2 t; the field sums the kicks; each kick is counted."""
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
    """Two designs in one batch each have their own numbers, including vectors, as in separate runs."""
    one = charges([[1, 0, 0]], [[0, 0, 0]], [0.0], {"stiffness": 1.0, "centre": (0, 1, 0)}, dt=0.1, steps=5)
    two = charges([[1, 0, 0]], [[0, 0, 0]], [0.0], {"stiffness": 9.0, "centre": (0, 0, 2)}, dt=0.05, steps=20)
    together, alone = run([one, two, one]), [run([one])[0], run([two])[0]]
    for a, b in zip(together, [*alone, alone[0]], strict=True):
        assert a.work == b.work
        for name in a.state:
            np.testing.assert_array_equal(a.state[name], b.state[name])
    assert np.abs(together[0].state["position"] - together[1].state["position"]).max() > 0.1


@pytest.mark.slow
def test_unused_fields_are_not_allocated():
    """Only the fields, bytes, counters and phases of a scene's own effects are allocated."""
    core = {"position", "velocity", "mass", "radius", "id"}
    bare = Simulation(scene([[0, 0, 0]], [[0, 0, 0]]), worlds=3, capacity=7)
    assert {f.name for f in bare.s.fields} == core
    assert sum(bare.s.bytes().values()) == 3 * 7 * (8 * (3 + 3 + 1 + 1) + 4)
    assert set(bare.s.counters) == {"steps", "particle_steps"}
    assert not any(
        word in name for name in bare.program.names() for word in ("Force", "Kick", "FindContacts", "Bid")
    )
    extra = {
        # Verlet compares the forces before and after a step.
        (Trap(stiffness=1),): {"force", "force_before"},
        (Coulomb(),): {"charge", "force", "force_before"},
        (RandomKicks(sigma=1),): {"kicked"},
        (Impact(hardness=1),): set(),
        (Impact(hardness=1), Agglomeration()): set(),
    }
    for effects, more in extra.items():
        simulation = Simulation(scene([[0, 0, 0]], [[0, 0, 0]], effects), worlds=3, capacity=7)
        assert {f.name for f in simulation.s.fields} == core | more
        assert ("kicks" in simulation.s.counters) == isinstance(effects[0], RandomKicks)
        simulation.close()
    bare.close()


@pytest.mark.long
def test_other_designs_compile_nothing():
    """Loading and running a second design takes a small part of the time of the first."""
    first = scene([[1, 0, 0]], [[0, 0, 0]], (Trap(stiffness=1.0),), dt=1e-3, steps=3)
    second = scene([[2, 0, 0], [3, 0, 0]], np.zeros((2, 3)), (Trap(stiffness=7.0),), dt=5e-4, steps=3)
    simulation = Simulation(first, worlds=2, capacity=2)
    seconds = []
    for setup in (first, second):
        began = time.process_time()
        simulation.load([setup])
        simulation.run()
        seconds.append(time.process_time() - began)
        assert simulation.results()[0].status.ok
    assert seconds[1] < seconds[0] / 5
    assert len(simulation.results()[0].state["mass"]) == 2
    simulation.close()


@pytest.mark.long
def test_a_scene_of_another_structure_is_refused():
    simulation = Simulation(scene([[0, 0, 0]], [[0, 0, 0]], (Trap(stiffness=1.0),)))
    with pytest.raises(InputError, match="scene must be of the structure compiled; received"):
        simulation.load([scene([[0, 0, 0]], [[0, 0, 0]])])
    simulation.close()


def test_a_scene_finds_effects_by_name():
    """Without a registry: any existing class can be named in a file."""
    setup = charges([[0, 0, 0]], [[0, 0, 0]], [1.0], {"stiffness": 2.0})
    again = Scene.from_dict(setup.to_dict())
    assert again.digest() == setup.digest()
    assert [type(e) for e in again.effects] == [Coulomb, Trap]
    assert again.stepper == fixed(1e-9)


FORCES = sorted(
    (k for k in known_effects() if issubclass(k, Force | PairForce)), key=lambda kind: kind.kind()
)


@pytest.mark.parametrize("kind", FORCES, ids=[kind.kind() for kind in FORCES])
def test_a_force_that_gives_its_derivatives_by_velocity_depends_on_it(kind):
    assert kind.depends_on_velocity or not (issubclass(kind, Force) and kind.offers("velocity_jacobian"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORCES, ids=[kind.kind() for kind in FORCES])
def test_forces_declare_dependence_on_velocity(kind):
    """Forces after a step in which nothing moves, at the same positions with and without velocity
    and spin."""
    data = copy.deepcopy(extremes.scenes()[f"effects.{kind.kind()}"])
    control = {"kind": "fixed_step", "dt": 1e-12}
    stepper = "boris" if kind is Lorentz else "verlet"
    data |= {"duration": 1e-12, "stepper": {"kind": stepper, "control": control}}
    data["particles"]["quantities"] |= {"anchor": [[0.0, 0.0, 1e-3]] * 3} if kind is Tether else {}
    if kind is ContactFriction:
        # Its sticking force contains the time step.
        data["effects"]["contact_friction"]["stiffness"] = 1e18
    effects = Scene.from_dict(data).effects
    at_rest = copy.deepcopy(data)
    at_rest["particles"]["velocity"] = [[0.0, 0.0, 0.0]] * 3
    if "spin" in at_rest["particles"]["quantities"]:
        at_rest["particles"]["quantities"]["spin"] = [[0.0, 0.0, 0.0]] * 3
    moving, resting = (simulate([Scene.from_dict(one)])[0].state["force"] for one in (data, at_rest))
    depends = any(one.depends_on_velocity for one in effects if isinstance(one, Force | PairForce))
    assert np.abs(moving).max() > 0
    assert (np.abs(moving - resting).max() > 1e-6 * np.abs(moving).max()) == depends
