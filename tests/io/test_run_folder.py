"""The output folder of a run: its files, its picture, and protection against overwriting."""

import json
import tomllib

import h5py
import numpy as np
import pytest

from tests.scenes import scene, simulate
from tisim import InputError, RunError, Scene, read
from tisim.backend import runtime
from tisim.files import output_folder
from tisim.files.output_folder import MARKER, ensure_writable
from tisim.io.run_folder import DATA, RUN_FILES, RunFolder, write
from tisim.io.trajectory import Trajectory
from tisim.plotting.cloud import cloud

ONE = [(0.0, 0.0, 0.0)]
SCENE = scene(ONE, ONE, dt=1e-6, steps=5)


@pytest.fixture(scope="module")
def result():
    return simulate([scene([(0, 0, 0), (5e-3, 0, 0)], [(1, 0, 0), (0, 0, 0)], dt=1e-6, steps=5)])[0]


@pytest.mark.parametrize("failure", [ValueError("Key backend: 'x' is not\na valid value"), MemoryError()])
def test_a_picture_that_cannot_be_drawn_costs_no_data(result, tmp_path, capsys, failure):
    def fails(result):
        assert read(tmp_path / "result.h5").time == result.time, "the data are there before anything is drawn"
        raise failure

    (tmp_path / "cloud.png").write_bytes(b"of an earlier run")
    paths = write(result, RunFolder(tmp_path), fails)
    names = {"result.h5", "scene.toml", "versions.json"}
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in paths} == names
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{tmp_path / 'cloud.png'} could not be drawn: {type(failure).__name__}")
    assert line.endswith("The picture is left out; the data are written.")


def test_whole_run_is_in_the_folder(result, tmp_path):
    folder = RunFolder(tmp_path)
    folder.checkpoint.write_bytes(b"of before")
    paths = write(result, folder, cloud)
    names = {"result.h5", "scene.toml", "versions.json", "cloud.png"}
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in paths} == names
    with h5py.File(folder.result) as file:
        assert (file.attrs["ok"], file.attrs["time"]) == (True, result.time)
        assert json.loads(file.attrs["settings"]) == result.settings
        assert dict(file["work"].attrs) == result.work
        assert file["end/velocity"].attrs["unit"] == "m/s"
        assert file["start/position"].shape == (2, 3)
        for name, values in result.state.items():
            np.testing.assert_array_equal(file["end"][name], values)
        assert Scene.from_dict(tomllib.loads(file.attrs["scene"])) == result.scene
    assert Scene.from_toml(tmp_path / "scene.toml").digest() == result.scene.digest()
    versions = json.loads((tmp_path / "versions.json").read_text())
    assert {"tisim", "backend", "numpy", "h5py", "python", "platform", *result.settings} == set(versions)
    current = runtime.current()
    assert result.settings == {
        "precision": "f64",
        "device": "cpu",
        "arithmetic": "strict",
        "threads": str(current.threads),
    }


def test_folder_that_holds_a_run_is_refused(tmp_path):
    folder = RunFolder(tmp_path / "out")
    folder.check(SCENE)
    assert not folder.path.exists()
    with pytest.raises(InputError, match="one that an interrupted run has left"):
        folder.check(SCENE, fresh=False)
    output_folder.claim(folder.path, RUN_FILES)
    folder.checkpoint.touch()
    assert folder.check(SCENE)
    assert folder.check(SCENE, fresh=False)
    assert not folder.check(SCENE, fresh=True)
    assert not folder.check(SCENE, overwrite=True)
    folder.checkpoint.unlink()
    folder.trajectory.touch()
    with pytest.raises(InputError, match=r"without frames of another scene \(or give --fresh\)"):
        folder.check(SCENE)
    assert not folder.check(SCENE, fresh=True)
    folder.trajectory.unlink()
    folder.result.touch()
    folder.checkpoint.touch()  # left by a run that was killed at its very end
    for fresh in (None, True):
        with pytest.raises(InputError, match="without a finished run"):
            folder.check(SCENE, fresh)
    with pytest.raises(InputError, match="one that an interrupted run has left"):
        folder.check(SCENE, fresh=False)
    assert not folder.check(SCENE, overwrite=True)


def test_a_folder_belongs_to_one_run_at_a_time(tmp_path):
    folder = RunFolder(tmp_path / "out")
    with folder.claim(SCENE):
        folder.checkpoint.touch()
        for call in (lambda: folder.check(SCENE), lambda: folder.claim(SCENE, overwrite=True).__enter__()):
            with pytest.raises(InputError, match="must be without a command that is still at work there"):
                call()
    assert folder.check(SCENE)


@pytest.mark.parametrize("options", [{"fresh": True}, {"overwrite": True}])
def test_beginning_anew_removes_the_earlier_files_before_anything_is_written(tmp_path, options):
    folder = RunFolder(tmp_path)
    for name in (*DATA, "notes.txt"):
        (tmp_path / name).touch()
    output_folder.claim(tmp_path, RUN_FILES, overwrite=True)
    folder.result.unlink()
    with folder.claim(SCENE) as goes_on:
        assert (goes_on, folder.checkpoint.exists()) == (True, True)
    with folder.claim(SCENE, **options) as goes_on:
        assert not goes_on
        assert {path.name for path in tmp_path.iterdir()} == {"notes.txt", MARKER, output_folder.LOCK}


def test_checking_whether_a_folder_is_in_use_creates_no_files(tmp_path):
    RunFolder(tmp_path).check(SCENE)
    assert list(tmp_path.iterdir()) == []


def test_files_that_another_run_has_left_meanwhile_are_not_replaced(tmp_path):
    folder = RunFolder(tmp_path)
    folder.check(SCENE)
    with folder.claim(SCENE):
        folder.result.touch()
    with pytest.raises(InputError, match="without a finished run"), folder.claim(SCENE):
        pass
    folder.result.unlink()
    with (
        pytest.raises(InputError, match="one that an interrupted run has left"),
        folder.claim(SCENE, fresh=False),
    ):
        pass


def test_frames_of_a_run_that_was_killed_before_its_first_checkpoint_are_made_again(tmp_path):
    """The same command begins anew; frames of another scene and damaged frames are kept."""
    folder = RunFolder(tmp_path)
    output_folder.claim(tmp_path, RUN_FILES)
    Trajectory(folder.trajectory, [SCENE]).close()
    assert not folder.check(SCENE)
    other = SCENE.model_copy(update={"seed": 7})
    for scene_, damage in ((other, b""), (SCENE, b"damage")):
        if damage:
            folder.trajectory.write_bytes(damage)
        with pytest.raises(InputError, match=r"without frames of another scene \(or give --fresh\)"):
            folder.check(scene_)
    assert not folder.check(SCENE, fresh=True)


def test_unwritable_folder_is_an_input_error(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="output folder must be writable; received"):
        ensure_writable(tmp_path / "file" / "below")


def test_full_disk_leaves_no_result(result, tmp_path, monkeypatch):
    def full(handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tisim.files.atomic.os.fsync", full)
    with pytest.raises(RunError, match="No space left on device"):
        write(result, RunFolder(tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_one_grain_can_be_drawn():
    alone = simulate([scene(ONE, ONE)])[0]
    figure = cloud(alone)
    titles = [axis.get_title("left").split(":")[0] for axis in figure.axes]
    assert titles == ["(a) start, t = 0 s", "(b) end, t = 1 ns"]
