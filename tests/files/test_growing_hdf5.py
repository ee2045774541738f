"""Trajectories are valid after every single write, also if a kill or a full disk ends the writing."""

from __future__ import annotations

import io
import os
import signal

import h5py
import numpy as np
import pytest

from tests.files.full_disk import files_of_at_most
from tests.scenes import scene
from tisim import InputError, RunError
from tisim.files import atomic
from tisim.files.hdf5 import SIZE, GrowingFile, SharedFile, is_valid, lookup3, superblock
from tisim.io.reader import Frame, frames
from tisim.io.trajectory import LIBVER, Trajectory

GRAINS = 300
STILL = scene([(0, 0, 0)] * GRAINS, [(0.0, 0, 0)] * GRAINS)
"""A scene that is not run; its frames are made by hand."""


def frame(k):
    """Frame k, of random numbers that identify it and do not compress, with up to 6 grains below capacity."""
    draw, n = np.random.Generator(np.random.Philox(k)), GRAINS - k % 7
    arrays = dict(
        position=draw.random((n, 3)), velocity=draw.random((n, 3)), mass=draw.random(n),
        radius=draw.random(n), id=np.arange(n),
    )  # fmt: skip
    return Frame(1e-3 * (k + 1), 10 * k, arrays)


def same(actual, k):
    expected = frame(k)
    assert (actual.time, actual.step) == (expected.time, expected.step)
    assert actual.arrays.keys() == expected.arrays.keys()
    for name, values in expected.arrays.items():
        np.testing.assert_array_equal(actual.arrays[name], values)


def whole_frames(path, least):
    """Number of frames in the file; checks that they are as written and that no written frame is missing."""
    with frames(path) as sequence:
        assert least <= len(sequence) <= least + 1
        for k, one in enumerate(sequence):
            same(one, k)
        return len(sequence)


@pytest.mark.parametrize("rows", [4, pytest.param(12, marks=pytest.mark.slow)])
def test_a_trajectory_can_be_read_by_others_after_every_write(tmp_path, monkeypatch, rows):
    """The writer may be killed at any write: HDF5 opens the file without tisim and finds all frames."""
    path, contents = tmp_path / "t.h5", []

    def note(self, at, piece, put=GrowingFile._write_piece):
        put(self, at, piece)
        contents.append((path.read_bytes(), count))

    monkeypatch.setattr(GrowingFile, "_write_piece", note)
    count = 0
    with Trajectory(path, [STILL]) as trajectory:
        for count in range(rows):
            trajectory.write(0, frame(count))
    assert len(contents) > 8 * rows
    for content, least in contents:
        path.write_bytes(content)
        whole_frames(path, least)
        with h5py.File(io.BytesIO(content)) as plain:
            assert len(plain["particles/all/position/value"]) >= least


def test_a_trajectory_can_be_read_while_it_is_written(tmp_path):
    path = tmp_path / "t.h5"
    with Trajectory(path, [STILL]) as trajectory:
        for k in range(5):
            trajectory.write(0, frame(k))
            assert whole_frames(path, k + 1) == k + 1
            with h5py.File(path, "r") as plain:
                assert plain["particles/all/position/step"][:].tolist() == [10 * j for j in range(k + 1)]


def test_frames_that_come_after_the_file_was_opened_are_read_too(tmp_path):
    """HDF5 itself would refuse them, as they are behind the end of the file at the time of opening."""
    path = tmp_path / "t.h5"
    with Trajectory(path, [STILL]) as trajectory, frames(path) as sequence:
        for k in range(5):
            trajectory.write(0, frame(k))
        assert len(sequence) == 5
        for k in range(5):
            same(sequence[k], k)


