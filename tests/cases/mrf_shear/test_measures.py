"""Measures of a cell: stress on rafts, shear rate, chains, and dimensionless numbers."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.constants import mu_0

from tisim.analysis import Mean
from tisim.cases.common.runs import overlap
from tisim.cases.mrf_shear import checks, published
from tisim.cases.mrf_shear.checks import approach_time, mason_number, regime, stokes_time
from tisim.cases.mrf_shear.flow_curve import Curve, paired, table, yield_table
from tisim.cases.mrf_shear.measures import (
    area,
    magnetisation,
    magnetised_part,
    order,
    raft_force,
    shear_rate,
    shear_stress,
    volume_fraction,
)
from tisim.cases.mrf_shear.scene import LARGE_RADIUS, LOWER, UPPER, scene

R, UM = LARGE_RADIUS, 1e-6
CELL = scene(sides=(40 * UM, 30 * UM, 60 * UM), raft=10 * UM, rate=500.0)


def result_of(position, mean_force=None, group=None, radius=R, cell=CELL):
    """A result with the given grains."""
    n = len(position)
    state = {
        "position": np.asarray(position, float),
        "radius": np.full(n, radius),
        "group": np.zeros(n) if group is None else np.asarray(group),
        "mean_force": np.zeros((n, 3)) if mean_force is None else np.asarray(mean_force, float),
    }
    return SimpleNamespace(state=state, scene=cell, time=0.0)


def test_stress_is_the_mean_of_both_rafts_over_their_area():
    force = [[3e-6, 0, 5e-6], [1e-6, 0, 1e-6], [-2e-6, 9.0, -3e-6], [7.0, 7.0, 7.0]]
    result = result_of(np.zeros((4, 3)), force, [LOWER, LOWER, UPPER, 0])
    assert area(result) == pytest.approx(1200 * UM**2)
    assert shear_stress(result) == pytest.approx((4e-6 + 2e-6) / 2 / 1.2e-9)
    double = result_of(np.zeros((4, 3)), 2 * np.array(force), [LOWER, LOWER, UPPER, 0])
    assert paired([double, double], [result, result]).value == pytest.approx(2.0)


def test_the_drag_of_oil_at_rest_is_no_stress():
    """Rafts move through the oil at their own speed; the force without this drag comes from the grains."""
    still = scene(sides=(40 * UM, 30 * UM, 60 * UM), raft=10 * UM, rate=500.0, still=True)
    drag = 6 * np.pi * 0.01 * R * 500.0 * 40 * UM / 2
    grains, group = np.array([[2e-6, 0, 1e-6], [-2e-6, 0, 0], [0, 0, 0]]), [LOWER, UPPER, 0]
    with_drag = grains + np.outer([drag, -drag, drag], [1, 0, 0])
    one = result_of(np.zeros((3, 3)), with_drag, group, cell=still)
    assert drag > 1e-9
    np.testing.assert_allclose(raft_force(one, LOWER), grains[0], rtol=1e-12)
    assert shear_stress(one) == pytest.approx(2e-6 / 1.2e-9)
    # Oil that moves with the rafts does not drag them.
    assert raft_force(result_of(np.zeros((3, 3)), grains, group), UPPER)[0] == -2e-6


def test_the_shear_rate_between_the_rafts():
    assert shear_rate(result_of(np.zeros((1, 3)))) == pytest.approx(500.0)
    # L21 gives these three rates for its own wall speeds.
    np.testing.assert_allclose(np.array(published.SHEAR_RATES)[[1, 5, 7]], [590, 36.4, 9], rtol=0.02)


def test_a_chain_along_the_field_and_one_across_it():
    """Five grains are in line along the field, and three along x across a face of the cell."""
    upright = np.column_stack([np.full(5, 0.02e-6), np.full(5, 5e-6), 2 * R * np.arange(5) + R])
    lying = np.array([[39 * UM, 20 * UM, 9 * UM]] * 3) + np.outer(np.arange(3), [2 * R, 0, 0])
    lying[:, 0] %= 40 * UM
    state = result_of(np.vstack([upright, lying])).state
    found = order(state, CELL.domain)
    assert found.contacts == pytest.approx(2 * 6 / 8)
    assert found.size == pytest.approx((5 * 5 + 3 * 3) / 8 / 8)
    assert found.length == pytest.approx((5 * 8 * R + 3 * 4 * R) / 8 / (60 * UM))
    assert found.breadth == pytest.approx(1.0)
    # Four contacts along the field, and two across.
    assert found.alignment == pytest.approx((3 * 4 / 6 - 1) / 2)


def test_overlap_and_volume_fraction():
    result = result_of([[0.5 * UM, 0, 0], [40 * UM - 6 * UM, 0, 0], [20 * UM, 0, 0]])
    assert overlap(result) == pytest.approx((2 * R - 6.5 * UM) / R)
    assert overlap(result_of([[0, 0, 0], [9 * UM, 0, 0]])) == 0.0
    assert volume_fraction(result) == pytest.approx(3 * 4 / 3 * np.pi * R**3 / (72000 * UM**3))


def test_the_dimensionless_numbers():
    """Drag is far below the magnetic forces, and oil stops a grain within microseconds."""
    assert mason_number(1000.0, 0.6) == pytest.approx(8 * 0.01 * 1000 * mu_0 / 0.36)
    assert stokes_time() == pytest.approx(2e-6, rel=0.05)
    moment = magnetisation(0.6) * np.pi / 6 * (2 * R) ** 3
    force = 3 * mu_0 * moment**2 / (2 * np.pi * (2 * R) ** 4)
    assert force == pytest.approx(15e-6, rel=0.02)
    mass = 7860 * np.pi / 6 * (2 * R) ** 3
    assert force / mass * approach_time(0.6) ** 2 / 2 == pytest.approx(R)
    shown = {one.name: one.value for one in regime()}
    assert shown["attraction of two touching grains in line, uN"] == pytest.approx(1e6 * force)
    assert shown["Mason number at 2000 1/s"] == pytest.approx(5.6e-4, rel=0.01)
    assert shown["magnetisation of a single grain, MA/m"] == pytest.approx(1.43, rel=2e-3)


def test_the_moment_of_grains_relative_to_isolated_grains():
    result = result_of(np.zeros((2, 3)))
    alone = magnetisation(0.6) * 4 / 3 * np.pi * R**3
    result.state["moment"] = alone * np.array([[0, 0, 1.0], [0, 0.9, 1.2]])
    assert magnetised_part(result) == pytest.approx(1.25)


def group(rate, stresses):
    """Cells with the given shear stresses."""
    cell = scene(rate=rate, sides=(40 * UM, 30 * UM, 60 * UM), raft=10 * UM)
    force = [[[one * 1.2e-9, 0, 0], [-one * 1.2e-9, 0, 0]] for one in stresses]
    return [result_of(np.zeros((2, 3)), one, [LOWER, UPPER], cell=cell) for one in force]


def test_yield_stresses_of_each_start():
    rates = np.array([1e3, 2e3, 4e3])
    of_starts = 40e3 * np.array([0.9, 1.0, 1.1])
    curve = Curve(rates, [group(rate, of_starts + rate) for rate in rates])
    np.testing.assert_allclose(curve.yield_stresses(), of_starts)
    heading, row = yield_table(curve).splitlines()
    assert heading == "yield_stress_Pa,half_interval_Pa,of_each_start_Pa"
    mean, half, each = row.split(",")
    assert (float(mean), each) == (40000.0, "36000 40000 44000")
    assert float(half) == pytest.approx(Mean.of(of_starts).half, rel=1e-2)


def test_a_curve_is_fitted_with_the_spread_over_starts():
    rates = np.array([1e3, 2e3, 4e3])
    curve = Curve(rates, [group(rate, 40e3 + 0.5 * rate + np.array([-1e3, 1e3, 0.0])) for rate in rates])
    np.testing.assert_allclose(curve.values, 40e3 + 0.5 * rates)
    fit = curve.bingham()
    assert fit.yield_stress.value == pytest.approx(40e3)
    assert fit.plastic_viscosity.value == pytest.approx(0.5)
    # All rates share their starts, so the yield stress varies by the shift of a whole curve.
    assert fit.yield_stress.half == pytest.approx(Mean.of([39e3, 41e3, 40e3]).half)
    assert fit.plastic_viscosity.half == pytest.approx(0.0, abs=1e-6)
    rows = table(curve, "shear_rate_per_s").splitlines()
    assert rows[0] == "shear_rate_per_s,shear_stress_Pa,half_interval_Pa,of_each_start_Pa"
    assert rows[1].startswith("1000,40500,")
    assert rows[1].endswith("39500 41500 40500")
    square = Curve(rates, [group(rate, [rate**2, rate**2]) for rate in rates])
    assert square.power().value == pytest.approx(2.0)
    bent = Curve(rates, [group(rate, [rate, rate**3]) for rate in rates]).power()
    assert (bent.value, bent.half) == pytest.approx((2.0, Mean.of([1.0, 3.0]).half))


def test_rafts_balance_in_each_start(monkeypatch):
    """Opposite imbalances in two starts do not cancel."""
    forces = {("a", LOWER): 1.0, ("a", UPPER): -0.7, ("b", LOWER): 0.7, ("b", UPPER): -1.0}
    monkeypatch.setattr(checks, "raft_force", lambda result, group: np.array([forces[result, group], 0, 0]))
    (found,) = checks.balances(["a", "b"])
    assert found.measured == pytest.approx(0.3 / 1.7)
    assert not found.ok
