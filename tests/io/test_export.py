"""Exports of frames to other programs, read back by independent readers."""

from __future__ import annotations

from xml.etree import ElementTree

import ase.io
import h5py
import meshio
import numpy as np
import pytest

import tisim
from tests.effects.contact.grains import USUAL
from tests.files.test_growing_hdf5 import STILL
from tests.files.test_growing_hdf5 import frame as grown
from tests.report.conftest import growing_packing, recorded
from tests.report.conftest import scene as empty_scene
from tests.scenes import flow, scene
from tisim import InputError, Material, Open, Recording, geometry
from tisim.effects import Granular, Servo, Translation, Walls
from tisim.io.export import export, file_names
from tisim.io.reader import frames
from tisim.io.run_folder import RunFolder, write
from tisim.io.trajectory import Trajectory
from tisim.operators import ReflectingWalls
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


DISC = geometry.Disc(centre=(0, 0, -1), radius=0.5)


def among(*walls):
    """Two grains of different materials among walls."""
    materials = {"steel": Material(**USUAL), "rubber": Material(**USUAL)}
    return scene(
        [(0, 0, 0), (0.3, 0, 0)], np.zeros((2, 3)), (Granular(), *walls), 0.1, dt=1e-4, steps=2,
        materials=materials, material=["steel", "rubber"],
    )  # fmt: skip


def walled(tmp_path, *walls):
    """A trajectory of these grains with three frames, 0.01 s apart, that is written without a run."""
    frame = {"id": [0, 1], "position": [(0, 0, 0), (0.3, 0, 0)], "material": [0, 1]}
    return recorded(tmp_path / "w.h5", among(*walls), [frame] * 3)


def files_by_part(path):
    """Names of the files of a .pvd by part, in order of time."""
    datasets = ElementTree.parse(path).findall("Collection/DataSet")
    return [[one.get("file") for one in datasets if one.get("part") == part] for part in "01"]


def test_walls_are_triangles_in_place_at_each_frame(tmp_path):
    lift = Walls(name="lift", discs=[DISC], motion=Translation(velocity=(0, 0, 1.0)), material="rubber")
    floor = Walls(name="floor", planes=[geometry.Plane(point=(0, 0, -2))])
    file = walled(tmp_path, lift, floor)
    grains, walls = files_by_part(export(file, "vtk", tmp_path))
    assert walls == [f"w_walls_{k:05d}.vtu" for k in range(3)]
    assert set(file_names(file, "vtk")) == {"w.pvd", *grains, *walls}
    for time, name in zip((0, 0.01, 0.02), walls, strict=True):
        mesh = meshio.read(tmp_path / name)
        (cells,) = mesh.cells
        assert cells.type == "triangle"
        wall, material = (mesh.cell_data[key][0] for key in ("wall", "material"))
        assert material.tolist() == [1 if k == 0 else 0 for k in wall]
        for k, height in ((0, -1 + time), (1, -2)):
            corners = mesh.points[cells.data[wall == k]]
            np.testing.assert_allclose(corners[..., 2], height, atol=1e-12)
        sides = mesh.points[cells.data[wall == 0]]
        area = (
            np.linalg.norm(np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1).sum() / 2
        )
        assert area == pytest.approx(np.pi / 4, rel=2e-3)


def test_walls_at_rest_have_one_file(tmp_path):
    file = walled(tmp_path, Walls(discs=[DISC]))
    _, walls = files_by_part(export(file, "vtk", tmp_path))
    assert walls == ["w_walls_00000.vtu"] * 3
    assert [name for name in file_names(file, "vtk") if "walls" in name] == ["w_walls_00000.vtu"]
    assert sorted(path.name for path in tmp_path.glob("*walls*")) == ["w_walls_00000.vtu"]


