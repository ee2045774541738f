"""All readers refuse damaged and foreign files with an error message of one line."""

from __future__ import annotations

import json
import os

import h5py
import numpy as np
import pytest

from tests.files.test_growing_hdf5 import STILL, frame, same
from tests.soak import damage
from tisim import InputError
from tisim.accuracy import storage
from tisim.engine import checkpoint
from tisim.files import checksum
from tisim.files.hdf5 import SIGNATURE
from tisim.io import h5md
from tisim.io.export import export
from tisim.io.reader import frames, world_count
from tisim.io.trajectory import LIBVER, Trajectory


@pytest.mark.parametrize(
    "name", ["result.h5", "trajectory.h5", "cost.h5", pytest.param("checkpoint.h5", marks=pytest.mark.long)]
)
def test_all_damage_is_detected(tmp_path, name):
    """With flipped bits, lost or swapped pages, or cut short, a file is read correctly or refused."""
    kind, rng = damage.KINDS[name], np.random.default_rng(12)
    path = kind.make(tmp_path)
    content, whole = path.read_bytes(), kind.read(path)
    refusals = 0
    for _ in range(40):
        path.write_bytes(damage.with_mishap(content, rng))
        column, why = damage.verdict(kind, path, whole)
        assert column == "", (column, why)
        refusals += why != whole
    assert refusals > 10


@pytest.mark.slow
@pytest.mark.parametrize("name", damage.KINDS)
def test_hundreds_of_damaged_files(tmp_path, name):
    reader = damage.Reader()
    try:
        counts = damage._count(name, np.random.default_rng(4), 200, tmp_path / "files", reader)
    finally:
        reader.end()
    assert counts.clean, counts


def test_a_kind_whose_undamaged_file_is_refused_is_not_counted(tmp_path):
    """Its damaged files would all be refused as well, which would prove nothing."""

    def reader(name, action, path, whole=None, patience=0.0):
        if action == "make":
            (path / name).write_bytes(bytes(9))
            return path / name
        return "", "file must be another; received this one"

    with pytest.raises(AssertionError, match=r"the undamaged result\.h5 is not read: file must be another"):
        damage._count("result.h5", np.random.default_rng(0), 3, tmp_path / "files", reader)


def test_every_lost_page_of_a_result_is_found(tmp_path):
    """HDF5 alone would read most lost pages as data."""
    path = damage._result(tmp_path)
    content = path.read_bytes()
    pages = [at for at in range(0, len(content), 512) if any(content[at : at + 512])]
    assert len(pages) > 20
    for at in pages:
        path.write_bytes(content[:at] + bytes(len(content[at : at + 512])) + content[at + 512 :])
        with (
            pytest.raises(InputError, match=r"file must be a trajectory.h5 or result.h5 of a run"),
            frames(path),
        ):
            pass


def test_damage_to_a_frame_is_damage_to_that_frame(tmp_path):
    path = damage._trajectory(tmp_path)
    with h5py.File(path) as file:
        place = file["particles/all/velocity/value"].id.get_chunk_info(3).byte_offset
    content = path.read_bytes()
    path.write_bytes(content[: place + 9] + bytes([content[place + 9] ^ 4]) + content[place + 10 :])
    with frames(path) as sequence:
        for k in (0, 2, 4):
            same(sequence[k], k)
        with pytest.raises(InputError, match="file must be undamaged; received"):
            sequence[3]
    with pytest.raises(InputError, match="file must be undamaged; received"):
        Trajectory.resume(path, STILL, 1.0)
    assert [file.name for file in tmp_path.iterdir()] == ["trajectory.h5"]


def test_numbers_that_hdf5_does_not_check_are_checked(tmp_path):
    """Times, steps and small frames are stored as plain numbers, in which HDF5 detects no damage."""
    path = damage._trajectory(tmp_path)
    with h5py.File(path) as file:
        place = file["particles/all/position/time"].id.get_chunk_info(0).byte_offset
    content = path.read_bytes()
    path.write_bytes(content[: place + 15] + bytes([content[place + 15] ^ 1]) + content[place + 16 :])
    with frames(path) as sequence, pytest.raises(InputError, match="frame 1, the checksum of whose time"):
        len(sequence)


