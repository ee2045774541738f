"""Impact of two grains against an independent twin, its closed forms, and what must be conserved in it."""

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.scenes import HEAT_CAPACITY, energy, head_on, momentum, scene, simulate
from tisim.effects.friction import Friction
from tisim.effects.heating import DeformationWork, Heating
from tisim.effects.impact import Impact
from tisim.effects.reaction import Reaction
from tisim.effects.softening import Softening

PAIRS = 300
DT = 1e-9
GAS_CONSTANT = 8.31446261815324

COMBINATIONS = {
    "impact": (),
    "friction": (Friction,),
    "heat": (Friction, Heating, DeformationWork, Reaction),
    "soft": (Heating, Softening),
    "all": (Friction, Heating, DeformationWork, Softening, Reaction),
}


def draw(rng):
    """One random oblique impact, as plain numbers: unequal grains, any direction, some hard and some soft."""
    radii = 1e-3 * 4.0 ** rng.uniform(0, 1, 2)
    density = 10.0 ** rng.uniform(3, 4, 2)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    aside = rng.normal(size=3)
    v_n, v_t = 10.0 ** rng.uniform(0, 2), 10.0 ** rng.uniform(-2, 2)
    aside -= aside @ normal * normal
    v_i = rng.normal(size=3) * 50
    return {
        "radius": radii,
        "mass": density * 4 / 3 * np.pi * radii**3,
        "position": np.array([[0.0, 0, 0], normal * radii.sum() * (1 - 1e-9)]) + rng.normal(size=3),
        "velocity": np.array([v_i, v_i - v_n * normal + v_t * aside / np.linalg.norm(aside)]),
        "temperature": rng.uniform(100, 1000, 2),
        # So that |I_n| / (2 a H), cold, lies between 0.01 and 3 at e = 0.
        "hardness": density.mean() * v_n**2 * 10.0 ** rng.uniform(-1, 1.5),
        "beta": rng.uniform(0.5, 1.5),
        "a0": rng.choice([0.0, 0.3]),
        "af": rng.uniform(0.5, 1.0),
        "friction": 10.0 ** rng.uniform(-2, 0),
        "q": rng.uniform(0, 1000),
        "alpha": 10.0 ** rng.uniform(2, 5) * v_n**2 * radii.min() * 1e-2,
    }


def effects(pair, kinds):
    """The effects of a pair, those of ``kinds`` among them."""
    made = {
        Friction: lambda: Friction(coefficient=pair["friction"]),
        Heating: lambda: Heating(heat_capacity=HEAT_CAPACITY),
        DeformationWork: DeformationWork,
        Softening: lambda: Softening(activation_energy=pair["q"]),
        Reaction: lambda: Reaction(energy_density=pair["alpha"]),
    }
    impact = Impact(
        hardness=pair["hardness"],
        deformation_length=pair["beta"],
        initial_area=pair["a0"],
        final_area=pair["af"],
        tolerance=1e-14,
    )
    return (impact, *(made[kind]() for kind in kinds))


def as_scene(pair, kinds):
    return scene(
        pair["position"],
        pair["velocity"],
        effects(pair, kinds),
        radius=pair["radius"],
        mass=pair["mass"],
        dt=DT,
        quantities={"temperature": pair["temperature"]},
    )