def test_reflecting_walls_are_exported(tmp_path):
    """A tube and a plane, among others."""
    tube = geometry.CylindricalSurface(start=(0, 0, 0), end=(0, 0, 0.02), radius=0.004)
    reflecting = ReflectingWalls(cylinders=[tube], planes=[geometry.Plane(point=(0, 0, 0.001))])
    made = empty_scene(1, domain=Open(), effects=(reflecting,))
    file = recorded(tmp_path / "t.h5", made, [{"id": [0], "position": [[0.0, 0.0, 0.005]]}] * 2)
    _, walls = files_by_part(export(file, "vtk", tmp_path))
    mesh = meshio.read(tmp_path / walls[0])
    corners = mesh.points[mesh.cells[0].data]
    flat = np.ptp(corners[..., 2], axis=1) == 0
    np.testing.assert_allclose(corners[flat][..., 2], 0.001)
    across = np.linalg.norm(corners[~flat][..., :2], axis=-1)
    np.testing.assert_allclose(across, 0.004, rtol=1e-9)
    assert np.ptp(corners[~flat][..., 2]) == pytest.approx(0.02)


def test_the_container_of_a_packing_is_exported_and_grows(tmp_path):
    """Without bodies, as in the second frame, its size is not known."""
    made, states = growing_packing()
    file = recorded(tmp_path / "t.h5", made, states)
    _, walls = files_by_part(export(file, "vtk", tmp_path, fields=("mass",)))
    assert len(set(walls)) == 3
    wide = [np.ptp(meshio.read(tmp_path / name).points[:, 0]) for name in (walls[0], walls[2])]
    np.testing.assert_allclose(wide, [0.002, 0.008])
    assert 'NumberOfCells="0"' in (tmp_path / walls[1]).read_text()


def test_a_body_that_forces_move_is_where_its_travel_says(tmp_path):
    lid = Walls(name="lid", discs=[DISC], motion=Servo(force=1.0, limit=100.0))
    file = tmp_path / "w.h5"
    tisim.run(among(lid), record=Recording(file, frames=2))
    _, walls = files_by_part(export(file, "vtk", tmp_path))
    heights = [meshio.read(tmp_path / name).points[:, 2].mean() for name in walls]
    travel = [frame.measures["lid_travel"] for frame in every_frame(file)]
    np.testing.assert_allclose(heights, -1 - np.array(travel), atol=1e-9)
    assert heights[-1] < -1.009


def test_materials_are_species(tmp_path):
    file = walled(tmp_path, Walls(discs=[DISC]))
    lines = export(file, "xyz", tmp_path).read_text().splitlines()
    assert [line.split()[0] for line in lines[2:4]] == ["steel", "rubber"]
    # Without the material ASE can read the file, which takes no species but elements.
    read = ase.io.read(export(file, "xyz", tmp_path, fields=["mass"]), index=":", format="extxyz")
    assert [set(atoms.symbols) for atoms in read] == [{"X"}] * 3


def test_chosen_fields_alone_are_written(file, tmp_path):
    (atoms, *_) = ase.io.read(export(file, "xyz", tmp_path, fields=["radius", "velocity"]), ":", "extxyz")
    assert atoms.arrays.keys() - {"numbers", "positions"} == {"radius", "velo"}
    assert atoms.info["Units"] == "pos:m velo:m/s radius:m"
    export(file, "vtk", tmp_path, fields=["mass"])
    mesh = meshio.read(tmp_path / "flow_00000.vtu")
    assert mesh.point_data.keys() == {"mass"}
    np.testing.assert_array_equal(mesh.points, every_frame(file)[0].arrays["position"])


def test_fields_that_cannot_be_written_are_refused(file, tmp_path):
    with pytest.raises(InputError, match=r"fields must be some of .*mass.*; received 'mas'"):
        export(file, "vtk", tmp_path, fields=["mas"])
    with pytest.raises(InputError, match="fields must be chosen for vtk or xyz, as h5md is a copy"):
        export(file, "h5md", tmp_path, fields=["mass"])
    assert list(tmp_path.iterdir()) == []


def test_other_formats_are_refused(file, tmp_path):
    with pytest.raises(InputError, match="format must be one of vtk, xyz, h5md; received 'dcd'"):
        export(file, "dcd", tmp_path)
    assert list(tmp_path.iterdir()) == []
