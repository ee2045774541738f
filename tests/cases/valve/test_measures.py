"""Measures of a valve: flow rates, pressures, clusters, and the arrest of a flow."""

import numpy as np
import pytest
from scipy.constants import mu_0

from tests.cases.valve.states import at_rest, result_of
from tisim.cases.common.runs import overlap
from tisim.cases.valve.measures import (
    attraction,
    clusters,
    drag,
    duct_of,
    flow_rate,
    held_pressure,
    mason_number,
    oil_of,
    unhindered_rate,
)
from tisim.cases.valve.runs import ARRESTED, FLOW_SAMPLES, Flow, left
from tisim.cases.valve.scene import THROATS, scene

R, UM = 22e-6, 1e-6
VALVE = scene(throat=176 * UM, bore=352 * UM, straight=44 * UM, length=440 * UM, flowing=1e-4, lasting=3e-4)


def test_the_flow_rate_is_the_momentum_over_the_length():
    velocity = [[1.0, 2.0, 0.5], [0.0, 0.0, -0.1]]
    result = result_of(VALVE, np.zeros((2, 3)), velocity, mass=[2e-9, 1e-9])
    assert flow_rate(result) == pytest.approx((2e-9 * 0.5 - 1e-9 * 0.1) / 440e-6)


def test_grains_that_move_with_the_oil_flow_unhindered():
    result = at_rest(VALVE)
    state, duct, oil = result.state, duct_of(VALVE), oil_of(VALVE)
    rho = np.hypot(*state["position"][:, :2].T)
    state["velocity"] = np.zeros((len(rho), 3))
    state["velocity"][:, 2] = oil.speed * duct.oil_speed(rho, state["position"][:, 2])
    assert flow_rate(result) == pytest.approx(unhindered_rate(VALVE, state["mass"].sum()), rel=0.1)
    assert drag(result) == pytest.approx(0.0, abs=1e-15)


def test_the_drag_on_grains_in_the_duct_and_in_the_constriction():
    oil = oil_of(VALVE).speed
    result = result_of(VALVE, [[0, 0, 200 * UM], [50 * UM, 0, 20 * UM], [0, 132 * UM, 200 * UM]])
    # Oil speeds are 1 in the core, 4 in the constriction and 1/2 half-way to the wall.
    assert drag(result) == pytest.approx(6 * np.pi * 0.16 * R * oil * (1 + 4 + 0.5))
    held = result_of(VALVE, np.zeros((1, 3)), measures={"valve_force_z": 3e-3})
    assert held_pressure(held) == pytest.approx(3e-3 / (np.pi * (176e-6) ** 2))


ARCH = [[x, 0, 0] for x in (-66, -22, 22, 66)]
"""Positions of four grains across the constriction that just touch each other and the wall, um."""
PRESSED = 22.05
"""Radius with which these grains are pressed together, um."""


def found(places, radius=PRESSED):
    """The clusters of grains at the given positions, um."""
    return clusters(result_of(VALVE, np.array(places) * UM, radius=radius * UM).state, VALVE)


def test_an_arch_across_the_constriction_and_grains_elsewhere():
    """Four grains from wall to wall, a row of three across the periodic ends, and a single one."""
    row, alone = [[0, 0, z] for z in (-216, 216, 172)], [[100, 100, 150]]
    assert found(ARCH + row + alone).largest == pytest.approx(4 / 8)
    assert found(ARCH + row + alone).bridged
    # There is no arch if one grain is missing, if two do not touch, or in the wide part of the duct.
    assert not found(ARCH[:3] + row).bridged
    assert not found([[-66, 0, 0], [-22.3, 0, 0], [22.3, 0, 0], [66, 0, 0]]).bridged
    assert not found(ARCH, radius=21.9).bridged
    higher = [[x, 0, 190] for x in (-154, -110, -66, -22, 22, 66, 110, 154)]
    assert found(higher).largest == 1
    assert not found(higher).bridged


def test_two_neighbours_at_the_wall_are_no_arch():
    """They touch the wall on both sides of the axis, next to each other."""
    y = np.sqrt(66**2 - 22**2)
    pair = [[-22, y, 0], [22, y, 0]]
    assert found(pair).largest == 1
    assert not found(pair).bridged


def test_a_row_along_the_wall_is_no_arch():
    """Four grains span a third of the circumference."""
    angle = np.radians(39.0) * np.array([-1.5, -0.5, 0.5, 1.5])
    row = np.column_stack([66 * np.sin(angle), 66 * np.cos(angle), 0 * angle])
    assert found(row).largest == 1
    assert not found(row).bridged


@pytest.mark.parametrize(("degrees", "along"), [(0, True), (25, True), (30, False), (90, False)])
def test_an_arch_stands_along_the_field(degrees, along):
    a = np.radians(degrees)
    assert found([[x * np.cos(a), x * np.sin(a), 0] for x, _, _ in ARCH]).bridged == along


@pytest.mark.parametrize("throat", THROATS)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_random_start_is_no_arch(throat, seed):
    made = scene(throat=throat, seed=seed)
    assert not clusters(made.start(), made).bridged


def test_a_grain_touches_a_cone_by_its_distance_from_it():
    """The grains are half-way up a cone of 45 degrees, at a duct radius of 132 um."""
    z, wall = 22 + 44, 132
    near = wall - 21.99 * np.sqrt(2)
    chain = [[x, 0, z] for x in np.linspace(-near, near, 6)]
    assert 2 * near / 5 < 44
    assert found(chain, 22).bridged
    assert not found([[0.99 * x, 0, z] for x, _, _ in chain], 22).bridged


def test_overlaps_across_the_ends():
    result = result_of(VALVE, [[0, 0, -200 * UM], [0, 0, 200 * UM]])
    assert overlap(result) == pytest.approx(4 / 22)


def test_attraction_and_mason_number():
    """The attraction is 16/9 of the force between two grains with the moments of isolated grains."""
    alone = 4 * np.pi * R**3 * 0.23 / mu_0
    assert attraction(R, 0.23) == pytest.approx(16 / 9 * 3 * mu_0 * alone**2 / (2 * np.pi * (2 * R) ** 4))
    drag_there = 6 * np.pi * 0.16 * R * 4 * oil_of(VALVE).speed
    assert mason_number(VALVE, R, 0.23) == pytest.approx(drag_there / attraction(R, 0.23))


def flow_of(before, after):
    """A flow with the rate ``before`` without the field and finally ``after`` in the field."""
    times = np.arange(FLOW_SAMPLES) * 4e-4 / FLOW_SAMPLES
    rates = np.where(times <= 1e-4, before, np.where(times > 3.2e-4, after, 9.0))
    return Flow(result_of(VALVE, np.zeros((1, 3))), times, rates)


def test_a_flow_is_arrested_if_little_of_it_is_left():
    assert flow_of(2.0, 0.5).left == pytest.approx(0.25)
    assert not flow_of(2.0, 0.5).arrested
    assert flow_of(2.0, 1.9 * ARRESTED).arrested
    mean = left([flow_of(2.0, 0.5), flow_of(2.0, 0.7)])
    assert mean.value == pytest.approx(0.3)
    assert mean.half > 0