def twin(pair, kinds):
    """The impact by Z04's equations in e itself, the coupled e-T problem by bracketing; no fixed point."""
    m, b, v, t = pair["mass"], pair["radius"], pair["velocity"], pair["temperature"]
    r = pair["position"] + DT * v
    n = (r[1] - r[0]) / np.linalg.norm(r[1] - r[0])
    u_n, u_t = v @ n, v - np.outer(v @ n, n)
    approach = u_n[0] - u_n[1]
    least = b.min()

    def outcome(e):
        """Velocities, temperatures and energies for a restitution e (2.1)-(2.5), (4.17), (6.8)-(6.10)."""
        common = (m @ u_n) / m.sum()
        after_n = common + np.array([-1, 1]) * e * approach * m[::-1] / m.sum()
        time = 2 * pair["beta"] * least / approach * (1 + e)
        force = abs(m[0] * (after_n[0] - u_n[0]) / time)
        after_t = u_t.copy()
        slip = u_t[0] - u_t[1]
        if e == 0:
            after_t[:] = (m @ u_t) / m.sum()
        elif Friction in kinds and np.linalg.norm(slip) > 0:
            pull = min(pair["friction"] * force * time, np.linalg.norm(slip) / (1 / m).sum())
            after_t -= np.outer(np.array([1, -1]) * pull / m, slip / np.linalg.norm(slip))
        after = np.outer(after_n, n) + after_t
        # In the frame of the pair's centre of mass (see impact.py on the paper's split).
        centre = (m @ v) / m.sum()
        lost = 0.5 * m * (((v - centre) ** 2).sum(axis=1) - ((after - centre) ** 2).sum(axis=1))
        area = (pair["a0"] + (pair["af"] - pair["a0"]) * (1 - e)) * np.pi * least**2
        work = m.prod() / m.sum() * approach**2 * (1 - e**2) / 3 * (DeformationWork in kinds)
        heat = pair["alpha"] * area * (Reaction in kinds)
        hot = t + (lost + work + heat) / (m * HEAT_CAPACITY) * (Heating in kinds)
        hard = pair["hardness"] * np.exp(pair["q"] / (GAS_CONSTANT * hot) * (Softening in kinds))
        return after, hot, force, area, hard.min(), work, heat

    def excess(e):
        """Below zero where (3.1) asks for more restitution than e."""
        _, _, force, area, hard, _, _ = outcome(e)
        return e - (1 - force / (2 * area * hard))

    # The root nearest to bonding, where the paper's iteration starts.
    e = 0.0
    if excess(0.0) < 0:
        grid = 1 - np.geomspace(1, 1e-6, 300)
        first = next(k for k in range(1, len(grid)) if excess(grid[k]) >= 0)
        e = brentq(excess, grid[first - 1], grid[first], xtol=1e-16, rtol=1e-14)
    after, hot, _, _, _, work, heat = outcome(e)
    return {"velocity": after, "temperature": hot, "work": work, "heat": heat, "e": e}


@pytest.fixture(scope="module", params=COMBINATIONS, ids=str)
def impacts(request):
    """The same random pairs under each combination of laws, as the worlds of one batch."""
    kinds = COMBINATIONS[request.param]
    rng = np.random.Generator(np.random.Philox(11))
    pairs = [draw(rng) for _ in range(PAIRS)]
    results = simulate([as_scene(pair, kinds) for pair in pairs], worlds=PAIRS, capacity=2)
    assert all(result.work["impacts"] == 1 for result in results)
    assert all(result.work["unsettled"] == 0 for result in results)
    return kinds, pairs, results


def test_impact_is_its_twin(impacts):
    kinds, pairs, results = impacts
    seen = set()
    for pair, result in zip(pairs, results, strict=True):
        expected = twin(pair, kinds)
        speed = np.abs(pair["velocity"][0] - pair["velocity"][1]).max()
        np.testing.assert_allclose(
            result.state["velocity"], expected["velocity"], rtol=1e-12, atol=1e-10 * speed
        )
        assert result.work["bonds"] == (expected["e"] == 0)
        if Heating in kinds:
            np.testing.assert_allclose(result.state["temperature"], expected["temperature"], rtol=1e-10)
        if Reaction in kinds:
            np.testing.assert_allclose(result.state["reaction_heat"], expected["heat"], rtol=1e-10)
        if DeformationWork in kinds:
            np.testing.assert_allclose(
                result.state["deformation_work"], expected["work"], rtol=1e-9, atol=1e-300
            )
        seen.add(expected["e"] == 0)
    assert seen == {True, False}, "the sample must hold bonds and rebounds"


