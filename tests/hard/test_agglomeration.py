"""Hard cases of agglomeration: right, or a clear failure with the last good state; never NaN or a hang."""

import numpy as np
import pytest

from tests.scenes import (
    DENSITY,
    GRAIN,
    HEAT_CAPACITY,
    RADIUS,
    by_id,
    compiled,
    energy,
    fixed,
    flow,
    head_on,
    momentum,
    scene,
    simulate,
)
from tests.test_impact import GAS_CONSTANT
from tests.test_operators import laws
from tests.test_schedules import BATCH
from tisim import Box
from tisim._taichi import ti
from tisim.effect import Operator, parameter
from tisim.effects.friction import Friction
from tisim.effects.heating import DeformationWork, Heating
from tisim.effects.impact import Impact
from tisim.effects.reaction import Reaction
from tisim.effects.softening import Softening
from tisim.operators.fragmentation import Fragmentation
from tisim.steppers.controller import ApproachTime
from tisim.steppers.verlet import Verlet


def run(scenes):
    """With room for 200, in the batch that test_schedules has compiled."""
    return simulate(scenes, worlds=BATCH, capacity=200, schedule="world")


def check_sums(result):
    """Mass, volume and momentum to rounding; energy, with all its books, to that of what has passed."""
    start, end = result.start, result.state
    assert result.status.ok, result.status.reason
    assert all(np.isfinite(values).all() for values in end.values())
    assert end["mass"].sum() == pytest.approx(start["mass"].sum(), rel=1e-14)
    assert (end["radius"] ** 3).sum() == pytest.approx((start["radius"] ** 3).sum(), rel=1e-13)
    size = (start["mass"] * np.linalg.norm(start["velocity"], axis=1)).sum()
    np.testing.assert_allclose(momentum(end), momentum(start), rtol=0, atol=1e-13 * size)
    assert energy(end) == pytest.approx(energy(start), rel=1e-12)


def test_all_particles_merge_into_one():
    """Everything bonds, images across the faces: one sphere of all mass, and it travels on, to rounding."""
    made = flow(seed=5, grains=150, hardness=10.0, side=0.016, images=True, duration=0.05)
    (result,) = run([made])
    check_sums(result)
    assert len(result.state["mass"]) == 1
    assert result.work["merges"] == 149
    assert result.state["radius"][0] == pytest.approx(150 ** (1 / 3) * RADIUS, rel=1e-13)
    np.testing.assert_allclose(
        result.state["velocity"][0], momentum(result.start) / (150 * GRAIN), rtol=1e-12
    )


def test_a_long_violent_flow_keeps_its_sums_and_books():
    """Grains merge, break and cool for thousands of steps; nothing is lost."""
    worlds = [
        flow(
            seed=k,
            grains=80,
            hardness=h,
            surface_energy=g,
            grain_mass=GRAIN / 2,
            threshold=0.79,
            duration=4e-3,
        )
        for k, (h, g) in enumerate([(3e5, 10.0), (3e6, 1.0), (3e6, 30.0), (1e7, 3.0)])
    ]
    results = run(worlds)
    for result in results:
        check_sums(result)
        assert result.state["mass"].min() >= GRAIN / 2 * (1 - 1e-6)
    assert sum(r.work["fractures"] for r in results) > 30
    assert sum(r.work["merges"] for r in results) > 100


def test_fragments_of_one_grain_fill_every_slot():
    """Two grains of 32 break into all 64: exactly the room there is, nothing lost."""
    radius = RADIUS * 32 ** (1 / 3)
    made = head_on(
        1e3, laws(1.0, surface_energy=1.0), radius=radius, dt=1e-15, quantities={"temperature": 300.0}
    )
    assert made.capacity() == 64
    (result,) = simulate([made], worlds=64, capacity=64)
    check_sums(result)
    assert len(result.state["mass"]) == 64
    np.testing.assert_allclose(result.state["mass"], GRAIN, rtol=1e-13)
    assert np.unique(result.state["id"]).tolist() == list(range(64))


