"""Contact of Z16 where it is hardest: fast, grazing, at rest for long, sliding, spinning, twisted, hot and cold.

One structure of all its laws; each scene sets those to zero that it leaves out.
"""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from tests.scenes import by_id, compiled, fixed, scene
from tisim._taichi import ti
from tisim.effect import Force, parameter
from tisim.effects.contact import Contact
from tisim.effects.contact_bond import ContactBond
from tisim.effects.contact_dissipation import ContactDissipation
from tisim.effects.contact_friction import ContactFriction
from tisim.effects.contact_softening import ContactSoftening
from tisim.effects.gravity import Gravity
from tisim.effects.tether import Tether

pytestmark = pytest.mark.long

WORLDS, CAPACITY = 6, 12
K, R = 1e6, 1.0
"""Stiffness (N/m^2) and radius (m) of all grains here; their masses are 1 kg."""


class Held(Force):
    """A spring to the place where it is slack, for the first particles only."""

    needs = Tether.needs
    stiffness: float = parameter("N/m", ge=0)
    number: float = parameter("", 0.0, ge=0)

    @ti.func
    def force(self, s, w, i, t):
        held = ti.select(s.id[w, i] < self.number(w), self.stiffness(w), 0.0)
        return held * (s.anchor[w, i] - s.position[w, i])


def grains(
    position, velocity, dt, steps, spin=0.0, anchor=None, gravity=(0, 0, 0), held=0, damping=0.0, friction=(0, 0, 0),
    bond=(0, 0, 0.99), sensitivity=0.0, temperature=300.0,
):  # fmt: skip
    """Grains of R and 1 kg; friction is (K_f, mu_s, mu_d), bond is (K_nb, K_rb, E*) with exponent 1."""
    position = np.asarray(position, float)
    effects = (
        Contact(stiffness=K),
        ContactSoftening(sensitivity=sensitivity, reference_temperature=300.0),
        ContactDissipation(damping=damping),
        ContactFriction(stiffness=friction[0], static=friction[1], dynamic=friction[2]),
        ContactBond(stiffness=bond[0], exponent=1, grip_stiffness=bond[1], threshold=bond[2]),
        Gravity(acceleration=gravity),
        Held(stiffness=1e7, number=held),
    )
    turning = np.broadcast_to(np.asarray(spin, float), position.shape)
    quantities = {
        "spin": turning.copy(),
        "temperature": temperature,
        "anchor": position if anchor is None else np.asarray(anchor),
    }
    return scene(
        position,
        velocity,
        effects,
        R,
        mass=1.0,
        quantities=quantities,
        stepper=fixed(dt),
        duration=dt * steps,
    )


def watched(made, looks=1):
    """Results, and the states of each world at the start and after each of so many equal parts of its run."""
    simulation = compiled(made[0], WORLDS, CAPACITY)
    simulation.load(made)
    steps = max(round(m.duration / m.stepper.control.dt) for m in made)
    seen = [[by_id(result)] for result in simulation.results()]
    for _ in range(looks):
        simulation.run(steps=-(-steps // looks))
        for states, result in zip(seen, simulation.results(), strict=True):
            states.append(by_id(result))
    return simulation.results(), seen


def run(made):
    results, _ = watched(made)
    for result in results:
        assert result.status.ok, result.status.reason
    return [by_id(result) for result in results]


def area(d):
    """Of contact, Z16 (B.5). m^2."""
    return np.pi * max(R**2 - d**2 / 4, 0.0) * (d < 2 * R)


def push(d):
    """Z16 (7.3). N."""
    return K * (1 - d / (2 * R)) ** 2 * area(d)


def stored(d):
    """Energy of contact, J."""
    return quad(push, d, 2 * R)[0] if d < 2 * R else 0.0


def kinetic(state):
    """With spin, J."""
    turning = 0.4 * state["mass"] * state["radius"] ** 2 * (state["spin"] ** 2).sum(axis=1)
    return 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1) + turning).sum()


def angular_momentum(state):
    """About the origin, kg m^2/s."""
    orbit = np.cross(state["position"], state["mass"][:, None] * state["velocity"])
    return (orbit + 0.4 * (state["mass"] * state["radius"] ** 2)[:, None] * state["spin"]).sum(axis=0)


