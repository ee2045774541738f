"""The scenes: L21's numbers, scaled copies for all sizes, and forces of two grains of each size."""

import numpy as np
import pytest
from scipy.constants import mu_0

from tests.cases.avalanche.slopes import block
from tisim.analysis import contacts
from tisim.cases.avalanche.figures import pictures
from tisim.cases.avalanche.scaling import attraction, moment, ratio, weight
from tisim.cases.avalanche.scene import (
    DEFAULT,
    DIAMETERS,
    FLUX,
    GRAVITY,
    SIZES,
    Cell,
    handed_on,
    scene,
    scene_for,
    step,
    time_unit,
    young,
)
from tisim.cases.avalanche.stages import SLOPES, larger
from tisim.effects import Walls

TINY = Cell(number=40, column=6.0, width=5.25, length=12.0, height=8.0)


@pytest.mark.parametrize(("size", "sides", "number"), [
    ("l21", (1.5, 0.4, 2.0), 500_000), ("l21_1cm", (1.5, 0.4, 2.0), 77_000),
    ("l21_5cm", (7.5, 2.0, 10.0), 70_000),
])  # fmt: skip
def test_the_sizes_of_l21_have_its_numbers(size, sides, number):
    made = scene_for(size, 0)
    assert made.domain.high == pytest.approx(sides)
    assert made.particles.number == number
    assert made.domain.periodic == (False, True, False)
    iron = made.materials["iron"]
    assert (iron.young, iron.poisson, iron.restitution) == (1e9, 0.278, 0.2)
    assert (iron.friction, iron.rolling_friction, iron.cohesion_energy_density) == (0.6, 0.4, 10.0)


def test_grains_of_all_sizes_are_copies_of_each_other():
    """In units of d and sqrt(d/g) they are equal but for rounding, which is to three digits for steps."""
    small, large = (scene(DEFAULT, diameter=d, field=0.0) for d in (5e-3, 5e-2))
    assert large.duration / small.duration == pytest.approx(10**0.5)
    assert step(5e-2, 2e5) / step(5e-3, 2e5) == pytest.approx(10**0.5, rel=5e-3)
    assert young(5e-2) / young(5e-3) == pytest.approx(10.0)
    a, b = (one.start() for one in (small, large))
    np.testing.assert_allclose(b["position"], 10 * a["position"], rtol=1e-9)
    assert time_unit(5e-3) == pytest.approx((5e-3 / GRAVITY) ** 0.5)


def test_grains_begin_apart_beside_the_wall():
    made = scene(DEFAULT, seed=3)
    state, d = made.start(), DIAMETERS[0]
    assert len(state["radius"]) == DEFAULT.number
    assert (state["position"][:, 0] < (DEFAULT.column - 0.5) * d).all()
    assert len(contacts(state["position"], state["radius"], sides=(0.0, DEFAULT.width * d, 0.0))) == 0
    assert not np.array_equal(state["position"], scene(DEFAULT, seed=4).start()["position"])


def test_an_unmagnetised_scene_has_no_field_and_a_closed_gate_does_not_move():
    kinds = {effect.kind() for effect in scene(TINY, field=0.0).effects}
    assert not kinds & {"magnetic_field", "truncated_dipole_dipole"}
    gates = [
        next(e for e in scene(TINY, opens=opens).effects if isinstance(e, Walls) and e.name == "gate")
        for opens in (None, 4.0)
    ]
    assert gates[0].motion.velocity == (0.0, 0.0, 0.0)
    assert gates[1].motion.begin == pytest.approx(4.0 * time_unit(DIAMETERS[0]))
    assert gates[1].motion.velocity[0] > 10 * (GRAVITY * 20 * DIAMETERS[0]) ** 0.5


def test_a_state_is_handed_on_in_the_order_of_ids():
    state = block([2, 1])
    state["id"] = np.arange(len(state["id"]))[::-1]
    state["spin"][0] = 3.0
    particles = handed_on(state)
    np.testing.assert_array_equal(particles.position, state["position"][::-1])
    np.testing.assert_array_equal(particles.quantities["spin"][-1], 3.0)


def test_the_attraction_is_the_slope_of_the_energy_of_two_dipoles():
    """The energy of each of two dipoles that magnetise each other is -m.B/2, with m = c B / (1 - 2 a)."""
    d = DIAMETERS[0]
    alone = moment(d)

    def energy(apart):
        field = mu_0 / (4 * np.pi) * 2 / apart**3
        grown = alone / (1 - alone / FLUX * field)
        return -grown * FLUX

    h = 1e-6 * d
    slope = (energy(d + h) - energy(d - h)) / (2 * h)
    assert attraction(d) == pytest.approx(slope, rel=1e-6)
    fixed = 3 * mu_0 * alone**2 / (2 * np.pi * d**4)
    assert attraction(d, mutual=False) == pytest.approx(fixed)
    assert alone / (np.pi / 6 * d**3) == pytest.approx(11.9e3, abs=50)
    assert weight(d) == pytest.approx(7750 * np.pi / 6 * d**3 * 0.144)


def test_magnetism_over_gravity_decreases_with_the_size_of_grains():
    """L21 section 4.5: ten times gravity for 5 mm, above gravity for 1 cm, about equal to it for 5 cm."""
    small, medium, large = (ratio(d) for d in DIAMETERS)
    assert small == pytest.approx(14.1, abs=0.1)
    assert medium == pytest.approx(small / 2)
    assert large == pytest.approx(small / 10)
    # Without mutual induction the ratio is 9/16 of this in the limit of iron.
    assert ratio(DIAMETERS[2], mutual=False) / large == pytest.approx(9 / 16, rel=5e-3)


def test_published_slopes():
    grown = [magnetised.angle - without.angle for without, magnetised in SLOPES.values()]
    assert grown == pytest.approx([13.26, 2.01, 0.12], abs=0.01)
    assert [larger(d) for d in DIAMETERS] == pytest.approx([1.09, 1.08, 1.01], abs=5e-3)
    assert SIZES.keys() == {"default", "small", "large", "l21", "l21_1cm", "l21_5cm"}


def test_a_run_of_few_frames_has_no_picture():
    assert pictures([]) == {}