def test_impact_conserves_momentum_and_energy(impacts):
    kinds, pairs, results = impacts
    for pair, result in zip(pairs, results, strict=True):
        before = pair["mass"] @ pair["velocity"]
        scale = (pair["mass"] * np.linalg.norm(pair["velocity"], axis=1)).sum()
        np.testing.assert_allclose(momentum(result.state), before, rtol=0, atol=4e-16 * scale)
        if Heating in kinds:
            start = dict(result.start)
            assert energy(result.state) == pytest.approx(energy(start), rel=2e-14)


def test_friction_slows_slip_and_never_reverses_it(impacts):
    kinds, pairs, results = impacts
    stuck = slid = 0
    for pair, result in zip(pairs, results, strict=True):
        apart = pair["position"] + DT * pair["velocity"]
        n = (apart[1] - apart[0]) / np.linalg.norm(apart[1] - apart[0])
        before, after = (v[0] - v[1] for v in (pair["velocity"], result.state["velocity"]))
        before, after = before - before @ n * n, after - after @ n * n
        size = np.linalg.norm(before)
        rounding = 1e-14 * np.abs(pair["velocity"]).max()
        assert after @ before >= -rounding * size
        assert np.linalg.norm(after) <= size + rounding
        if Friction not in kinds and not result.work["bonds"]:
            np.testing.assert_allclose(after, before, rtol=0, atol=10 * rounding)
        stuck += np.linalg.norm(after) < 10 * rounding
        slid += np.linalg.norm(after) > 0.01 * size
    assert stuck
    assert slid


def test_restitution_leaves_the_approach_times_e(impacts):
    """Separation speed over approach speed lies in 0..1, and is 0 exactly for those that bond."""
    _, pairs, results = impacts
    for pair, result in zip(pairs, results, strict=True):
        apart = pair["position"] + DT * pair["velocity"]
        n = (apart[1] - apart[0]) / np.linalg.norm(apart[1] - apart[0])
        gone = (result.state["velocity"][1] - result.state["velocity"][0]) @ n
        came = (pair["velocity"][0] - pair["velocity"][1]) @ n
        e = gone / came
        rounding = 1e-13 * np.abs(pair["velocity"]).max() / came
        assert -rounding <= e < 1
        assert (e <= rounding) == bool(result.work["bonds"])


def test_impact_looks_the_same_from_a_moving_frame(impacts):
    """Galilean invariance: 1000 m/s added to all velocities changes nothing but the velocities."""
    kinds, pairs, results = impacts
    boost = np.array([1000.0, -1000.0, 1000.0])
    moving = simulate(
        [as_scene({**pair, "velocity": pair["velocity"] + boost}, kinds) for pair in pairs],
        worlds=PAIRS,
        capacity=2,
    )
    for rest, other in zip(results, moving, strict=True):
        np.testing.assert_allclose(other.state["velocity"] - boost, rest.state["velocity"], rtol=0, atol=2e-9)
        for name in ("temperature", "reaction_heat", "deformation_work"):
            if name in rest.state:
                np.testing.assert_allclose(other.state[name], rest.state[name], rtol=1e-9, atol=1e-300)
        for name in ("bonds", "impacts"):
            assert other.work[name] == rest.work[name]


def restitution(result, speed):
    v = result.state["velocity"][:, 0]
    return (v[1] - v[0]) / (2 * speed)


def test_restitution_of_equal_grains_closed_form():
    """Z04 (4.13)-(4.14) with a_0 = 0, a_f = 1: e = 1 - v/v*, v* = sqrt(3 H beta / (2 rho)), 0 above."""
    cases = []
    for hardness, beta, density in ((1e5, 1.0, 2000.0), (1e6, 0.5, 1e4), (3e5, 2.0, 1e3)):
        critical = np.sqrt(3 * hardness * beta / (2 * density))
        for part in (1e-3, 0.2, 0.7, 0.999, 1.5):
            cases.append((hardness, beta, density, part, part * critical))
    results = simulate(
        [
            head_on(v, (Impact(hardness=h, deformation_length=beta),), density=density, dt=1e-12)
            for h, beta, density, _, v in cases
        ],
        worlds=PAIRS,
        capacity=2,
    )
    for (*_, part, v), result in zip(cases, results, strict=True):
        assert restitution(result, v) == pytest.approx(max(1 - part, 0), abs=1e-10)
        assert result.work["bonds"] == (part > 1)


