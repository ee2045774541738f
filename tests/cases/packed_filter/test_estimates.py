"""Estimates from single fibres, measures and figures, from known results."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tisim import Box, InputError
from tisim.analysis import Mean
from tisim.cases.packed_filter import figures, pictures, problem
from tisim.cases.packed_filter.lone_fibre import LoneFibre, lone_fibres
from tisim.cases.packed_filter.matrix import Matrix
from tisim.cases.packed_filter.measures import (
    SIZE_CLASSES,
    captured_fraction,
    captures_by_angle,
    missing,
    penetration,
    penetration_of_layers,
    pressure_drop,
    released_fraction,
)
from tisim.cases.packed_filter.scene import PackedFilter, filter_of
from tisim.engine.shared_room import SharedRooms
from tisim.sources import Cylinder, MagneticCylinders, MagneticField, PoreFlow
from tisim.sources.switched import NO_END


def alone(captured_at, volume=2.0):
    """Lone fibres around which colloids of all sizes start alike in a volume."""
    captured = np.asarray(captured_at, float)
    radius = np.tile(np.linspace(1e-9, 9e-9, captured.shape[1]), (len(captured), 1))
    return LoneFibre(PackedFilter(), np.full(len(captured), volume), radius, captured)


def test_independent_fibres_leave_an_exponential_part():
    """One in four colloids of each size is captured at 1 s, another at 3 s: V = 0.5 and 1 m^3."""
    number = 24 * SIZE_CLASSES
    at = np.tile(np.resize([1.0, 3.0, -1.0, -1.0], number), (5, 1))
    fibres = alone(at)
    assert fibres.passed(0.5, 1.6).value == pytest.approx(1.0)
    assert fibres.passed(2.0, 1.6).value == pytest.approx(np.exp(-1.6 * 0.5))
    assert fibres.passed(4.0, 1.6).value == pytest.approx(np.exp(-1.6 * 1.0))
    assert fibres.passed(4.0, 0.4, stages=7).value == pytest.approx((1 - 0.4) ** 7)
    assert fibres.passed(4.0, 1.6).half == pytest.approx(0.0, abs=1e-12)


def test_sizes_are_averaged_after_the_exponential():
    """Only the larger half of the colloids is captured, all of it within 2 m^3."""
    number = 24 * SIZE_CLASSES
    at = np.tile(np.where(np.arange(number) < number // 2, -1.0, 1.0), (4, 1))
    assert alone(at).passed(2.0, 1.5).value == pytest.approx(0.5 + 0.5 * np.exp(-3.0))


def test_the_interval_is_that_of_independent_fibres():
    """Fibres of which each captures all or nothing: the half-width is that of their mean, to first order."""
    number = 24 * SIZE_CLASSES
    at = np.array([[1.0] * number if k % 2 else [-1.0] * number for k in range(40)])
    found, n = alone(at, 1.0).passed(2.0, 0.1), 0.1
    spread = Mean.of([float(k % 2) for k in range(40)]).half
    assert found.half == pytest.approx(n * np.exp(-0.05) * spread, rel=0.02)


def ended(captured_by, counts=None, entered=None, exited=None, radius=5e-9, depth=2e-3):
    """The end of a run with a matrix of a depth (m)."""
    n = len(captured_by)
    state = {
        "mass": np.ones(n), "radius": np.full(n, radius) if np.isscalar(radius) else np.array(radius),
        "captured_by": np.array(captured_by), "captured_at": np.where(np.array(captured_by) >= 0, 5.0, -1.0),
        "entered_at": np.zeros(n) if entered is None else np.array(entered, float),
        "exited_at": np.full(n, -1.0) if exited is None else np.array(exited, float),
        "entry_trials": np.ones(n, int),
    }  # fmt: skip
    if counts is not None:
        state["capture_count"] = np.array(counts)
    captures = int((np.array(captured_by) >= 0).sum() if counts is None else sum(counts))
    held = int((np.array(captured_by) >= 0).sum())
    work = {
        "captures": captures, "releases": captures - held, "entered": int((state["entered_at"] >= 0).sum()),
        "exited": int((state["exited_at"] >= 0).sum()),
    }  # fmt: skip
    box = Box(low=(-1e-3, -1e-3, 0), high=(1e-3, 1e-3, depth), periodic=(True, True, False), images=False)
    return SimpleNamespace(state=state, work=work, scene=SimpleNamespace(domain=box, effects=()))


def test_measures_count_colloids_that_have_entered():
    """Of five colloids one waits, one is held, one was released and is out, one has passed, one is free."""
    result = ended([-1, 3, -1, -1, -1], [0, 1, 2, 0, 0], entered=[-1, 0, 0, 0, 0], exited=[-1, -1, 9, 8, -1])
    assert captured_fraction(result) == 0.25
    assert captured_fraction(result, 4.0) == 0.0
    assert penetration(result) == 0.5
    assert released_fraction(result) == pytest.approx(2 / 3)
    assert missing([result]) == 0
    result.work["exited"] += 1
    assert missing([result]) == 1


def test_captures_by_angle_are_over_the_mean_of_all_fibres():
    """Two fibres across the field and one along it, and an image of the latter outside the box. They have
    captured two, none, one and, for the image, one. Two of four captures are by a third of the fibres."""
    result = ended([0, 0, 2, 3, -1])
    axes, centres = [(0, 1, 0), (0.2, 0, 1), (1, 0, 0), (1, 0, 0)], [(0, 0, 1e-3)] * 3 + [(2e-3, 0, 1e-3)]
    fibres = [
        Cylinder(centre=centre, axis=axis, radius=1e-4, length=1e-3)
        for centre, axis in zip(centres, axes, strict=True)
    ]
    field = MagneticField(constant=(2.0, 0, 0))
    result.scene.effects, result.time = (field, MagneticCylinders(cylinders=fibres)), 9.0
    np.testing.assert_allclose(captures_by_angle(result), [0.75, np.nan, 1.5])
    # Nothing was captured before 5 s.
    assert np.isnan(captures_by_angle(result, 4.0)).all()
    result.scene.effects = (MagneticField(constant=(2.0, 0, 0), end=8.0), *result.scene.effects[1:])
    with pytest.raises(InputError, match=r"^magnetic_field.end must be after the end of the run; received 8"):
        captures_by_angle(result)


def test_objectives_are_taken_to_one_depth():
    """Of the large colloids a quarter pass 2 mm, of the small 3/4, and the fifth power of it 10 mm."""
    radius = [1e-9, 8e-9] * 4
    result = ended([-1, 1, 2, 3, -1, 4, -1, -1], radius=radius)
    assert problem.captured(result) == pytest.approx(1 - (0.25**5 + 0.75**5) / 2)
    assert problem.selectivity(result) == pytest.approx((1 - 0.25**5) - (1 - 0.75**5))


def test_layers_capture_each_size_with_its_own_probability():
    """All of the smaller half pass, and a third of the larger one. The mean of all to the fourth power would
    be (2/3)^4."""
    n = 10 * SIZE_CLASSES
    caught = [k if k >= n // 2 and k % 3 else -1 for k in range(n)]
    result = ended(caught, radius=np.linspace(1e-9, 9e-9, n))
    assert penetration(result) == pytest.approx(2 / 3)
    # The middle class has both halves.
    expected = (1.0 + (2 / 3) ** 4 + (1 / 3) ** 4) / 3
    assert penetration_of_layers(result, 4.0) == pytest.approx(expected, rel=0.05)
    assert penetration_of_layers(result, 1.0) == pytest.approx(2 / 3)
    only = np.arange(n) < n // 2
    assert penetration_of_layers(result, 4.0, only) == 1.0
    assert penetration_of_layers(ended([2, 3], entered=[-1, -1]), 2.0) == 1.0


def test_lone_fibres_hold_what_they_have_captured(monkeypatch):
    """Single fibres of a filter that is switched off and releases colloids: captures are counted at the end
    of the run, and would otherwise be too few by the part that is released."""
    made = []

    def run(scenes, progress):
        made.extend(scenes)
        return []

    monkeypatch.setattr("tisim.cases.packed_filter.lone_fibre.run", run)
    monkeypatch.setattr("tisim.cases.packed_filter.lone_fibre.sound", lambda results: results)
    filter = filter_of("small", number=3)
    assert filter.adhering
    assert filter.field_end < filter.duration
    lone_fibres(filter, 2)
    assert len(made) == 2
    for one in made:
        by = {effect.kind(): effect for effect in one.effects}
        assert by["capture"].release is None
        assert {by["magnetic_field"].end, by["magnetic_cylinders"].end} == {NO_END}


def test_designs_have_enough_fibres_and_cells():
    """Each has five cells over the diameter of a fibre, up to rounding to sizes of fast transforms."""
    low = {"diameter": 0.8e-3, "aspect": 1.5, "fraction": 0.05, "flux": 0.1}
    high = {"diameter": 0.2e-3, "aspect": 5.0, "fraction": 0.35, "flux": 1.5}
    first, second = (problem.designed(one, 0, **problem.SEARCHED["small"]) for one in (low, high))
    assert first.matrix.number >= problem.FEWEST_FIBRES
    assert first.number == second.number
    for one in (first, second):
        fibre = Cylinder(radius=one.matrix.diameter / 2, length=one.matrix.length)
        (flow,) = (part for part in one.stream((fibre,), one.box()) if isinstance(part, PoreFlow))
        per_diameter = np.array(flow.cells) * one.matrix.diameter / np.subtract(flow.high, flow.low)
        assert (per_diameter >= 5).all()
        assert (per_diameter < 5.5).all()
    assert first.matrix.sides[0] >= 2 * (first.matrix.length + first.matrix.diameter)
    faster = problem.designed({**high, "speed": 1e-3}, 0, **problem.SEARCHED["small"])
    assert faster.duration == pytest.approx(second.duration * problem.SPEED / 1e-3)


@pytest.mark.slow
def test_a_generation_of_filters_is_one_batch():
    """Designs with different numbers of fibres and of cells of their flows get the same memory."""
    low = {"diameter": 0.8e-3, "aspect": 1.5, "fraction": 0.05, "flux": 0.1}
    designs = [low, {**low, "aspect": 3.0, "fraction": 0.2}, {**low, "aspect": 5.0, "fraction": 0.3}]
    scenes = [problem.problem("small").scene(one, k) for k, one in enumerate(designs)]
    assert len({len(one.effects[1].cylinders) for one in scenes}) == 3
    assert len({one.structure() for one in scenes}) > 1
    assert len({one.structure() for one in SharedRooms().scenes(scenes)}) == 1


def test_figure_of_estimates_and_its_table():
    rows = [
        (speed, name, Mean(0.1 * k, 0.01))
        for k, speed in enumerate((1e-4, 1e-3))
        for name in ("matrix", "cascade")
    ]
    axis = figures.neighbours(rows).axes[0]
    assert [one.get_label() for one in axis.containers] == ["matrix", "cascade"]
    assert list(axis.containers[0].lines[0].get_xdata()) == pytest.approx([0.1, 1.0])
    assert figures.table(rows).splitlines()[1] == "0.0001,matrix,0.0,0.01"


def test_sizes_give_the_settings_of_matrix_and_filter():
    made = filter_of("small", seed=4, flux=0.5, aspect=3.0)
    assert made.matrix == Matrix(aspect=3.0, seed=4)
    assert (made.flux, made.number, made.mode) == (0.5, 200, "dynamic")
    assert made.with_packing(7).matrix == replace(made.matrix, seed=7)
    assert filter_of("small", "static").adhering is None


def test_the_picture_shows_captures_before_the_field_is_switched_off(monkeypatch):
    class FewFrames(list):
        times = np.array([0.0, 10.0, 20.0, 30.0])
        scene = None

    def frame(time, captured, out):
        where = np.arange(5)
        captured_by = np.where(where < captured, 0, -1)
        exited = np.where(where >= 5 - out, 1.0, -1.0)
        arrays = {"mass": np.ones(5), "captured_by": captured_by, "exited_at": exited}
        return SimpleNamespace(time=time, arrays=arrays)

    drawn = []
    monkeypatch.setattr(pictures, "draw_filter", lambda *given: drawn.append(given[-1]))
    looks = FewFrames(frame(*given) for given in ((0.0, 0, 0), (10.0, 3, 0), (20.0, 3, 1), (30.0, 1, 4)))
    figure = pictures.pictures(looks)["filter.png"]
    assert drawn == [20.0]
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[1].lines}
    np.testing.assert_allclose(lines["captured"], [0, 0.6, 0.6, 0.2])
    np.testing.assert_allclose(lines["free, inside"], [1, 0.4, 0.2, 0])


def test_pressure_drop_of_an_empty_tube():
    """Poiseuille: 8 eta Q L / (pi R^4), with Q the speed over the square around the tube times its area."""
    radius, length, speed = 1e-3, 4e-3, 2e-4
    tube = PoreFlow(
        low=(-radius, -radius, 0.0), high=(radius, radius, length), column="tube", cells=(48, 48, 4),
        speed=speed, viscosity=1e-3,
    )  # fmt: skip
    result = SimpleNamespace(scene=SimpleNamespace(effects=[tube]))
    expected = 8 * 1e-3 * speed * (2 * radius) ** 2 * length / (np.pi * radius**4)
    assert pressure_drop(result) == pytest.approx(expected, rel=5e-3)
    assert problem.superficial_velocity(result) == speed