def test_a_lost_last_step_leaves_a_run_that_has_not_ended(tmp_path):
    """A killed run leaves the same: its last row is incomplete, and the frames before it are read."""
    path, short = tmp_path / "t.h5", STILL.model_copy(update={"duration": frame(3).time})
    with Trajectory(path, [short]) as trajectory:
        for k in range(4):
            trajectory.write(0, frame(k))
    with frames(path) as sequence:
        assert (len(sequence), sequence.missing) == (4, "")
    with h5py.File(path) as file:
        place = file["particles/all/position/step"].id.get_chunk_info(0).byte_offset + 3 * 8
    content = path.read_bytes()
    path.write_bytes(content[:place] + b"\xff" * 8 + content[place + 8 :])
    with frames(path) as sequence:
        for k in range(3):
            same(sequence[k], k)
        assert sequence.missing == "the run has come to t = 0.003 s of 0.004 s; what follows is missing"


@pytest.fixture(params=["none", "folder", "fifo", "link to a fifo", "device", "unreadable", "empty", "text",
                        "another program's", "another file of tisim's"])  # fmt: skip
def no_file(request, tmp_path):
    """A path at which there is no file of a run."""
    path = tmp_path / "trajectory.h5"
    if request.param == "folder":
        path.mkdir()
    elif "fifo" in request.param:
        os.mkfifo(tmp_path / "fifo")
        (tmp_path / "fifo").rename(path) if request.param == "fifo" else path.symlink_to(tmp_path / "fifo")
    elif request.param == "device":
        path.symlink_to("/dev/zero")
    elif request.param == "unreadable":
        path.symlink_to("/proc/self/mem")
    elif request.param in ("empty", "text"):
        path.write_text("" if request.param == "empty" else "particles = 3\n" * 100)
    elif request.param == "another program's":
        with h5py.File(path, "w", libver="latest") as file:
            file["x"] = np.zeros(9)
    elif request.param != "none":
        with checksum.create_file(path) as file:
            file.attrs["format"] = "tisim something else"
    return path


@pytest.mark.parametrize(
    "read",
    [
        lambda path: frames(path).__enter__(),
        world_count,
        lambda path: export(path, "vtk", path.parent),
        lambda path: checkpoint.restore(_Loaded(), path),
        lambda path: checksum.open_file(path, "file", storage.COST_FORMAT).__enter__(),
    ],
    ids=["frames", "worlds", "export", "checkpoint", "cost"],
)
def test_a_foreign_file_is_refused(no_file, read):
    with pytest.raises(InputError) as error_info:
        read(no_file)
    assert "\n" not in str(error_info.value)
    assert {path.name for path in no_file.parent.iterdir()} <= {no_file.name, "fifo"}


@pytest.mark.parametrize("libver", ["earliest", LIBVER])
def test_a_trajectory_without_checksums_is_refused(tmp_path, libver):
    """The file has HDF5's first superblock or the third, which tisim writes."""
    path = tmp_path / "t.h5"
    with h5py.File(path, "w", libver=libver) as file:
        h5md.write_metadata(file, "0.1.0")
        file["particles/all/position/step"] = [0, 10]
    with (
        pytest.raises(InputError, match=r"^file must be a trajectory.h5 or .* with (its )?checksum"),
        frames(path),
    ):
        pass


def test_a_result_without_its_checksum_is_refused(tmp_path):
    path = tmp_path / "r.h5"
    path.write_bytes(checksum.verified(damage._result(tmp_path).read_bytes()))
    with pytest.raises(InputError, match=r"^file must be .*, whole and with its checksum"), frames(path):
        pass
    with pytest.raises(InputError, match=r"^checkpoint must be .*, whole and with its checksum"):
        checkpoint.restore(_Loaded(), path)


class _Loaded:
    """A stand-in for a simulation: the checkpoint is refused before it is used."""

    class s:
        @staticmethod
        def check():
            pass


@pytest.mark.parametrize(
    "trailer", [{"size": 9, "data": 5, "crc": 1}, {"size": 9, "data": ["ab"], "crc": 1}, []]
)
def test_a_trailer_without_a_checksum_is_not_verified(trailer):
    image = SIGNATURE + b"x"
    assert checksum.verified(image + checksum.frame(json.dumps(trailer).encode())) is None
    assert checksum.verified(checksum.with_checksum(image)) == image


def test_a_link_to_a_trajectory_is_read(tmp_path):
    (tmp_path / "link.h5").symlink_to(damage._trajectory(tmp_path))
    with frames(tmp_path / "link.h5") as sequence:
        same(sequence[3], 3)
    assert frame(3).step == 30