class Optimist(Fragmentation):
    """Thinks that less room is enough."""

    def capacity(self, masses):
        return 64


def test_more_fragments_than_room_is_a_clear_failure():
    """The world stops, says so, names the grain, and keeps the last good state; others of the batch go on."""
    effects = (
        Impact(hardness=1.0),
        Heating(heat_capacity=HEAT_CAPACITY),
        Optimist(surface_energy=1.0, grain_mass=GRAIN),
    )
    radius = RADIUS * 100 ** (1 / 3)
    full, fine = (
        head_on(v, effects, radius=radius, dt=1e-15, steps=4, quantities={"temperature": 300.0})
        for v in (1e3, 1e-3)
    )
    broken, whole = simulate([full, fine], worlds=2, capacity=64)
    assert not broken.status.ok
    assert "more fragments than there is room for" in broken.status.reason
    assert "at particle 0" in broken.status.reason
    assert "at t = " in broken.status.reason
    for name in ("position", "velocity", "mass", "radius", "temperature"):
        np.testing.assert_array_equal(broken.state[name], broken.start[name])
    assert whole.status.ok
    assert len(whole.state["mass"]) == 2


def flip_flop(a0=0.0, af=1.0, pressure=0.5, iterations=200):
    """Z04's own fixed point: e_(K+1) = max(1 - I_n / (2 a(e_K) H), 0) from e = 0, at constant hardness."""
    e, seen = 0.0, []
    for _ in range(iterations):
        e = max(1 - pressure / (a0 + (af - a0) * (1 - e)) if (1 - e) * (af - a0) + a0 > 0 else 0.0, 0.0)
        seen.append(e)
    return np.array(seen)


def test_the_papers_own_iteration_never_settles_and_ours_does():
    """x = 1 - e -> p / x flips between 1 and p for ever; here the pair is solved: e = 1 - sqrt(p)."""
    seen = flip_flop(pressure=0.5)
    assert np.ptp(seen[-2:]) == pytest.approx(0.5), "bond, rebound, bond, ..."
    hardness, speed = 1e6, 0.0
    speed = np.sqrt(0.5 * 3 * hardness / (2 * DENSITY))
    (result,) = simulate([head_on(speed, (Impact(hardness=hardness),))], worlds=300, capacity=2)
    v = result.state["velocity"][:, 0]
    assert (v[1] - v[0]) / (2 * speed) == pytest.approx(1 - np.sqrt(0.5), abs=1e-9)


def coupled(speed, iterations=200, q=3000.0, alpha=3e4, c=HEAT_CAPACITY, **more):
    """Strong coupling of heat and hardness: near the adhesion speed hot is soft, soft is hot."""
    effects = (
        Impact(hardness=1e5, max_iterations=iterations, **more),
        Friction(coefficient=0.9),
        Heating(heat_capacity=c),
        DeformationWork(),
        Softening(activation_energy=q),
        Reaction(energy_density=alpha),
    )
    return head_on(speed, effects, dt=1e-15, quantities={"temperature": 300.0})


def test_iterations_across_the_bond_threshold_settle():
    """A fine scan of speeds through the threshold: each impact settles, within its bound of iterations."""
    speeds = np.linspace(1.0, 40.0, 300)
    results = simulate([coupled(v) for v in speeds], worlds=300, capacity=2)
    e = []
    for v, result in zip(speeds, results, strict=True):
        assert result.work["unsettled"] == 0
        assert 1 <= result.work["iterations"] <= 200
        u = result.state["velocity"][:, 0]
        e.append((u[1] - u[0]) / (2 * v))
    bonds = np.array([result.work["bonds"] for result in results])
    assert 0 < bonds.sum() < 300, "the scan must cross the threshold"
    assert (np.diff(bonds) >= 0).all(), "it bonds from one speed on, once and for all"
    assert (np.diff(e) <= 1e-9).all()