def test_head_on_beyond_the_speed_of_waves():
    """1e3 times sqrt(K R/m), the speed of waves: spheres go through each other, as the law has it, and keep
    their energy; with dissipation they lose c (closing speed) times the volume both have crossed."""
    v = 1e3 * np.sqrt(K * R)
    dt = R / v / 500
    place, speed = [[-1.5 * R, 0, 0], [1.5 * R, 0, 0]], [[v, 0, 0], [-v, 0, 0]]
    free, damped = run([grains(place, speed, dt, 1500, damping=c) for c in (0.0, 1e3)])
    np.testing.assert_allclose(free["velocity"], np.array(speed), rtol=1e-9, atol=1e-9 * v)
    assert free["position"][0, 0] > 1.4 * R
    lost = 1e3 * 2 * quad(area, 0, 2 * R)[0] * 2 * v
    before = 2 * 0.5 * v**2
    assert before - kinetic(damped) == pytest.approx(lost, rel=2e-2)


def test_grazing():
    """Past each other with 1e-3 radii of overlap: turned by the impulse of the overlap along the straight path;
    with none, not at all."""
    v, deep, reach = 100.0, 1e-3 * R, 1.0
    made = []
    for offset in (2 * R - deep, 2 * R):
        place = [[-reach, 0, 0], [reach, offset, 0]]
        made.append(grains(place, [[v, 0, 0], [-v, 0, 0]], 1e-6, 20_000))
    touched, missed = run(made)
    b = 2 * R - deep
    impulse, _ = quad(lambda x: push(np.hypot(b, x)) * b / np.hypot(b, x), -0.1, 0.1, points=[0])
    assert touched["velocity"][1, 1] == pytest.approx(impulse / (2 * v), rel=1e-3)
    assert kinetic(touched) == pytest.approx(v**2, rel=1e-9)
    np.testing.assert_array_equal(missed["velocity"], [[v, 0, 0], [-v, 0, 0]])


def column(n=10, g=10.0):
    """Places of n grains that rest on each other under gravity, from the held one up, and its anchor's."""
    gaps = [brentq(lambda d, load=g * (n - k): push(d) - load, R, 2 * R, xtol=1e-16) for k in range(1, n)]
    place = np.zeros((n, 3))
    place[1:, 2] = np.cumsum(gaps)
    anchor = place.copy()
    anchor[0, 2] = n * g / 1e7
    return place, anchor


def test_a_tall_column_rests():
    """Ten grains, 300 times the period of the softest contact: what starts in balance stays, without creep or
    heat, undamped too; what starts 1 % off keeps its energy, and with dissipation comes to rest."""
    place, anchor = column()
    more = {"anchor": anchor, "gravity": (0, 0, -10.0), "held": 1}
    off = place.copy()
    off[5:, 2] += 1e-4 * R
    still = np.zeros_like(place)
    made = [
        grains(place, still, 1e-3, 20_000, **more),
        grains(place, still, 1e-3, 20_000, friction=(1e5, 0.5, 0.4), damping=100.0, **more),
        grains(off, still, 1e-3, 20_000, **more),
        grains(off, still, 1e-3, 20_000, damping=100.0, **more),
    ]
    results, seen = watched(made, looks=40)
    assert all(result.status.ok for result in results)

    def energy(state):
        z = state["position"][:, 2]
        held = 0.5 * 1e7 * (z[0] - anchor[0, 2]) ** 2
        return kinetic(state) + sum(map(stored, np.diff(z))) + 10.0 * z.sum() + held

    rest = energy(seen[0][0])
    scale = energy(seen[2][0]) - rest
    for states in seen[:2]:
        for state in states:
            print(np.abs(state["position"] - place).max(), kinetic(state))
    print([(energy(s) - rest) / scale for s in seen[2]])
    print([(energy(s) - rest) / scale for s in seen[3]], kinetic(seen[3][-1]) / scale)
    assert 0


