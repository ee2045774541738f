"""The shear cell: its walls, means over a series, and mu(I) compared with glass beads."""

from types import SimpleNamespace

import numpy as np
import pytest

from tisim import RunError
from tisim.analysis import contacts
from tisim.cases.granular_bench import shear_cell
from tisim.cases.granular_bench.figures import shear_figure, shear_table
from tisim.cases.granular_bench.scene import DENSITY, DIAMETER
from tisim.cases.granular_bench.shear_cell import (
    CELL_AREA,
    CELL_LENGTH,
    CELL_SIDES,
    CELL_WIDTH,
    SHEAR_RATE,
    ShearedBed,
    expected_ratio,
    gap_of,
    loose,
    mean_of,
    rough_wall,
    seen,
    sheared_beds,
)
from tisim.engine.result import Status


def bed(pressure=300.0, gap=10 * DIAMETER):
    """A bed with a shear rate of 8 1/s in the middle and slip at both walls."""
    height = (np.arange(12) + 0.5) / 12 * gap
    velocity = SHEAR_RATE * gap / 2 + 8.0 * (height - gap / 2)
    velocity[0], velocity[-1] = np.nan, np.nan
    # One grain of each wall, and one between the walls.
    state = {
        "position": np.array([[0.02, 0.01, z * gap] for z in (0.0, 0.5, 1.0)]),
        "velocity": np.array([[part * SHEAR_RATE * gap, 0.0, 0.0] for part in (0.0, 0.4, 1.0)]),
        "radius": np.full(3, DIAMETER / 2),
    }
    return ShearedBed(gap, pressure, 0.4 * pressure, 0.57, height, velocity, state)


def test_mu_of_glass_beads():
    assert expected_ratio(0.0001) == pytest.approx(np.tan(np.radians(20.9)), abs=3e-3)
    assert expected_ratio(1e4) == pytest.approx(np.tan(np.radians(32.76)), abs=5e-3)
    assert expected_ratio(0.279) == pytest.approx(0.51)


def test_inertial_number_is_of_the_middle_of_the_gap():
    assert bed().shear_rate == pytest.approx(8.0)
    assert bed().inertial_number == pytest.approx(8.0 * DIAMETER * np.sqrt(DENSITY / 300.0))
    assert bed().ratio == pytest.approx(0.4)


def test_stresses_are_means_over_both_walls_and_over_time():
    """The means are over two samples; the walls are pushed apart and dragged in opposite directions."""
    gap = 10 * DIAMETER
    state = {
        "group": np.array([0, 0, 1]), "radius": np.full(3, DIAMETER / 2),
        "position": np.array([[0.0, 0.0, 0.3 * gap], [0.0, 0.0, 0.31 * gap], [0.0, 0.0, 0.0]]),
        "velocity": np.array([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [9.0, 0.0, 0.0]]),
    }  # fmt: skip
    names = ("upper_force_z", "lower_force_z", "upper_force_x", "lower_force_x")
    samples = [
        seen(SimpleNamespace(state=state, measures=dict(zip(names, forces, strict=True))), gap)
        for forces in ((3.0, -1.0, -0.5, 0.7), (5.0, -3.0, -1.5, 1.3))
    ]
    found = mean_of(gap, samples, state)
    assert found.state is state
    assert found.pressure == pytest.approx(3.0 / CELL_AREA)
    assert found.shear_stress == pytest.approx(1.0 / CELL_AREA)
    assert found.fraction == pytest.approx(2 * np.pi / 6 * DIAMETER**3 / (CELL_AREA * gap / 2))
    assert found.velocity[3] == pytest.approx(2.0)
    assert found.filled.sum() == 1


class Failing:
    """A stand-in for a simulation, in which the second scene fails after a number of runs."""

    def __init__(self, scene, worlds, runs):
        self.left, self.closed = runs, False

    def load(self, scenes):
        self.scenes = scenes

    def run(self, until=None):
        self.left -= 1
        self.until = until

    def results(self):
        going = Status(self.until is None, "done" if self.until is None else "running")
        states = [going, Status(False, "a force is not a number") if self.left < 0 else going]
        measures = {f"{wall}_force_{axis}": 1.0 for wall in ("upper", "lower") for axis in "xz"}
        return [
            SimpleNamespace(
                scene=scene, status=status, measures=measures,
                state={"position": np.ones((1, 3)), "velocity": np.ones((1, 3)), "radius": np.ones(1),
                       "mass": np.ones(1), "spin": np.ones((1, 3)), "group": np.zeros(1)},
            )
            for scene, status in zip(self.scenes, states, strict=True)
        ]  # fmt: skip

    def close(self):
        self.closed = True


