"""Operators: what merges, breaks, cools and leaves the box keeps its mass, momentum, heat and books."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.scenes import (
    DENSITY,
    GRAIN,
    HEAT_CAPACITY,
    RADIUS,
    by_id,
    energy,
    fixed,
    flow,
    head_on,
    momentum,
    scene,
    simulate,
)
from tisim import Box
from tisim.effects.friction import Friction
from tisim.effects.heating import DeformationWork, Heating
from tisim.effects.impact import Impact
from tisim.effects.reaction import Reaction
from tisim.effects.softening import Softening
from tisim.errors import InputError
from tisim.operators.agglomeration import Agglomeration
from tisim.operators.cooling import Cooling
from tisim.operators.fragmentation import Fragmentation

SIGMA = 5.670374419e-8
SOFT = 1.0
"""Pa; a hardness at which everything bonds."""


def laws(hardness=SOFT, surface_energy=1e16, grain_mass=GRAIN, threshold=2 ** (-1 / 3), tension=None):
    """All that happens in an impact, with a hardness that does not depend on temperature."""
    return (
        Impact(hardness=hardness),
        Friction(coefficient=0.1),
        Heating(heat_capacity=HEAT_CAPACITY),
        DeformationWork(),
        Softening(activation_energy=0.0),
        Reaction(energy_density=1e3),
        Fragmentation(surface_energy=surface_energy, grain_mass=grain_mass, threshold=threshold),
        Agglomeration(),
    )


def run(scenes):
    return simulate(scenes, worlds=64, capacity=64)


class TestAgglomeration:
    def pair(self, rng):
        radii = RADIUS * rng.uniform(0.3, 3, 2)
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        v = rng.normal(size=3) * 100
        return scene(
            [[0, 0, 0], radii.sum() * (1 - 1e-6) * n],
            [v, v - 3 * n + rng.normal(size=3) * 0.1],
            laws(),
            radius=radii,
            quantities={"temperature": rng.uniform(100, 1000, 2)},
        )

    def test_two_bonded_grains_become_one_sphere(self, rng):
        """Mass, momentum, volume, energy and centre of mass are those of the two; one particle is left."""
        for result in run([self.pair(rng) for _ in range(60)]):
            start, one = result.start, result.state
            assert len(one["mass"]) == result.work["merges"] == result.work["bonds"] == 1
            assert one["mass"][0] == pytest.approx(start["mass"].sum(), rel=2e-16)
            assert (one["radius"] ** 3)[0] == pytest.approx((start["radius"] ** 3).sum(), rel=1e-15)
            total = (start["mass"][:, None] * start["velocity"]).sum(axis=0)
            size = np.abs(start["mass"][:, None] * start["velocity"]).sum()
            np.testing.assert_allclose(momentum(one), total, rtol=0, atol=4e-16 * size)
            moved = start["position"] + 1e-9 * start["velocity"]
            centre = (start["mass"][:, None] * moved).sum(axis=0) / start["mass"].sum()
            np.testing.assert_allclose(one["position"][0], centre, rtol=0, atol=1e-18)
            assert energy(one) == pytest.approx(energy(start), rel=1e-14)
            # Friction makes no difference: a bonded pair has no slip left.
            assert one["temperature"][0] > (start["mass"] @ start["temperature"]) / start["mass"].sum()

    def test_bonded_grains_stay_two_where_nothing_merges_them(self):
        """Without the effect a bond is counted, the two move on together, and both remain."""
        (result,) = simulate(
            [head_on(5.0, (Impact(hardness=SOFT),), mass=[1.0, 3.0])], worlds=300, capacity=2
        )
        assert result.work["bonds"] == 1
        np.testing.assert_allclose(result.state["velocity"], [[-2.5, 0, 0]] * 2, rtol=1e-15)


class TestFragmentation:
    def break_speed(self, gamma, radius=2 * RADIUS, e=0.0, pieces=8):
        """Z04 (5.4) for n pieces: dK = 4 pi gamma b0^2 (n^(1/3) - 1), dK = m v^2 (1 - e^2) / 2."""
        return np.sqrt(6 * gamma * (pieces ** (1 / 3) - 1) / (DENSITY * radius * (1 - e * e)))

    def test_speed_that_halves_the_radius_closed_form(self):
        """Z04 (5.4): eight pieces need v = sqrt(6 gamma / (rho b0 (1 - e^2))), to 1e-10 of it."""
        gamma, hardness = 30.0, 4e5
        critical = np.sqrt(3 * hardness / (2 * DENSITY))
        v = brentq(lambda v: v - self.break_speed(gamma, e=max(1 - v / critical, 0)), 1e-3, 0.999 * critical)
        assert v < 0.9 * critical
        whole, broken = run(
            [
                head_on(
                    v * (1 + off),
                    laws(hardness, gamma, threshold=0.5),
                    radius=2 * RADIUS,
                    dt=1e-15,
                    quantities={"temperature": 300.0},
                )
                for off in (-1e-10, 1e-10)
            ]
        )
        assert whole.work["fractures"] == 0
        assert len(whole.state["mass"]) == 2
        assert broken.work["fractures"] == 2
        assert len(broken.state["mass"]) == 16

    @pytest.mark.parametrize("pieces", [2, 3, 5, 8])
    def test_default_threshold_lets_two_pieces_happen(self, pieces):
        """With b/b0 = 2^(-1/3) a grain breaks from dK for two pieces on, into as many as dK pays for."""
        gamma = 30.0
        v = self.break_speed(gamma, pieces=pieces)
        fewer, enough = run(
            [
                head_on(
                    v * (1 + off),
                    laws(SOFT, gamma),
                    radius=2 * RADIUS,
                    dt=1e-15,
                    quantities={"temperature": 300.0},
                )
                for off in (-1e-9, 1e-9)
            ]
        )
        assert len(enough.state["mass"]) == 2 * pieces
        assert len(fewer.state["mass"]) == (1 if pieces == 2 else 2 * (pieces - 1))

    def test_largest_grain_that_sticks_closed_form(self):
        """Z04 (5.5): above b0 = 4 gamma / (a_f H beta) two equal grains that bond also break into eight."""
        gamma, hardness = 30.0, 4e5
        adhesion = np.sqrt(3 * hardness / (2 * DENSITY))
        limit = 4 * gamma / hardness
        results = run(
            [
                head_on(
                    adhesion * (1 + 1e-12),
                    laws(hardness, gamma, grain_mass=DENSITY * np.pi * limit**3 / 7, threshold=0.5),
                    radius=limit * (1 + off),
                    dt=1e-15,
                    quantities={"temperature": 300.0},
                )
                for off in (-1e-9, 1e-9)
            ]
        )
        assert [len(r.state["mass"]) for r in results] == [1, 16]

    def test_pieces_keep_mass_momentum_energy_and_centre(self, rng):
        """n equal pieces in place of one: same mass, momentum, kinetic energy, volume, centre; no overlap."""
        scenes = []
        for _ in range(30):
            radii = RADIUS * rng.uniform(1.5, 2.5, 2)
            n = rng.normal(size=3)
            n /= np.linalg.norm(n)
            v = rng.normal(size=3) * 100
            scenes.append(
                scene(
                    [[0, 0, 0], radii.sum() * (1 - 1e-9) * n],
                    [v, v - rng.uniform(1, 40) * n + rng.normal(size=3)],
                    laws(1e5, 10 ** rng.uniform(-1, 1)),
                    radius=radii,
                    dt=1e-12,
                    quantities={"temperature": rng.uniform(100, 1000, 2)},
                )
            )
        broke = 0
        for result in run(scenes):
            start, end = result.start, result.state
            if result.work["fractures"] == 0:
                continue
            broke += 1
            size = np.abs(start["mass"][:, None] * start["velocity"]).sum()
            assert end["mass"].sum() == pytest.approx(start["mass"].sum(), rel=1e-15)
            assert (end["radius"] ** 3).sum() == pytest.approx((start["radius"] ** 3).sum(), rel=1e-14)
            np.testing.assert_allclose(
                momentum(end),
                (start["mass"][:, None] * start["velocity"]).sum(axis=0),
                rtol=0,
                atol=1e-15 * size,
            )
            assert energy(end) == pytest.approx(energy(start), rel=2e-14)
            # None lighter than a grain.
            assert end["mass"].min() >= GRAIN * (1 - 1e-6)
            assert len(np.unique(end["id"])) == len(end["id"])
            # Pieces of one grain share its velocity, and lie about its centre without overlap.
            for who in range(2):
                mine = np.flatnonzero(
                    np.isclose(
                        end["mass"], start["mass"][who] / self.pieces_of(end, start, who), rtol=1e-12, atol=0
                    )
                    & (np.abs(end["velocity"] - end["velocity"][end["id"] == who]) < 1e-12).all(axis=1)
                )
                n = self.pieces_of(end, start, who)
                assert len(mine) == n
                place = end["position"][mine]
                moved = start["position"][who] + 1e-12 * start["velocity"][who]
                np.testing.assert_allclose(place.mean(axis=0), moved, rtol=0, atol=1e-16)
                gaps = np.linalg.norm(place[:, None] - place, axis=2) + np.eye(n)
                assert gaps.min() >= 2 * end["radius"][mine[0]] * (1 - 1e-12)
                # The book of surface energy, shared equally among the pieces.
                surface = 4 * np.pi * (n * end["radius"][mine[0]] ** 2 - start["radius"][who] ** 2)
                spent = result.scene.effects[6].surface_energy * surface
                assert end["fracture_energy"][mine].sum() == pytest.approx(spent, rel=1e-12, abs=1e-18)
        assert broke > 15

    @staticmethod
    def pieces_of(end, start, who):
        """Into how many pieces grain ``who`` broke: the first piece keeps its id."""
        return round(float(start["mass"][who] / end["mass"][end["id"] == who][0]))

    def test_no_piece_is_lighter_than_an_original_grain(self):
        """However violent: an agglomerate of 3.7 grains gives three pieces, a single grain none."""
        radius = RADIUS * 3.7 ** (1 / 3)
        big, single = run(
            [
                head_on(1e4, laws(SOFT, 1.0), radius=r, dt=1e-15, quantities={"temperature": 300.0})
                for r in (radius, RADIUS)
            ]
        )
        assert len(big.state["mass"]) == 6
        assert single.work["fractures"] == 0
        assert len(single.state["mass"]) == 1

    def test_smallest_piece_is_the_lightest_grain_of_the_start_whatever_its_density(self):
        """Two grains of eight beside one of one: each gives eight pieces, however dense all of them are."""
        light = scene(
            [[-2 * RADIUS, 0, 0], [2 * RADIUS, 0, 0], [0, 1, 0]], [[1e3, 0, 0], [-1e3, 0, 0], [0, 0, 0]],
            laws(SOFT, 1.0, grain_mass=None), radius=[2 * RADIUS, 2 * RADIUS, RADIUS], dt=1e-15,
            quantities={"temperature": 300.0},
        )  # fmt: skip
        given = light.replace({"effects.fragmentation.grain_mass": 2 * GRAIN})
        results = run([light, light.replace({"particles.density": 7 * DENSITY}), given])
        assert [len(result.state["mass"]) for result in results] == [17, 17, 9]
        assert light.replace({"particles.density": DENSITY / 7}).capacity() == light.capacity() == 17

    def test_agglomerate_of_grains_breaks_into_all_of_them(self):
        """Rounding of the summed masses costs no piece: 7 merged grains give 7."""
        radius = RADIUS * 7 ** (1 / 3)
        mass = sum([GRAIN] * 7) * (1 - 1e-15)
        (result,) = run(
            [
                head_on(
                    1e3,
                    laws(SOFT, 1.0),
                    radius=radius,
                    mass=mass,
                    dt=1e-15,
                    quantities={"temperature": 300.0},
                )
            ]
        )
        assert len(result.state["mass"]) == 14


THERMAL = (Impact(hardness=1e5), Heating(heat_capacity=HEAT_CAPACITY))


def alone(temperature, dt, steps, cooling, radius=RADIUS):
    """A single grain at rest that cools or warms."""
    return scene(
        [[0, 0, 0]],
        [[0, 0, 0]],
        (*THERMAL, cooling),
        radius=radius,
        dt=dt,
        steps=steps,
        quantities={"temperature": temperature},
    )


class TestCooling:
    law = Cooling(emissivity=0.7, surroundings=280.0, convection=40.0, gas=350.0)

    def rate(self, t, radius=RADIUS):
        area, mass = 4 * np.pi * radius**2, DENSITY * 4 / 3 * np.pi * radius**3
        law = self.law
        flux = law.convection * (t - law.gas) + SIGMA * law.emissivity * (t**4 - law.surroundings**4)
        return -area * flux / (mass * HEAT_CAPACITY)

    @pytest.mark.parametrize("temperature", [1800.0, 20.0])
    def test_cools_as_the_differential_equation_at_first_order(self, temperature):
        """Against scipy's integrator; halving the step halves the error."""
        span = 5.0
        exact = solve_ivp(
            lambda _, t: self.rate(t), (0, span), [temperature], "DOP853", rtol=1e-12, atol=1e-9
        )
        steps = 2 ** np.arange(6, 12)
        results = run([alone(temperature, span / n, n, self.law) for n in steps])
        errors = np.array([abs(r.state["temperature"][0] - exact.y[0, -1]) for r in results])
        order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
        assert order == pytest.approx(1.0, abs=0.03)
        # What is left after Richardson's extrapolation is of second order: far smaller than the error itself.
        better = 2 * results[-1].state["temperature"][0] - results[-2].state["temperature"][0]
        assert abs(better - exact.y[0, -1]) < errors[-1] / 100

    def test_each_step_solves_its_implicit_equation(self, rng):
        """T' = T + dt rate(T'), solved by bracketing here and by Newton there, from 0 K to 1e5 K."""
        cases = [(float(t), 10.0**dt) for t in (0.0, 1e-3, 300.0, 3e3, 1e5) for dt in rng.uniform(-9, 2, 12)]
        results = run([alone(t, dt, 1, self.law) for t, dt in cases])
        for (t, dt), result in zip(cases, results, strict=True):
            root = brentq(lambda x, t=t, dt=dt: x - t - dt * self.rate(x), 0, 2e5, xtol=1e-12, rtol=1e-15)
            assert result.state["temperature"][0] == pytest.approx(root, rel=1e-10)

    def test_heat_lost_is_in_the_books(self):
        for result in run([alone(t, 0.01, 50, self.law) for t in (0.0, 500.0, 1e5)]):
            assert energy(result.state) == pytest.approx(energy(result.start), rel=1e-13, abs=1e-13)

    def test_never_crosses_equilibrium_however_long_the_step(self):
        """The explicit step of Z04 (6.21) would fall below absolute zero here."""
        law = Cooling(emissivity=1.0, surroundings=300.0)
        hot, cold = run([alone(t, 1e9, 1, law, radius=1e-8) for t in (1e5, 0.0)])
        assert hot.state["temperature"][0] == pytest.approx(300.0, rel=1e-9)
        assert cold.state["temperature"][0] == pytest.approx(300.0, rel=1e-9)
        assert hot.state["temperature"][0] >= 300.0 * (1 - 1e-9)

    def test_surroundings_at_absolute_zero(self):
        """0 K among 0 K stays there; no 0/0."""
        law = Cooling(emissivity=1.0, surroundings=0.0, gas=0.0, convection=1.0)
        cold, warm = run([alone(t, 1.0, 1, law) for t in (0.0, 300.0)])
        assert cold.status.ok
        assert cold.state["temperature"][0] == 0.0
        assert 0 < warm.state["temperature"][0] < 300.0