def test_a_half_written_block_is_read_again(tmp_path, monkeypatch):
    """This holds for each block of the file; HDF5 alone would report damage."""
    path = tmp_path / "t.h5"
    with Trajectory(path, [STILL]) as trajectory:
        trajectory.write(0, frame(0))
    calls, at = 0, 0

    def torn(self, size, read_stable=SharedFile._read_stable):
        nonlocal calls
        calls += 1
        content = read_stable(self, size)
        return bytes(len(content) // 2) + content[len(content) // 2 :] if calls == at else content

    monkeypatch.setattr(SharedFile, "_read_stable", torn)
    while calls >= at:
        calls, at = 0, at + 1
        assert whole_frames(path, 1) == 1
    assert at > 10


def test_a_trajectory_that_is_cut_short_is_refused(tmp_path):
    path = tmp_path / "t.h5"
    with Trajectory(path, [STILL]) as trajectory:
        trajectory.write(0, frame(0))
    os.truncate(path, path.stat().st_size - 1)
    with pytest.raises(InputError, match="file must be whole; received"), frames(path):
        pass


@pytest.mark.parametrize(
    "part",
    [0.1, 0.5, 0.7, 0.98, *(pytest.param(p, marks=pytest.mark.slow) for p in np.linspace(0.02, 0.96, 16))],
)
def test_a_full_disk_is_reported_and_keeps_the_written_frames(tmp_path, part):
    path, count = tmp_path / "t.h5", 0

    def write():
        nonlocal count
        with Trajectory(path, [STILL]) as trajectory:
            for count in range(10):
                trajectory.write(0, frame(count))

    write()
    size = int(path.stat().st_size * part)
    path.unlink()
    count = 0
    message = (
        "t.h5 could not be written: File too large; (frames before are|everything stored before is) intact"
    )
    with files_of_at_most(size), pytest.raises(RunError, match=message):
        write()
    if path.exists():
        assert whole_frames(path, count) == count
        assert path.stat().st_size <= size
    assert [file.name for file in tmp_path.iterdir()] in ([], ["t.h5"])


@pytest.mark.parametrize("last", [3, 9])
def test_a_full_disk_while_a_run_resumes_leaves_the_earlier_file(tmp_path, last):
    path = tmp_path / "t.h5"
    with Trajectory(path, [STILL]) as trajectory:
        for k in range(10):
            trajectory.write(0, frame(k))
    content = path.read_bytes()
    with files_of_at_most(len(content) // 4), pytest.raises(RunError, match="could not be written"):
        Trajectory.resume(path, STILL, frame(last).time)
    assert path.read_bytes() == content
    assert [file.name for file in tmp_path.iterdir()] == ["t.h5"]
    with Trajectory.resume(path, STILL, frame(last).time):
        assert whole_frames(path, last + 1) == last + 1


def test_a_trajectory_killed_before_its_first_frame_can_be_opened_and_resumed(tmp_path):
    path = tmp_path / "t.h5"
    trajectory = Trajectory(path, [STILL])
    assert whole_frames(path, 0) == 0
    trajectory.close()
    with Trajectory.resume(path, STILL, 1.0) as trajectory:
        trajectory.write(0, frame(0))
    assert whole_frames(path, 1) == 1


def test_a_trajectory_killed_while_it_is_created_does_not_exist(tmp_path, monkeypatch):
    class Killed(BaseException):
        pass

    def killed(handle):
        raise Killed

    monkeypatch.setattr("tisim.files.atomic.os.fsync", killed)
    with pytest.raises(Killed):
        Trajectory(tmp_path / "t.h5", [STILL])
    assert not (tmp_path / "t.h5").exists()


def test_a_folder_that_takes_no_file_is_reported_before_anything_runs(tmp_path):
    (tmp_path / "t.h5").mkdir()
    with pytest.raises(InputError, match="trajectory must be a file that can be written; received"):
        Trajectory(tmp_path / "t.h5", [STILL])


def interrupted(monkeypatch, owner, name, act, stride):
    """Repeat ``act`` with a Ctrl-C at every ``stride``-th call of the method ``name`` of ``owner``.

    Each repetition raises it at a later call, until there are no more. Returns the number of calls."""
    method, calls, at = getattr(owner, name), 0, 1 - stride

    def called(self, *arguments):
        nonlocal calls
        calls += 1
        if calls == at:
            signal.raise_signal(signal.SIGINT)
        return method(self, *arguments)

    monkeypatch.setattr(owner, name, called)
    while calls >= at:
        calls, at = 0, at + stride
        try:
            act()
        except KeyboardInterrupt:
            assert calls >= at
        else:
            assert calls < at, "the Ctrl-C was lost"
    return calls


@pytest.mark.parametrize("name", ["write", "readinto", "truncate"])
def test_ctrl_c_while_hdf5_writes_waits_for_the_frame(tmp_path, monkeypatch, name):
    path = tmp_path / "t.h5"

    def write():
        count = 0
        try:
            with Trajectory(path, [STILL]) as trajectory:
                for k in range(2):
                    trajectory.write(0, frame(k))
                    count = k + 1
        finally:
            whole_frames(path, count)

    stride, least = {"write": (4, 50), "readinto": (7, 2), "truncate": (1, 0)}[name]
    assert interrupted(monkeypatch, GrowingFile, name, write, stride) > least


@pytest.mark.parametrize("name", ["readinto", "seek"])
def test_ctrl_c_while_hdf5_reads_waits_for_the_frame(tmp_path, monkeypatch, name):
    path = tmp_path / "t.h5"
    with Trajectory(path, [STILL]) as trajectory:
        for k in range(2):
            trajectory.write(0, frame(k))
    assert interrupted(monkeypatch, SharedFile, name, lambda: whole_frames(path, 2), 3) > 1


def test_ctrl_c_while_a_run_resumes_leaves_the_earlier_file(tmp_path, monkeypatch):
    path = tmp_path / "t.h5"
    with Trajectory(path, [STILL]) as trajectory:
        for k in range(3):
            trajectory.write(0, frame(k))

    def go_on():
        try:
            Trajectory.resume(path, STILL, 1.0).close()
        finally:
            whole_frames(path, 3)
            assert [file.name for file in tmp_path.iterdir()] == ["t.h5"]

    assert interrupted(monkeypatch, GrowingFile, "write", go_on, 17) > 50


def test_a_file_that_another_process_has_locked_is_not_an_input_error(tmp_path, monkeypatch):
    monkeypatch.setattr(atomic, "LOCK_TIMEOUT", 0.01)
    with (
        atomic.locked(tmp_path / "t.h5.new", exclusive=True),
        pytest.raises(RunError, match=r"t\.h5\.new has been locked by another process for 0\.01 s$"),
    ):
        Trajectory(tmp_path / "t.h5", [STILL])


@pytest.mark.parametrize("size", [0, 1, 1000])
def test_the_superblock_is_the_one_that_hdf5_writes(size):
    image = io.BytesIO()
    with h5py.File(image, "w", libver=LIBVER) as file:
        file["x"] = np.zeros(size)
    block = image.getvalue()[:SIZE]
    assert is_valid(block)
    assert superblock(block, len(image.getvalue())) == block
    assert not any(is_valid(block[:k] + bytes([block[k] ^ 1]) + block[k + 1 :]) for k in range(SIZE))
    assert not is_valid(block[:-1])


def test_lookup3_agrees_with_its_author():
    """A value from the comments of lookup3.c."""
    assert lookup3(b"Four score and seven years ago") == 0x17770551


def test_data_that_could_not_be_written_are_read_back(tmp_path):
    """HDF5 may read back its own writes, and ends the process if they are missing."""
    path = tmp_path / "f"
    with h5py.File(path, "w", libver=LIBVER) as file:
        file["x"] = np.zeros(10)
    content = path.read_bytes()
    with GrowingFile(path) as growing, files_of_at_most(len(content) + 5):
        growing.seek(0, os.SEEK_END)
        growing.write(b"0123456789")
        assert growing.failure.strerror == "File too large"
        growing.seek(len(content) - 4)
        growing.write(b"abcdef")
        assert growing.seek(0, os.SEEK_END) == len(content) + 10
        growing.seek(len(content) - 6)
        assert growing.read(20) == content[-6:-4] + b"abcdef" + b"23456789" + bytes(4)
    assert path.read_bytes() == content