def test_friction_just_below_and_just_above_its_angle():
    """A grain pressed between two that are held, and pulled sideways by 0.99 and by 1.01 of what static
    friction can hold: it creeps, at the speed at which Z16's regularised stick, K_f A dt u, carries the load
    (7.13); or it slips, and gains speed by what dynamic friction leaves over."""
    d, dt, steps = 1.9 * R, 1e-4, 2000
    normal, k_f, mu_s, mu_d = push(d), 5e7, 0.5, 0.3
    place = [[0, 0, -d], [0, 0, d], [0, 0, 0]]
    hold = 2 * mu_s * normal
    anchor = np.array(place, float)
    anchor[0, 2] += normal / 1e7
    anchor[1, 2] -= normal / 1e7
    creep = {f: f * hold / (2 * k_f * area(d) * dt) for f in (0.99, 1.01)}
    made = []
    for f in (0.99, 1.01):
        pulled = grains(
            place,
            np.zeros((3, 3)),
            dt,
            steps,
            gravity=(f * hold, 0, 0),
            held=2,
            friction=(k_f, mu_s, mu_d),
            anchor=anchor,
        )
        made.append(pulled)
    results, seen = watched(made, looks=4)
    for f, states in zip(creep, seen, strict=True):
        print(f, creep[f], hold, normal, area(d))
        for s in states:
            print(s["position"][:, 0], s["velocity"], s["spin"][2])
    assert 0


def spinning(position, spin, velocity=0.0, **more):
    still = np.broadcast_to(np.asarray(velocity, float), (2, 3))
    return grains(position, still, 1e-5, 40_000, spin=spin, **more)


BONDED = {"bond": (1e5, 0.0, 0.05)}
DEEP = 1.8 * R
"""Distance at which bond and contact balance: K E^2 = K_nb E at E = 0.1."""


def test_a_spinning_pair_never_gains_energy():
    """Bonded grains that rub, roll and twist: with spin and what contact and bond store, energy never rises
    from one look to the next, and angular momentum is that of the start."""
    place = [[-DEEP / 2, 0.1, 0], [DEEP / 2, 0.1, 0]]
    made = [
        spinning(place, spin, friction=(1e6, 0.5, 0.3), **BONDED)
        for spin in ([[0, 0, 5.0], [0, 0, 5.0]], [[0, 0, 5.0], [0, 0, -5.0]], [[3.0, 4, 1], [-2, 1, 7]])
    ]
    results, seen = watched(made, looks=40)

    def energy(state):
        d = np.linalg.norm(state["position"][1] - state["position"][0])
        pull, _ = quad(lambda x: 1e5 * (1 - x / (2 * R)) * area(x), d, DEEP)
        return kinetic(state) + stored(d) - stored(DEEP) - pull

    for result, states in zip(results, seen, strict=True):
        assert result.status.ok
        e = np.array([energy(state) for state in states])
        l = np.array([angular_momentum(state) for state in states])
        print(e, np.abs(l - l[0]).max())
    assert 0


def test_a_bonded_pair_under_torsion():
    """Spins along the line of centres meet no resistance: Z16's grip acts on slip, and twisting is none. Spins
    across it, both alike, end in a rigid rotation of the pair by the angular momentum that they had."""
    place = [[-DEEP / 2, 0, 0], [DEEP / 2, 0, 0]]
    grip = {"bond": (1e5, 1e6, 0.05)}
    twist, shear = run([
        spinning(place, [[2.0, 0, 0], [-2.0, 0, 0]], **grip),
        spinning(place, [[0, 0, 1.0], [0, 0, 1.0]], **grip),
    ])  # fmt: skip
    np.testing.assert_allclose(twist["spin"], [[2, 0, 0], [-2, 0, 0]], rtol=1e-12)
    np.testing.assert_allclose(twist["position"], place, rtol=0, atol=1e-12)
    inertia = 2 * 0.4 * R**2
    rate = inertia / (inertia + DEEP**2 / 2)
    print(shear, rate)
    assert 0


def test_softening_from_absolute_zero_to_a_thousand_times_hotter():
    """exp(-a (T/T* - 1)) at a = 1e3: cold grains are beyond numbers, said clearly; hot ones do not push."""
    place, still = [[0, 0, 0], [1.8 * R, 0, 0]], np.zeros((2, 3))
    made = [grains(place, still, 1e-6, 10, sensitivity=1e3, temperature=t) for t in (0.0, 300.0, 3e5)]
    (cold, warm, hot), _ = watched(made)
    assert "effects.contact, at particle 0" in cold.status.reason
    np.testing.assert_array_equal(cold.state["velocity"], 0.0)
    np.testing.assert_array_equal(hot.state["velocity"], 0.0)
    assert warm.state["velocity"][1, 0] == pytest.approx(push(1.8 * R) * 1e-5, rel=1e-3)
