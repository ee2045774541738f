"""Long runs of every granular law: a column at rest, friction at its threshold, spin until everything
rests."""

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.effects.contact.granular_reference import law_of
from tests.hard.granular_scenes import ELASTIC, LAWS, grains, kinetic, loaded, lossy, push, stored
from tests.scenes import by_id, roundoff

pytestmark = pytest.mark.slow

FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
G = 10.0
"""Gravity, m/s^2."""


def looks(scenes, number):
    """States of each world at the start and after each of ``number`` equal parts of its run, which must
    succeed."""
    simulation = loaded(scenes)
    steps = max(round(one.duration / one.stepper.control.dt) for one in scenes)
    series = [[by_id(result)] for result in simulation.results()]
    for _ in range(number):
        simulation.run(steps=-(-steps // number))
        for states, result in zip(series, simulation.results(), strict=True):
            assert result.status.ok or result.status.reason == "running", result.status.reason
            states.append(by_id(result))
    return series


def balanced(name, law, n):
    """Positions of n grains of 1 kg at rest on each other and on the floor, from the contact force alone."""
    place = np.zeros((n, 3))
    for k in range(n):
        load, radius = G * (n - k), 0.5 if k else 1.0
        overlap = brentq(lambda d, f=load, r=radius: push(name, d, r, law) - f, 0, 0.9, xtol=1e-16)
        place[k, 2] = 1 - overlap if k == 0 else place[k - 1, 2] + 2 - overlap
    return place


def lasting():
    """Status of a lossy column after 100 steps."""
    law = {**ELASTIC["hooke"], **lossy("hooke")[0]}
    place = balanced("hooke", law, 10)
    more = {"planes": [FLOOR], "gravity": (0, 0, -G), "dt": 1e-4, "steps": 100_000}
    simulation = loaded([grains("hooke", place, np.zeros((10, 3)), first=law, **more)])
    simulation.run(steps=100)
    return simulation.results()[0].status.reason


def test_a_column_lasts_in_single_precision(single):
    """In single precision the square of a tiny slip underflows to zero."""
    assert single("hard.test_granular_rest", "lasting") == "running"


def springs(name, made, memory, overlap, radius):
    """Energy (J) in the springs of a contact, from its history, and the force of its tangential spring, N."""
    law, slots = law_of(made), LAWS[name].slots()
    part = {key: memory[begin : begin + size] for key, (begin, size) in slots.items()}
    which, at = np.zeros((1, 2), int), (np.array([overlap]), np.array([radius]))
    _, stiffness, *_ = law.press(which, *at)
    spring, _, _ = (values[0] for values in law.tangential_constants(which, stiffness, 0 * stiffness))
    soft, tangential = law.materials[0], np.linalg.norm(part["tangential"][:3])
    force = tangential if law.tangential == "mindlin_force" else spring * tangential
    held = force**2 / (2 * spring) if spring > 0 else 0.0
    if law.rolling == "rolling_sds":
        held += soft["rolling_stiffness"] * (part["rolling"] ** 2).sum() / 2
        held += soft["twisting_stiffness"] * (part["twisting"] ** 2).sum() / 2
    if law.rolling == "rolling_epsd" and part["rolling"][3]:
        held += (part["rolling"][:3] ** 2).sum() / (2 * part["rolling"][3])
        held += part["twisting"][0] ** 2 / (2 * part["twisting"][1])
    return held, force


def total(name, made, state, law, liquid):
    """Total energy (J) of a grain on a floor, or of a pair far above it, and the force (N) of its tangential
    spring."""
    z, n, none = state["position"][:, 2], len(state["position"]), np.zeros((2, 4))
    if n == 1:
        overlap, radius, memory = 1 - z[0], 1.0, state.get("walls_past", none)[0]
    else:
        overlap, radius = 2 - np.linalg.norm(np.diff(state["position"], axis=0)), 0.5
        past = state.get("granular_past", none)
        memory = past.reshape(n, -1, LAWS[name].memory or 4).sum(axis=(0, 1))
    height = -(state["position"] @ made.effects[3].acceleration).sum()
    wet = 2 * np.pi * liquid["surface_tension"] * 2 * radius * -overlap if liquid else 0.0
    held, force = springs(name, made, memory, overlap, radius)
    return kinetic(state).sum() + height + stored(name, overlap, radius, law) + wet + held, force


@pytest.mark.parametrize("name", LAWS)
def test_spin_in_a_lasting_contact_never_gains_energy(name):
    """A spinning grain on a floor, and a pair held by adhesion or a liquid.

    They roll, slide and twist until they rest or rotate like a top. The energy, including all springs, never
    rises between samples, except with a constant torque, which oscillates about rest by the spin of one step.
    At the start the dashpots alone exceed Coulomb's limit, so the springs are stretched against them at once.
    """
    law = {**ELASTIC[name], **lossy(name)[0]}
    liquid = {"surface_tension": 5.0, "volume": 1e-3} if name == "mindlin" else None
    spins = np.array([[3.0, 4.0, 7.0], [-5.0, 1.0, -6.0]])
    dt, steps, number = 5e-5, 80_000, 80
    more = {"first": law, "dt": dt, "steps": steps}
    floor = {"planes": [FLOOR], "gravity": (0, 0, -G)}
    made = [
        grains(name, balanced(name, law, 1), [[0.5, 0, 0]], spin[None], **floor, **more) for spin in spins
    ]
    if name != "hooke":
        pull = liquid["surface_tension"] * 2 * np.pi if liquid else 0.0
        rest = brentq(lambda d: push(name, d, 0.5, law) - pull, 0, 0.9)
        wet = {"liquid": liquid} if liquid else {}
        place, turning = [[0, 0, 5], [2 - rest, 0, 5]], np.abs(spins) / 5
        made += [grains(name, place, np.zeros((2, 3)), way * turning, **wet, **more) for way in (1, -1)]
    for one, states in zip(made, looks(made, number), strict=True):
        pair = len(states[0]["position"]) > 1
        found = [total(name, one, state, law, liquid if pair else None) for state in states]
        energies, _ = np.array(found).T
        first, last = kinetic(states[0]).sum(), kinetic(states[-1]).sum()
        most = 4 * np.pi * law.get("surface_energy", 0.0) + G
        tremble = (law["rolling_friction"] * most * dt) ** 2 if name == "dmt" else 0.0
        assert (np.diff(energies) < tremble + (1e-9 + 1e4 * roundoff()) * first).all()
        assert last < 0.9 * first


def test_a_steady_spring_in_a_rotating_pair_does_no_work():
    """A pair held by a liquid rotates like a top under a steady force T of its tangential spring.

    It moves as one rigid body with a spin about its normal. If the spring were projected along the normal at
    the end of a step, with velocities from half a step earlier, it would do the work T^2 dt / (2 m_t) per
    second, with m_t = 2/7 m*. Projected along the normal at midstep it does no work, and the damping loss
    does not depend on the step.
    """
    liquid = {"surface_tension": 5.0, "volume": 1e-3}
    law = {**ELASTIC["mindlin"], "restitution": 0.1, "friction": 1e3}
    pull = 2 * np.pi * liquid["surface_tension"]
    apart = 2 - brentq(lambda d: push("mindlin", d, 0.5, law) - pull, 0, 0.9)
    place, spin = np.array([[-apart / 2, 0, 0], [apart / 2, 0, 0]]), np.array([4.0, 0, 1.0])
    dts = np.array([2e-4, 1e-4, 5e-5])
    made = [
        grains("mindlin", place, np.cross(spin, place), np.tile(spin, (2, 1)), liquid=liquid, first=law,
               dt=dt, duration=2.0)
        for dt in dts
    ]  # fmt: skip
    simulation, found = loaded(made), []
    for until in (1.0, 2.0):
        simulation.run(until=until)
        pairs = zip(made, simulation.results(), strict=True)
        found.append([total("mindlin", one, by_id(result), law, liquid) for one, result in pairs])
    (before, _), (after, force) = (np.transpose(look) for look in found)
    gain, expected = after - before, force**2 * dts / (2 * 2 / 7 * 0.5)
    assert (expected > 2e-5 * before).all()
    rounding = 1e3 * roundoff() * before.max()
    assert (gain < rounding).all()
    assert (-gain < 0.02 * expected + rounding).all()
    np.testing.assert_allclose(gain, gain[-1], rtol=1e-3, atol=rounding)


SETTLES = {"jkr": {"viscous_time": 1e-2}, "dmt": {"damping": 100.0}}


@pytest.mark.parametrize("name", SETTLES)
def test_adhesive_pairs_rest_at_the_root_of_the_force(name):
    """Two adhesive grains without load come to rest at the root of the force computed in NumPy.

    This also holds for strong adhesion. The overlap is (3 pi gamma / (E* R*))^(2/3) R* for DMT and (pi gamma
    / E*)^(2/3) (3 R*)^(1/3) for JKR.
    """
    e_star, made, depths = 1e6 / (2 * (1 - 0.3**2)), [], []
    for energy in (20.0, 2000.0):
        law, ratio = {**ELASTIC[name], **SETTLES[name], "surface_energy": energy}, np.pi * energy / e_star
        deep = {"dmt": (3 * ratio / 0.5) ** (2 / 3) * 0.5, "jkr": ratio ** (2 / 3) * 1.5 ** (1 / 3)}
        depths.append(deep[name])
        root = brentq(lambda d, law=law: push(name, d, 0.5, law), 1e-6, 1.9)
        assert root == pytest.approx(depths[-1], rel=1e-9)
        more = {"first": law, "dt": 2e-5, "steps": 50_000}
        made.append(grains(name, [[0, 0, 9], [2 - 1e-9, 0, 9]], np.zeros((2, 3)), **more))
    for depth, states in zip(depths, looks(made, 1), strict=True):
        distance = np.linalg.norm(np.diff(states[-1]["position"], axis=0))
        assert 2 - distance == pytest.approx(depth, rel=1e-6 + 1e3 * roundoff())