def test_unsettled_impacts_are_bounded_and_counted():
    """With too few iterations allowed the run goes on, within its bound, and it is reported."""
    results = simulate(
        [coupled(v, iterations=2, tolerance=1e-15) for v in (3.0, 5.0, 8.0)], worlds=3, capacity=2
    )
    for result in results:
        assert result.status.ok
        assert result.work["iterations"] <= 2
        assert energy(result.state) == pytest.approx(energy(result.start), rel=1e-13)
    assert sum(result.work["unsettled"] for result in results) >= 1


@pytest.mark.parametrize("temperature", [0.0, 1e-30, 1e-3, 1.0, 1e6, 1e9])
def test_extreme_temperatures(temperature):
    """exp(Q / (R T)) overflows below 0.4 K; T^4 is 1e36 at 1e9 K. Books close and all stays finite."""
    made = flow(seed=8, grains=60, hardness=1e5, duration=2e-4)
    data = made.to_dict()
    data["particles"]["quantities"]["temperature"] = temperature
    (result,) = run([type(made).from_dict(data)])
    assert result.status.ok, result.status.reason
    assert all(np.isfinite(values).all() for values in result.state.values())
    assert (result.state["temperature"] >= 0).all()
    assert energy(result.state) == pytest.approx(energy(result.start), rel=1e-11)
    assert result.work["impacts"] > 10
    assert result.work["unsettled"] == 0


def test_cold_grains_are_hard_and_hot_ones_as_hard_as_h0():
    """At 1 mK nothing bonds that would at room temperature; at 1e9 K the hardness is H_0."""
    q = 1000.0
    speed = 0.5 * np.sqrt(3 * 1e5 * np.exp(q / GAS_CONSTANT / 300) / (2 * DENSITY))
    effects = (Impact(hardness=1e5), Heating(heat_capacity=1e12), Softening(activation_energy=q))
    # So large a heat capacity that the impact itself does not matter.
    e = []
    for result in simulate(
        [head_on(speed, effects, dt=1e-15, quantities={"temperature": t}) for t in (1e-3, 300.0, 1e9)],
        worlds=300,
        capacity=2,
    ):
        v = result.state["velocity"][:, 0]
        e.append((v[1] - v[0]) / (2 * speed))
    hot = np.sqrt(3 * 1e5 / (2 * DENSITY))
    np.testing.assert_allclose(e, [1.0, 0.5, 1 - speed / hot], atol=1e-9)


def test_two_leave_the_box_in_one_step_and_meet_inside_it():
    """Both cross the face, one of them twice over; wrapped, they overlap, and collide once there."""
    box = Box(low=(0.0,) * 3, high=(1.0,) * 3, images=False)
    place = [[0.9, 0.5, 0.5], [0.95, 0.5, 0.5]]
    # After one second: 0.1 + 2 and 0.1005 + 1; the first is faster, and behind.
    speed = [[1.2, 0, 0], [0.1515, 0, 0]]
    made = scene(
        place,
        speed,
        flow(hardness=1e12).effects,
        domain=box,
        stepper=Verlet(control=ApproachTime(shortest=1.0, longest=1.0)),
        duration=1.0,
        quantities={"temperature": 300.0},
    )
    (result,) = run([made])
    check_sums(result)
    assert result.work["impacts"] == 1
    np.testing.assert_allclose(by_id(result)["position"][:, 0], [0.1, 0.1015], atol=1e-12)
    assert by_id(result)["velocity"][0, 0] < by_id(result)["velocity"][1, 0]


