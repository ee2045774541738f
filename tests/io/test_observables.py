"""Observables of trajectories: the measurements of effects are stored beside the frames of a world."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import tisim
from tests.effects.contact.grains import USUAL
from tests.scenes import scene
from tisim import InputError, Material
from tisim.effects import Granular, Gravity, Servo, Walls
from tisim.engine.assembly import measured
from tisim.geometry import Plane
from tisim.io.export import export
from tisim.io.reader import Frame, frames
from tisim.io.trajectory import Trajectory, recorded_fields
from tisim.operators import AtRest, Outflow
from tisim.plotting.loads import bodies, loads

EFFECTS = (
    Granular(),
    Walls(name="lid", planes=[Plane()], motion=Servo(force=2.0, limit=0.1)),
    Walls(name="floor", planes=[Plane()]),
    Gravity(),
    Outflow(planes=[Plane()]),
    AtRest(time=1.0),
)
PRESSED = scene([[0.5] * 3], np.zeros((1, 3)), EFFECTS, 0.1, materials={"grain": Material(**USUAL)})
UNITS = {
    **{f"{body}_force_{axis}": "N" for body in ("lid", "floor") for axis in "xyz"},
    **{f"{body}_torque_{axis}": "N m" for body in ("lid", "floor") for axis in "xyz"},
    **{"lid_travel": "m", "lid_speed": "m s-1", "lid_moved_at": "s", "outflow_mass": "kg"},
    **dict.fromkeys(("kinetic_ratio", "unbalanced_ratio")),
}
TIMES = 0.025 * np.arange(4)


def value(name, k):
    """A number that identifies the measure and the frame."""
    return float(1 + sorted(UNITS).index(name) + 0.1 * k)


def frame(k):
    arrays = {field.name: np.zeros(field.shape(1)) for field in recorded_fields(PRESSED)}
    return Frame(float(TIMES[k]), 10 * k, arrays, {name: value(name, k) for name in UNITS})


def write(path, *more):
    """Write four frames that are made by hand; nothing is run."""
    with Trajectory(path, [PRESSED, *more]) as trajectory:
        for w in range(1 + len(more)):
            for k in range(4):
                trajectory.write(w, frame(k))
    return path


@pytest.fixture
def file(tmp_path):
    return write(tmp_path / "t.h5")


def test_observables_belong_to_their_frames(file):
    with frames(file) as sequence:
        assert sequence.measures.keys() == UNITS.keys()
        for name, series in sequence.measures.items():
            assert series.tolist() == [value(name, k) for k in range(4)]
        assert [one.measures for one in sequence] == [frame(k).measures for k in range(4)]
    read = tisim.read(file)
    assert read.measures["floor_force_z"].tolist() == [value("floor_force_z", k) for k in range(4)]


def test_the_layout_of_observables_follows_h5md(tmp_path):
    """Each of several worlds has a group; time and step are hard links to the datasets of the positions."""
    with h5py.File(write(tmp_path / "t.h5", PRESSED)) as read:
        assert set(read["observables"]) == set(read["particles"]) == {"world_0", "world_1"}
        for name, group in read["observables"].items():
            assert set(group) == set(UNITS)
            for measure, unit in UNITS.items():
                observable = group[measure]
                assert observable["value"].attrs.get("unit") == unit
                assert observable["value"].shape == observable["time"].shape == (4,)
                assert observable["time"] == read[f"particles/{name}/position/time"]
                assert observable["step"] == read[f"particles/{name}/position/step"]


def test_a_scene_without_measures_has_no_observables(tmp_path):
    with Trajectory(tmp_path / "t.h5", [scene([(0, 0, 0)], [(0, 0, 0)])]):
        pass
    with h5py.File(tmp_path / "t.h5") as read, frames(tmp_path / "t.h5") as sequence:
        assert "observables" not in read
        assert sequence.measures == {}


def test_a_number_that_is_damaged_is_refused(file):
    with h5py.File(file, "r+") as damaged:
        damaged["observables/all/floor_force_z/value"][2] += 1e-9
    with pytest.raises(InputError, match="undamaged; received frame 2"), frames(file) as sequence:
        len(sequence)


def test_observables_are_in_a_copy_and_in_a_resumed_file(file, tmp_path):
    copied = export(file, "h5md", tmp_path)
    Trajectory.resume(file, PRESSED, float(TIMES[1])).close()
    for path, count in ((copied, 4), (file, 2)):
        with frames(path) as sequence:
            assert [one.measures for one in sequence] == [frame(k).measures for k in range(count)]


def test_a_file_without_observables_is_copied(tmp_path):
    """It may come from a version of tisim without one of the measures."""
    with Trajectory(tmp_path / "t.h5", [PRESSED]) as trajectory:
        trajectory.write(0, Frame(0.0, 0, frame(0).arrays))
    with frames(tmp_path / "t.h5") as sequence:
        assert all(np.isnan(list(sequence[0].measures.values())))


def test_forces_are_drawn_against_time(file):
    """Each body has a row with force and torque, and the one with a servo also its displacement."""
    with frames(file) as sequence:
        assert bodies(sequence) == ["floor", "lid"]
        figure, series = loads(sequence), sequence.measures
    drawn = [panel for panel in figure.axes if panel.axison]
    names = ["force on floor", "torque on floor", "force on lid", "torque on lid", "travel of lid"]
    assert [panel.get_ylabel().split(" (")[0] for panel in drawn] == names
    for panel, name in zip(drawn, names, strict=True):
        what, _, body = name.split()
        stem = f"{body}_{what}"
        of = [stem] if what == "travel" else [f"{stem}_{axis}" for axis in "xyz"]
        for line, measure in zip(panel.lines, of, strict=True):
            np.testing.assert_array_equal(line.get_xdata(), TIMES)
            np.testing.assert_array_equal(line.get_ydata(), series[measure])


def test_every_measure_has_its_unit():
    assert {name: unit or None for name, unit in measured(EFFECTS).items()} == {
        **UNITS, "lid_speed": "m/s",
    }  # fmt: skip