def test_restitution_for_any_contact_areas_closed_form():
    """Z04 (4.13): D e^2 - (a_f + D) e + a_f - A = 0, D = a_f - a_0, A = 2 rho v^2 / (3 beta H)."""
    hardness, density, beta = 2e5, 3000.0, 0.8
    cases = [
        (a0, af, v)
        for a0, af in ((0.0, 1.0), (0.2, 0.9), (0.5, 0.5), (0.0, 0.3))
        for v in (0.5, 2.0, 4.0, 40.0)
    ]
    results = simulate(
        [
            head_on(
                v,
                (Impact(hardness=hardness, deformation_length=beta, initial_area=a0, final_area=af),),
                density=density,
                dt=1e-12,
            )
            for a0, af, v in cases
        ],
        worlds=PAIRS,
        capacity=2,
    )
    for (a0, af, v), result in zip(cases, results, strict=True):
        d, a = af - a0, 2 * density * v**2 / (3 * beta * hardness)
        roots = np.roots([d, -(af + d), af - a]) if d else np.array([(af - a) / af])
        expected = max(roots.real.min(), 0.0) if np.isreal(roots).all() else 0.0
        assert restitution(result, v) == pytest.approx(expected, abs=1e-10)


def test_adhesion_speed_closed_form():
    """Z04 (4.15): equal grains bond from v = sqrt(3 a_f H beta / (2 rho)) on, to 1e-10 of it."""
    hardness, density, beta, af = 2e5, 3000.0, 0.8, 0.7
    critical = np.sqrt(3 * af * hardness * beta / (2 * density))
    law = (Impact(hardness=hardness, deformation_length=beta, final_area=af),)
    below, above = simulate(
        [head_on(critical * (1 + off), law, density=density, dt=1e-12) for off in (-1e-10, 1e-10)],
        worlds=PAIRS,
        capacity=2,
    )
    assert below.work["bonds"] == 0
    assert above.work["bonds"] == 1


def test_harder_or_lighter_or_slower_never_bonds_more(rng):
    """x = 1 - e rises with approach speed; a pair that bonds at one speed bonds at every higher one."""
    pair = draw(rng)
    speeds = np.geomspace(0.1, 1e4, PAIRS)
    law = effects(pair, COMBINATIONS["all"])
    results = simulate(
        [head_on(v, law, density=4000.0, dt=1e-13, quantities={"temperature": 300.0}) for v in speeds],
        worlds=PAIRS,
        capacity=2,
    )
    e = np.array([restitution(result, v) for result, v in zip(results, speeds, strict=True)])
    assert (np.diff(e) <= 1e-12).all()
    assert e[0] > 0.9
    assert e[-1] == pytest.approx(0, abs=1e-14)


def test_pairs_that_separate_or_do_not_touch_are_left_alone():
    """An impact needs an overlap and an approach, both."""
    apart, parting = simulate(
        [
            scene([[0, 0, 0], [2.1e-3, 0, 0]], [[1, 0, 0], [0, 0, 0]], (Impact(hardness=1e5),)),
            scene([[0, 0, 0], [1.9e-3, 0, 0]], [[-1, 0, 0], [0, 0, 0]], (Impact(hardness=1e5),)),
        ],
        worlds=PAIRS,
        capacity=2,
    )
    for result in (apart, parting):
        assert result.work["impacts"] == 0
        np.testing.assert_array_equal(result.state["velocity"], result.start["velocity"])
