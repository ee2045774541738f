"""``tisim.read`` reads back all files of runs and studies, and detects their type by their content."""

import dataclasses
import math
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

import tisim
from tests.accuracy.scenes import oscillator
from tests.scenes import compiled, flow, scene
from tisim import InputError, Recording, Result, Scene, Status, reading
from tisim.accuracy import Row, Study, storage
from tisim.effects import Contact, ContactFriction
from tisim.engine import checkpoint
from tisim.io import run_folder
from tisim.io.reader import Frames, world_count
from tisim.io.run_folder import RunFolder
from tisim.optimize.storage import hdf5_store
from tisim.optimize.storage.cache import Cache

pytestmark = pytest.mark.long

FLOWS = [flow(0, grains=60, surface_energy=1e3), flow(1, grains=60, duration=4e-4, surface_energy=1e3)]
CONTACT = Contact(stiffness=1.0), ContactFriction(stiffness=1.0, static=0.5, dynamic=0.4)
CAPACITY = max(world_scene.capacity() for world_scene in FLOWS)


@pytest.fixture(scope="module")
def completed_run(tmp_path_factory):
    """Two flows: a trajectory of both, a trajectory of the first, a checkpoint half-way, and results."""
    folder = tmp_path_factory.mktemp("ran")
    simulation = compiled(FLOWS[0], 2, CAPACITY)
    simulation.load(FLOWS)
    both, half = Recording(folder / "both.h5", frames=7), folder / "half.h5"
    with both.observer(simulation) as recorder:
        simulation.run(until=3e-4, observers=[recorder])
        simulation.checkpoint(half)
        middle = simulation.results()
        simulation.run(observers=[recorder])
    results = simulation.results()
    simulation.load(FLOWS[0])
    with Recording(folder / "one.h5", frames=5).observer(simulation) as recorder:
        simulation.run(observers=[recorder])
    return SimpleNamespace(folder=folder, half=half, middle=middle, results=results)


def identical(actual, expected):
    """Assert that two Results are equal in all fields, with arrays equal in each bit and in type."""
    for field in dataclasses.fields(Result):
        one, other = getattr(actual, field.name), getattr(expected, field.name)
        if field.name not in ("state", "start"):
            assert one == other, field.name
            continue
        assert one.keys() == other.keys()
        for name, values in one.items():
            assert (values.dtype, values.shape) == (other[name].dtype, other[name].shape), name
            assert values.tobytes() == other[name].tobytes(), name


@pytest.mark.parametrize("world", [0, 1])
def test_a_result_is_the_same_to_the_bit(completed_run, tmp_path, world):
    folder, result = RunFolder(tmp_path), completed_run.results[world]
    run_folder.write(result, folder)
    identical(tisim.read(tmp_path), result)
    identical(tisim.read(str(folder.result)), result)
    assert tisim.read(tmp_path / "scene.toml") == result.scene
    assert tisim.read(tmp_path / "versions.json") == {**run_folder.versions(), **result.settings}


def test_a_failed_result_and_one_of_odd_numbers_are_the_same_to_the_bit(completed_run, tmp_path):
    odd = np.array([[np.nan, -0.0, 5e-324]])
    result = dataclasses.replace(
        completed_run.results[0], state={"position": odd}, start={},
        time=0.1 + 0.2, work={"steps": 2**53 + 1},
        status=Status(False, "found at t = 1 s: µ"), settings={"edited": "velocity at t = 1 s"},
        measures={"peak": math.inf, "least": 1e-300}, wall_s=1 / 3,
    )  # fmt: skip
    run_folder.write_result(result, tmp_path / "r.h5")
    identical(tisim.read(tmp_path / "r.h5"), result)


