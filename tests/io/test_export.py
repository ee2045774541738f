"""Exports of frames to other programs, read back by independent readers."""

from __future__ import annotations

from xml.etree import ElementTree

import ase.io
import h5py
import meshio
import numpy as np
import pytest

import tisim
from tests.files.test_growing_hdf5 import STILL
from tests.files.test_growing_hdf5 import frame as grown
from tests.scenes import flow, scene
from tisim import InputError, Recording
from tisim.io.export import export, file_names
from tisim.io.reader import frames
from tisim.io.run_folder import RunFolder, write
from tisim.io.trajectory import Trajectory
from tisim.plotting.movie import movie


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A trajectory of merging grains in a box."""
    path = tmp_path_factory.mktemp("export") / "flow.h5"
    slab = {"domain.periodic": (True, True, False)}
    tisim.run(flow(0, images=True).replace(slab), record=Recording(path, frames=4))
    return path


def every_frame(path, world=0):
    with frames(path, world) as sequence:
        return list(sequence)


def draw_movie(file, folder):
    with frames(file) as sequence:
        movie(sequence, folder / "flow.gif")


@pytest.mark.parametrize(
    ("write", "name"),
    [
        (lambda file, folder: export(file, "xyz", folder), "flow.xyz.new"),
        (lambda file, folder: export(file, "vtk", folder), "flow_00000.vtu.new"),
        (lambda file, folder: export(file, "h5md", folder), "flow_copy.h5.new"),
        (draw_movie, "flow.new.gif"),
    ],
)
def test_planted_links_are_refused_and_not_followed(file, tmp_path, write, name):
    victim, link = tmp_path / "victim", tmp_path / name
    victim.write_text("the user's own")
    link.symlink_to(victim)
    with pytest.raises(InputError, match=rf"{name} must be a regular file .*; received a symbolic link"):
        write(file, tmp_path)
    assert (victim.read_text(), link.is_symlink()) == ("the user's own", True)
    assert {path.name for path in tmp_path.iterdir()} == {"victim", name}


@pytest.mark.slow
def test_meshio_reads_the_files_for_paraview(file, tmp_path):
    path = export(file, "vtk", tmp_path)
    assert path == tmp_path / "flow.pvd"
    datasets = ElementTree.parse(path).findall("Collection/DataSet")
    for entry, frame in zip(datasets, every_frame(file), strict=True):
        assert float(entry.get("timestep")) == frame.time
        mesh = meshio.read(tmp_path / entry.get("file"))
        np.testing.assert_array_equal(mesh.points, frame.arrays["position"])
        assert mesh.point_data.keys() == frame.arrays.keys() - {"position"}
        for name, values in mesh.point_data.items():
            np.testing.assert_array_equal(values, frame.arrays[name])
            assert values.dtype == frame.arrays[name].dtype
        (cells,) = mesh.cells
        assert cells.type == "vertex"
        np.testing.assert_array_equal(cells.data[:, 0], np.arange(len(mesh.points)))


@pytest.mark.long
def test_ase_reads_the_extended_xyz(file, tmp_path):
    read = ase.io.read(export(file, "xyz", tmp_path), index=":", format="extxyz")
    for atoms, frame in zip(read, every_frame(file), strict=True):
        np.testing.assert_array_equal(atoms.positions, frame.arrays["position"])
        np.testing.assert_array_equal(atoms.arrays["velo"], frame.arrays["velocity"])
        for name in frame.arrays.keys() - {"position", "velocity"}:
            np.testing.assert_array_equal(atoms.arrays[name], frame.arrays[name])
        np.testing.assert_array_equal(atoms.cell.lengths(), [0.02] * 3)
        assert atoms.pbc.tolist() == [True, True, False]
        np.testing.assert_array_equal(atoms.info["Origin"], [-0.01] * 3)
        assert (atoms.info["Time"], atoms.info["Step"]) == (frame.time, frame.step)
        assert set(atoms.symbols) == {"X"}
        units = dict(each.split(":") for each in atoms.info["Units"].split())
        assert units.keys() == {"pos", "velo", *frame.arrays} - {"position", "velocity"}
        assert (units["pos"], units["velo"], units["mass"], units["id"]) == ("m", "m/s", "kg", "1")


def test_open_space_has_no_lattice(tmp_path):
    path = tmp_path / "t.h5"
    tisim.run(scene([(1.0, 2.0, 3.0)], [(0, 0, 0)]), record=Recording(path, frames=1))
    (first, _) = ase.io.read(export(path, "xyz", tmp_path), index=":", format="extxyz")
    assert not first.pbc.any()
    assert first.info["Units"].startswith("pos:m velo:m/s")
    np.testing.assert_array_equal(first.positions, [[1.0, 2.0, 3.0]])


def test_a_copy_has_the_same_frames_and_opens_everywhere(file, tmp_path):
    copy = export(file, "h5md", tmp_path)
    with h5py.File(copy) as plain:
        assert plain["particles/all/position/value"].shape[0] == 5
    for frame, other in zip(every_frame(file), every_frame(copy), strict=True):
        assert (frame.time, frame.step) == (other.time, other.step)
        for name, values in frame.arrays.items():
            np.testing.assert_array_equal(values, other.arrays[name])


def test_each_world_has_its_own_files(tmp_path):
    path = tmp_path / "t.h5"
    two = [scene([(k * 1.0, 0, 0)], [(0, 0, 0)]) for k in range(2)]
    tisim.run(two, record=Recording(path, frames=1))
    fractions = []
    export(path, "vtk", tmp_path, fractions.append)
    assert fractions == [0.25, 0.5, 0.75, 1.0]
    for k in range(2):
        assert meshio.read(tmp_path / f"t_{k}_00001.vtu").points.tolist() == [[k, 0, 0]]


@pytest.fixture
def growing(tmp_path):
    """A trajectory of three worlds in single precision, of which only the second has a frame."""
    with Trajectory(tmp_path / "t.h5", [STILL] * 3, "f32") as trajectory:
        trajectory.write(1, grown(4))
    return tmp_path / "t.h5"


def test_a_world_without_a_frame_yet_is_copied_as_one(growing, tmp_path):
    copy = export(growing, "h5md", tmp_path)
    assert [len(every_frame(copy, world)) for world in range(3)] == [0, 1, 0]
    (frame,), (other,) = every_frame(growing, 1), every_frame(copy, 1)
    assert (frame.time, frame.step) == (other.time, other.step)
    for name, values in frame.arrays.items():
        assert values.dtype == other.arrays[name].dtype
        np.testing.assert_array_equal(values, other.arrays[name])
    with h5py.File(copy) as plain:
        assert {group["position/value"].dtype for group in plain["particles"].values()} == {np.dtype("f4")}


def test_worlds_with_and_without_frames_are_exported(growing, tmp_path):
    for kind, name in (("xyz", "t_1.xyz"), ("vtk", "t_1_00000.vtu")):
        export(growing, kind, tmp_path)
        assert set(file_names(growing, kind)) <= {path.name for path in tmp_path.iterdir()}
        assert name in file_names(growing, kind)
    (alone,) = ase.io.read(tmp_path / "t_1.xyz", index=":", format="extxyz")
    assert alone.info["Step"] == grown(4).step
    with frames(growing) as sequence, pytest.raises(InputError, match="file must be one with"):
        movie(sequence, tmp_path / "t.gif")


def test_a_result_has_its_start_and_end(tmp_path):
    result = tisim.run(scene([(0, 0, 0)], [(3.0, 0, 0)], dt=1e-3))
    write(result, RunFolder(tmp_path))
    read = ase.io.read(export(tmp_path / "result.h5", "xyz", tmp_path), index=":", format="extxyz")
    assert [atoms.positions[0, 0] for atoms in read] == [0.0, pytest.approx(3e-3)]
    with frames(export(tmp_path / "result.h5", "h5md", tmp_path)) as copy:
        assert [frame.time for frame in copy] == [0.0, result.time]
        assert [frame.arrays["position"][0, 0] for frame in copy] == [0.0, pytest.approx(3e-3)]
        assert [frame.arrays["id"].tolist() for frame in copy] == [[0], [0]]


def test_other_formats_are_refused(file, tmp_path):
    with pytest.raises(InputError, match="format must be one of vtk, xyz, h5md; received 'dcd'"):
        export(file, "dcd", tmp_path)
    assert list(tmp_path.iterdir()) == []