@pytest.mark.parametrize("runs", [0, 1, 5])
def test_a_cell_that_fails_has_no_mu(monkeypatch, runs):
    """It may fail while it is compressed or at any later sample; no other cell replaces it."""
    made = []

    def simulation(scene, worlds):
        made.append(Failing(scene, worlds, runs))
        return made[-1]

    monkeypatch.setattr(shear_cell, "Simulation", simulation)
    with pytest.raises(RunError, match="granular_bench: a force is not a number"):
        sheared_beds((0.50, 0.55), number=100)
    assert made[0].closed
    assert made[0].left == -1


def test_the_cell_begins_without_overlaps_of_free_grains():
    gap = gap_of(100, 0.26)
    state = loose(100, gap, 3)
    free = state["group"] == 0
    assert free.sum() == 100
    assert [(state["group"] == k).sum() for k in (1, 2)] == [CELL_LENGTH * CELL_WIDTH] * 2
    pairs = contacts(state["position"], state["radius"], sides=(*CELL_SIDES, 0.0))
    assert not free[pairs].any()
    np.testing.assert_allclose(state["velocity"][:, 0], SHEAR_RATE * state["position"][:, 2])
    # The roughness of walls is half a diameter, and no two neighbours in a row have equal heights.
    height = rough_wall(0.0)[:, 2]
    assert np.ptp(height) == pytest.approx(0.5 * DIAMETER, rel=0.1)
    assert np.abs(np.diff(height)).min() > 0.1 * DIAMETER
    # The fraction refers to the space between the walls.
    volume = np.pi / 6 * (state["radius"][free] * 2) ** 3
    assert volume.sum() / ((gap - DIAMETER) * CELL_AREA) == pytest.approx(0.26, rel=0.03)


def test_figure_and_table_have_each_bed():
    beds = [bed(pressure) for pressure in (30.0, 300.0, 3000.0)]
    grains, _, ratio, fraction, _ = shear_figure(beds).axes
    # Colours of grains show their velocity.
    picture = grains.images[0].get_array()
    beds[1].state["velocity"][1, 0] *= 2
    other = shear_figure(beds).axes[0].images[0].get_array()
    changed = (picture != other).any(axis=2)
    assert 0 < changed.sum() < 0.5 * (picture[..., 3] > 0).sum()
    numbers = [one.inertial_number for one in beds]
    np.testing.assert_allclose(ratio.collections[0].get_offsets()[:, 0], numbers)
    np.testing.assert_allclose(fraction.collections[0].get_offsets()[:, 1], 0.57)
    rows = shear_table(beds).splitlines()
    assert rows[0].startswith("inertial_number,stress_ratio,published")
    assert len(rows) == 4


@pytest.mark.slow
def test_sheared_grains_have_the_friction_of_glass_beads():
    """mu grows with the inertial number as published, and the denser bed has the smaller number."""
    dilute, dense = sheared_beds((0.50, 0.55), number=200)
    assert dense.inertial_number < 0.5 * dilute.inertial_number
    assert dense.fraction > dilute.fraction + 0.02
    assert dense.ratio < dilute.ratio - 0.03
    for one in (dilute, dense):
        assert one.ratio == pytest.approx(float(expected_ratio(one.inertial_number)), abs=0.09)
        middle = one.filled & (np.abs(one.height / one.gap - 0.5) < 0.3)
        # The shear is uniform and not in a band, except for a layer of one grain at each wall.
        height, velocity = one.height[middle], one.velocity[middle]
        line = np.polyval(np.polyfit(height, velocity, 1), height)
        assert np.abs(velocity - line).max() < 0.06 * one.wall_speed
        assert 0.6 * SHEAR_RATE < one.shear_rate < 1.1 * SHEAR_RATE