def test_all_quantities_have_units(tmp_path):
    """This includes forces, torques and quantities of a start that no effect needs."""
    pair = scene([(0, 0, 0), (1, 0, 0)], [(0, 0, 0)] * 2, CONTACT)
    units = {"force": "N", "torque": "N m", "spin": "rad/s", "velocity": "m/s", "temperature": "K"}
    arrays = {name: np.zeros((2, 3)) for name in units}
    run_folder.write_result(Result(pair, arrays, arrays, 0.0, {}, Status(True, ""), 0.0), tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5") as file:
        assert {name: values.attrs["unit"] for name, values in file["end"].items()} == units


def test_frames_of_a_trajectory(completed_run):
    trajectory = tisim.read(completed_run.folder / "one.h5")
    assert len(trajectory) == 6
    assert trajectory.scene == FLOWS[0]
    assert (trajectory.times[0], trajectory.times[-1]) == (0.0, FLOWS[0].duration)
    first, last = trajectory[0], trajectory[-1]
    np.testing.assert_array_equal(first.arrays["position"], completed_run.results[0].start["position"])
    order = np.argsort(completed_run.results[0].state["id"])
    np.testing.assert_array_equal(last.arrays["velocity"], completed_run.results[0].state["velocity"][order])
    times = trajectory.times.tolist()
    assert [frame.time for frame in trajectory] == times
    assert [frame.time for frame in trajectory[1:3]] == times[1:3]
    with trajectory:
        assert [frame.time for frame in trajectory] == times
        assert trajectory[2].time == times[2]
    assert trajectory[2].time == times[2]  # also after the with block
    with pytest.raises(IndexError):
        _ = trajectory[6]


def test_worlds_of_a_trajectory(completed_run):
    with tisim.read(completed_run.folder / "both.h5") as trajectory:
        assert [world.scene for world in trajectory.worlds] == FLOWS
        for world, result in zip(trajectory.worlds, completed_run.results, strict=True):
            assert world[-1].time == result.time
            assert len(world) == len(world.times) == 8
    with pytest.raises(InputError, match=r"trajectory must be of one world \(or ask worlds\[w\]\)"):
        len(trajectory)


def test_a_frame_is_read_on_access(completed_run, monkeypatch):
    """The cost of a frame does not depend on the number of frames."""
    rows = []
    row = Frames._read_row
    monkeypatch.setattr(
        Frames,
        "_read_row",
        lambda self, file, k: rows.append(k) or row(self, file, k),
    )
    trajectory = tisim.read(completed_run.folder / "one.h5")
    assert len(trajectory.times) == 6
    assert rows == []
    _ = trajectory[3]
    assert rows == [3]


def test_a_checkpoint_is_the_state_of_each_world(completed_run):
    snapshot = tisim.read(completed_run.half)
    assert snapshot.times.tolist() == [result.time for result in completed_run.middle]
    assert snapshot.steps.tolist() == [result.work["steps"] for result in completed_run.middle]
    for state, result in zip(snapshot.states, completed_run.middle, strict=True):
        assert state.keys() == result.state.keys()
        for name, values in state.items():
            np.testing.assert_array_equal(values, result.state[name], err_msg=name)


def test_rows_of_a_study(tmp_path):
    study = Study(oscillator())
    errors = ((0.1, 0.01),) * len(study.quantities)
    study.rows = [
        Row("verlet", "dt = 1", "Verlet()", "", "f64", 1, (0.1, 0.3), 5.0, 6.0, 0.0, errors),
        Row("verlet", "dt = 2", "Verlet()", "", "f64", 1, failed="a force so strong"),
    ]  # fmt: skip
    storage.write(study, tmp_path)
    good, failed = tisim.read(tmp_path / "cost.h5")
    assert good == study.rows[0]
    assert (failed.key, failed.failed) == (study.rows[1].key, "a force so strong")
    assert tisim.read(tmp_path)[0] == good


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.h5", None, "file to read must be an existing file; received "),
        (
            "a.png",
            b"\x89PNG\r\n\x1a\n\xff\xfe",
            "file to read must be the folder of a run",
        ),
        ("a.csv", b"method,setting\nverlet,1\n", "file to read must be the folder of a run"),
        ("a.json", b'{"name": 1}', "file to read must be the folder of a run"),
        ("a.toml", b"name = ", "scene file must be TOML; received "),
        ("b.toml", b'name = "x"', "scene.particles must be given"),
        ("a.h5", b"\x89HDF\r\n\x1a\n" + bytes(200), "file to read must be .* whole and with its checksum"),
        (
            "search.h5",
            hdf5_store.build_image([], {}),
            "a search is read by `tisim.optimize.read`",
        ),
        (".", None, r"folder must be one with a whole run or study \(the files of an interrupted run are"),
    ],
)
def test_unreadable_files_are_refused(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        tisim.read(tmp_path / name)


@pytest.mark.parametrize(("name", "received"), [("a\0.h5", "a NUL"), ("x" * 300, "that is too long")])
@pytest.mark.parametrize("reader", [tisim.read, world_count, checkpoint.snapshot, Cache])
def test_a_name_that_no_file_can_have_is_refused(reader, name, received):
    with pytest.raises(InputError, match=f"must be a regular file .*; received a name (with )?{received}$"):
        reader(name)


def test_the_format_of_a_search_is_the_one_known():
    assert hdf5_store.EVALUATIONS_FORMAT.startswith(reading.SEARCH_FORMAT)


def test_a_scene_of_any_name(tmp_path):
    (tmp_path / "scene").write_text(FLOWS[0].to_toml())
    assert tisim.read(tmp_path / "scene") == Scene.from_toml(tmp_path / "scene") == FLOWS[0]