def test_step_control_at_its_floor():
    """Gaps far smaller than v times the shortest step: the step rests on its floor, the run ends."""
    grains = 12
    place = np.arange(grains)[:, None] * [2 * RADIUS * (1 + 1e-9), 0, 0]
    speed = np.where(np.arange(grains) % 2, -50.0, 50.0)[:, None] * [1.0, 0, 0]
    box = Box(low=(-1.0,) * 3, high=(1.0,) * 3, images=False)
    base = flow(hardness=1e9, duration=2e-4)
    made = base.replace(
        {
            "particles": scene(place, speed, density=DENSITY, quantities={"temperature": 300.0}).to_dict()[
                "particles"
            ],
            "domain": {"kind": "box", "low": box.low, "high": box.high, "images": False},
        }
    )
    simulation = compiled(made, BATCH, 200, "world")
    simulation.load([made])
    simulation.run(steps=1)
    (first,) = simulation.results()
    assert first.time == 1e-6, "gap over speed would be 2e-14 s"
    (result,) = run([made])
    check_sums(result)
    assert result.time == 2e-4
    assert result.work["steps"] <= 201, "never shorter than the floor of 1e-6 s"
    assert result.work["impacts"] >= grains - 1
    order = np.argsort(by_id(result)["position"][:, 0])
    np.testing.assert_array_equal(order, np.arange(grains), "none has passed through another")


def test_thin_flow_takes_its_longest_step():
    """Nothing near anything: the step is its ceiling, and a grain alone crosses its time in few steps."""
    (result,) = run([flow(seed=3, grains=1, duration=0.01)])
    assert result.status.ok
    assert result.work["steps"] == 10


class Poison(Operator):
    """At a step, makes something of one particle not finite; each flag spoils one quantity."""

    needs = ("temperature",)
    at_step: float = parameter("", 0.0)
    victim: float = parameter("", 0.0)
    velocity: float = parameter("", 0.0)
    position: float = parameter("", 0.0)
    temperature: float = parameter("", 0.0)
    overflow: float = parameter("", 0.0)

    @ti.func
    def particle(self, s, w, i, dt):
        if s.steps[w] == self.at_step(w) and s.id[w, i] == self.victim(w):
            if self.velocity(w) > 0.0:
                s.velocity[w, i][1] = ti.math.nan
            if self.position(w) > 0.0:
                s.position[w, i][2] = ti.math.nan
            if self.temperature(w) > 0.0:
                s.temperature[w, i] = ti.math.nan
            if self.overflow(w) > 0.0:
                s.velocity[w, i][0] = 1e300 * 1e300


class TestFailureOfOneWorld:
    """A grain turns to NaN in mid-run, in one of three worlds."""

    @staticmethod
    def poisoned(what, when=50, seed=9):
        base = flow(seed=seed, grains=30, hardness=1e7, duration=2e-4, stepper=fixed(1e-6))
        poison = Poison(at_step=when, victim=17, **{what: 1.0} if what else {})
        return type(base)(
            **{**{n: getattr(base, n) for n in type(base).model_fields}, "effects": (*base.effects, poison)}
        )

    @pytest.mark.parametrize("what", ["velocity", "position", "temperature", "overflow"])
    def test_is_named_and_kept_apart(self, what):
        clean = self.poisoned(None, seed=1)
        batch = [clean, self.poisoned(what), self.poisoned(None, seed=2)]
        simulation = compiled(clean, worlds=3, capacity=32)
        simulation.load(batch)
        for _ in range(40):
            simulation.run(steps=5)
        one, bad, two = simulation.results()
        assert not bad.status.ok
        reason = bad.status.reason
        field = "velocity" if what == "overflow" else what
        assert field in reason or "a quantity is not finite" in reason
        assert "particle 17" in reason
        at, kept = (float(part.split("t = ")[1].split(" s")[0]) for part in reason.split("kept"))
        assert 49e-6 * (1 - 1e-9) <= at <= 55e-6 * (1 + 1e-9)
        assert kept == pytest.approx(bad.time, rel=1e-5)
        assert 44e-6 < bad.time < 51e-6
        assert all(np.isfinite(values).all() for values in bad.state.values())
        assert energy(bad.state) == pytest.approx(energy(bad.start), rel=1e-12)
        for good, scene_of in ((one, clean), (two, batch[2])):
            assert good.status.ok
            (alone,) = simulate([scene_of], worlds=3, capacity=32)
            for name, values in good.state.items():
                np.testing.assert_array_equal(values, alone.state[name])