class TestBox:
    box = Box(low=(-1.0, -2.0, -3.0), high=(1.0, 2.0, 4.0), images=False)

    def drift(self, position, velocity, steps=1, domain=None):
        return scene(position, velocity, (), dt=1.0, steps=steps, domain=domain or self.box)

    def test_comes_back_through_the_opposite_face_with_the_same_velocity(self, rng):
        """Position is that of the straight line, modulo the sides; velocity to the bit."""
        low, high = (np.asarray(x) for x in (self.box.low, self.box.high))
        r = rng.uniform(low, high, (60, 3))
        v = rng.normal(size=(60, 3)) * 10.0 ** rng.uniform(-1, 2, (60, 1))
        (result,) = run([self.drift(r, v)])
        state = by_id(result)
        np.testing.assert_array_equal(state["velocity"], v)
        expected = low + np.mod(r + v - low, high - low)
        np.testing.assert_allclose(state["position"], expected, rtol=0, atol=1e-13)
        assert (np.abs(r + v).max(axis=1) > 20).any(), "some must leave by several boxes"

    def test_faces_belong_to_one_side(self):
        """Always low <= r < high: on the far face, just below the near one, at the last number inside."""
        low, high = (np.asarray(x) for x in (self.box.low, self.box.high))
        inside = np.nextafter(high, low)
        r = np.array([low, inside, low, low])
        v = np.array([high - low, np.zeros(3), [-1e-300] * 3, np.nextafter(0, -1) * np.ones(3)])
        (result,) = run([self.drift(r, v)])
        place = by_id(result)["position"]
        assert (place >= low).all()
        assert (place < high).all()
        np.testing.assert_array_equal(place[0], low)
        np.testing.assert_array_equal(place[1], inside)

    def test_a_rounding_below_the_near_face_is_the_near_face(self):
        """1 - 1e-300 rounds to 1, which is outside: the far face is the near one."""
        unit = Box(low=(0.0,) * 3, high=(1.0,) * 3, images=False)
        (result,) = run([self.drift(np.zeros((1, 3)), [[-1e-300, -1e-18, -1e-17]], domain=unit)])
        np.testing.assert_array_equal(result.state["position"], np.zeros((1, 3)))

    def test_a_start_outside_the_box_is_refused(self):
        with pytest.raises(InputError, match=r"particles.position must be inside the domain; received"):
            run([self.drift([[5.0, 0, 0]], [[0.0, 0, 0]])])

    def test_meets_what_is_at_the_other_side_only_where_faces_are_images(self):
        """A joined box with images has contacts across its faces; Z04's control volume has not."""
        seen = []
        for images in (True, False):
            made = flow(images=images).replace(
                {
                    "particles.position": [[-0.9995 * 0.01, 0, 0], [0.9995 * 0.01, 0, 0]],
                    "particles.velocity": [[-1.0, 0, 0], [1.0, 0, 0]],
                    "particles.radius": RADIUS,
                    "particles.quantities.temperature": 300.0,
                    "duration": 1e-6,
                }
            )
            (result,) = simulate([made], worlds=240, capacity=200, schedule="world")
            seen.append(result.work["impacts"])
        assert seen == [1, 0]


def test_fixed_steps_end_exactly_on_time():
    """A duration that is no multiple of the step: the last step is cut, and time is exact."""
    results = run(
        [
            scene([[0, 0, 0]], [[1.0, 2, 3]], (), stepper=fixed(dt), duration=1.0)
            for dt in (0.3, 1 / 3, 0.1, 7.0, 1e-4)
        ]
    )
    for result, steps in zip(results, (4, 3, 10, 1, 10_000), strict=True):
        assert result.time == 1.0
        assert result.work["steps"] == steps
        np.testing.assert_allclose(result.state["position"], [[1, 2, 3]], rtol=1e-12)
