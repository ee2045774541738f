"""Export of the frames of a run to VTK (ParaView), extended XYZ (OVITO, ASE) or H5MD."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from tisim.domains.domain import Domain
from tisim.effects.walls.placement import PlacedWalls, names_of_surfaces, placed_surfaces
from tisim.engine.assembly import units
from tisim.errors import InputError, must
from tisim.files.atomic import replace_file, replacing, temporary_name
from tisim.io.reader import Frame, Frames, frames, world_count
from tisim.io.trajectory import Trajectory
from tisim.scene.initial_state import Arrays

FORMATS = ("vtk", "xyz", "h5md")
_OVITO_NAMES = {"position": "pos", "velocity": "velo"}
"""OVITO's names of these quantities; the keys are their names in tisim."""
_VERTEX, _TRIANGLE = 1, 5
"""Numbers of the VTK cell types with one point and with three."""
_UNKNOWN_SPECIES = "X"
"""Species of particles without a material, which is not an element."""
_VTK_TYPES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


def export(
    file: Path,
    kind: str,
    folder: Path,
    progress: Callable[[float], None] = lambda fraction: None,
    fields: Sequence[str] = (),
) -> Path:
    """Write all frames and worlds of a trajectory.h5 or result.h5; return the file to open.

    kind : "vtk", a .pvd with the times, and for each frame a .vtu of the particles and one of the walls;
        "xyz", one extended XYZ file; "h5md", a copy of the file, after its checksums are verified. If there
        are several worlds, file names have the index of the world.
    progress : called with the finished fraction, 0..1.
    fields : quantities that are written in addition to the position; by default all.

    Raise InputError for another format, if there is no such file, or if it has no such field.
    """
    check(file, kind, fields)
    if kind == "h5md":
        return _h5md(file, folder / f"{file.stem}_copy.h5")
    count, paths = world_count(file), []
    for world in range(count):
        name = _world_name(file, world, count)
        with frames(file, world) as trajectory:
            frames_to_write = _with_progress(trajectory, progress, world, count)
            write = _vtk if kind == "vtk" else _xyz
            paths.append(write(trajectory, frames_to_write, folder, name, fields))
    return paths[0]


def check(file: Path, kind: str, fields: Sequence[str] = ()) -> None:
    """Raise InputError unless the file can be written in this format, with these fields."""
    must(kind in FORMATS, "format", f"one of {', '.join(FORMATS)}", kind)
    known = sorted(_first_frame(file).arrays)
    must(not fields or kind != "h5md", "fields", "chosen for vtk or xyz, as h5md is a copy", ",".join(fields))
    for name in fields:
        must(name in known, "fields", f"some of {', '.join(known)}", name)


def _first_frame(file: Path) -> Frame:
    """Return the first frame of the first world with frames; raise InputError if there is none."""
    for world in range(world_count(file)):
        with frames(file, world) as trajectory:
            if len(trajectory):
                return trajectory[0]
    raise InputError(f"file must be one with a frame; received {str(file)!r}, with none yet")


def file_names(file: Path, kind: str) -> list[str]:
    """Return the names of all files that ``export`` writes."""
    if kind == "h5md":
        return [f"{file.stem}_copy.h5"]
    result, count = [], world_count(file)
    for world in range(count):
        name = _world_name(file, world, count)
        with frames(file, world) as trajectory:
            names = [_frame_name(name, k) for k in range(len(trajectory))]
            walls = [_frame_name(f"{name}_walls", k) for k in _frames_of_walls(trajectory)]
        result += [f"{name}.pvd", *names, *walls] if kind == "vtk" else [f"{name}.xyz"]
    return result


def _with_progress(
    trajectory: Frames, progress: Callable[[float], None], world: int, worlds: int
) -> Iterator[Frame]:
    """Yield the frames of a world; call ``progress`` after each with the finished fraction of all worlds."""
    for k, frame in enumerate(trajectory):
        yield frame
        progress((world + (k + 1) / len(trajectory)) / worlds)


def _chosen(arrays: Arrays, fields: Sequence[str]) -> Arrays:
    """Return the position and some other quantities; all of them for no ``fields``."""
    kept = {"position", *fields} if fields else arrays.keys()
    return {name: values for name, values in arrays.items() if name in kept}


def _vtk(
    trajectory: Frames, frames_to_write: Iterator[Frame], folder: Path, name: str, fields: Sequence[str]
) -> Path:
    """Write a .vtu of the particles of each frame, and one of the walls, which all frames share if the walls
    are at rest."""
    walls = _frames_of_walls(trajectory)
    collection = ElementTree.Element("VTKFile", type="Collection", version="1.0", byte_order="LittleEndian")
    datasets = ElementTree.SubElement(collection, "Collection")
    for k, frame in enumerate(frames_to_write):
        frame_file = _frame_name(name, k)
        replace_file(folder / frame_file, _vtu(_chosen(frame.arrays, fields)))
        _dataset(datasets, frame.time, "0", frame_file)
        if walls:
            own = _frame_name(f"{name}_walls", walls[min(k, len(walls) - 1)])
            if k < len(walls):
                replace_file(folder / own, _vtu_of_walls(trajectory, frame))
            _dataset(datasets, frame.time, "1", own)
    replace_file(folder / f"{name}.pvd", _xml(collection))
    return folder / f"{name}.pvd"


def _world_name(file: Path, world: int, worlds: int) -> str:
    return file.stem if worlds == 1 else f"{file.stem}_{world}"


def _frame_name(name: str, k: int) -> str:
    return f"{name}_{k:05d}.vtu"


def _dataset(collection: ElementTree.Element, time: float, part: str, file: str) -> None:
    ElementTree.SubElement(collection, "DataSet", timestep=repr(time), part=part, file=file)


def _frames_of_walls(trajectory: Frames) -> list[int]:
    """Return the frames with a file of walls: none without walls, and the first alone if they are at rest."""
    frame = trajectory[0] if len(trajectory) else None
    names = names_of_surfaces(trajectory.scene)
    if frame is None or not names:
        return []
    walls = _walls(trajectory, frame)
    # The container of a packing is known from the first frame with bodies.
    fixed = len(walls) == len(names) and all(one.fixed for one in walls)
    return [0] if fixed else list(range(len(trajectory)))


def _walls(trajectory: Frames, frame: Frame) -> list[PlacedWalls]:
    """Return the walls of a frame, and its container; planes end slightly beyond the particles and other
    walls."""
    place = frame.arrays["position"]
    place = place[np.isfinite(place).all(axis=1)]
    return placed_surfaces(trajectory.scene, frame.time, place, frame.measures, frame.arrays)


def _vtu(arrays: Arrays) -> bytes:
    """Return one frame as an unstructured grid of vertices, with every quantity as point data."""
    data = {name: values for name, values in arrays.items() if name != "position"}
    kind = {key: name for key, name in (("Scalars", "radius"), ("Vectors", "velocity")) if name in data}
    corners = np.arange(len(arrays["position"]))[:, None]
    return _grid(arrays["position"], corners, _VERTEX, "PointData", data, kind)


def _vtu_of_walls(trajectory: Frames, frame: Frame) -> bytes:
    """Return the walls of one frame as an unstructured grid of triangles.

    The cell data are ``wall``, the index of the walls among all in the scene, and ``material``, the index
    of their material, 0 without one.
    """
    scene, bodies = trajectory.scene, _walls(trajectory, frame)
    names, materials = names_of_surfaces(scene), list(scene.materials)
    counts = [len(one.triangles) for one in bodies]
    which = np.repeat(np.array([names.index(one.name) for one in bodies], np.int32), counts)
    material = [materials.index(one.material) if one.material in materials else 0 for one in bodies]
    points = np.concatenate([np.empty((0, 3)), *(one.triangles.reshape(-1, 3) for one in bodies)])
    corners = np.arange(len(points)).reshape(-1, 3)
    data = {"wall": which, "material": np.repeat(np.array(material, np.int32), counts)}
    return _grid(points, corners, _TRIANGLE, "CellData", data, {"Scalars": "wall"})


def _grid(
    points: np.ndarray,
    corners: np.ndarray,
    cell: int,
    kind: str,
    data: Mapping[str, np.ndarray],
    chosen: Mapping[str, str],
) -> bytes:
    """Return an unstructured grid.

    corners : indices of the points of each cell, shape (cells, points of a cell). cell : VTK cell type.
    kind : of the data, "PointData" or "CellData". chosen : names of the data that are shown first.
    """
    root = ElementTree.Element(
        "VTKFile", type="UnstructuredGrid", version="1.0", byte_order="LittleEndian", header_type="UInt64"
    )
    grid = ElementTree.SubElement(root, "UnstructuredGrid")
    counts = {"NumberOfPoints": str(len(points)), "NumberOfCells": str(len(corners))}
    piece = ElementTree.SubElement(grid, "Piece", counts)
    element = ElementTree.SubElement(piece, kind, dict(chosen))
    for name, values in data.items():
        _data_array(element, name, values)
    _data_array(ElementTree.SubElement(piece, "Points"), "position", points)
    cells = ElementTree.SubElement(piece, "Cells")
    _data_array(cells, "connectivity", corners.ravel())
    _data_array(cells, "offsets", corners.shape[1] * np.arange(1, len(corners) + 1))
    _data_array(cells, "types", np.full(len(corners), cell, np.uint8))
    return _xml(root)


def _data_array(parent: ElementTree.Element, name: str, values: np.ndarray) -> None:
    """Add an array in base64: the number of bytes, then the data, little-endian."""
    little_endian = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<"), copy=False))
    element = ElementTree.SubElement(
        parent, "DataArray", type=_VTK_TYPES[little_endian.dtype.str[1:]], Name=name, format="binary"
    )
    if little_endian.ndim > 1:
        element.set("NumberOfComponents", str(little_endian.shape[1]))
    data = little_endian.tobytes()
    element.text = base64.b64encode(np.array([len(data)], "<u8").tobytes() + data).decode()


def _xml(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _xyz(
    trajectory: Frames, frames_to_write: Iterator[Frame], folder: Path, name: str, fields: Sequence[str]
) -> Path:
    """Write extended XYZ: for each frame the number of particles, a line of keys, and one line per particle.

    The species of a particle is its material if the scene has several, and otherwise X, which is not an
    element. Positions are in m, and not in Angstrom as is common in chemistry. The key Units has the unit of
    each column, "pos:m velo:m/s mass:kg", with dots inside compound units, and "1" for pure numbers.
    """
    path = folder / f"{name}.xyz"
    temporary = path.with_name(temporary_name(path.name))
    with replacing(path, temporary), temporary.open("w", encoding="utf-8") as file:
        for frame in frames_to_write:
            arrays = _chosen(frame.arrays, fields)
            columns, properties = _columns(arrays)
            box = _lattice(trajectory.scene.domain, frame.time)
            keys = f'Properties={properties} Units="{_units(trajectory, arrays)}" '
            keys += f"Time={frame.time!r} Step={frame.step}"
            file.write(f"{len(columns[0])}\n{box}{keys}\n")
            species = _species(trajectory, arrays)
            rows = zip(species, zip(*columns, strict=True), strict=True)
            file.writelines(f"{name} {' '.join(map(repr, row))}\n" for name, row in rows)
    return path


def _species(trajectory: Frames, arrays: Arrays) -> list[str]:
    """Return the species of each particle."""
    names = list(trajectory.scene.materials)
    if len(names) < 2 or "material" not in arrays:
        return [_UNKNOWN_SPECIES] * len(arrays["position"])
    return [names[k] for k in arrays["material"].tolist()]


def _lattice(domain: Domain, time: float) -> str:
    """Return the keys that describe the box at a time (s); an empty string in open space."""
    low, _ = domain.bounds()
    if low is None:
        return ""
    lattice = " ".join(repr(float(x)) for x in domain.edges(time).ravel())
    origin = " ".join(repr(float(x)) for x in low)
    pbc = " ".join("T" if joined else "F" for joined in domain.joined())
    return f'Lattice="{lattice}" Origin="{origin}" pbc="{pbc}" '


def _columns(arrays: Arrays) -> tuple[list[list[float]], str]:
    """Return columns of numbers, and their Properties key; position comes first, with OVITO's names."""
    columns: list[list[float]] = []
    properties = ["species:S:1"]
    for name in _column_order(arrays):
        values = arrays[name].reshape(len(arrays[name]), math.prod(arrays[name].shape[1:]))
        kind = "I" if values.dtype.kind in "iu" else "R"
        properties.append(f"{_OVITO_NAMES.get(name, name)}:{kind}:{values.shape[1]}")
        columns += [column.tolist() for column in values.T]
    return columns, ":".join(properties)


def _units(trajectory: Frames, arrays: Arrays) -> str:
    """Return the value of the key Units, with the unit of each quantity."""
    units_of_fields = units(trajectory.scene)
    spelling = {
        name: units_of_fields.get(name, "").replace(" ", ".") or "1" for name in _column_order(arrays)
    }
    return " ".join(f"{_OVITO_NAMES.get(name, name)}:{unit}" for name, unit in spelling.items())


def _column_order(arrays: Arrays) -> list[str]:
    return sorted(arrays, key=lambda name: (name != "position", name != "velocity", name))


def _h5md(file: Path, out: Path) -> Path:
    """Write a copy; it includes worlds without frames, with their scenes."""
    scenes = []
    for world in range(world_count(file)):
        with frames(file, world) as trajectory:
            scenes.append(trajectory.scene)
    single = _first_frame(file).arrays["position"].dtype == np.float32
    temporary, real = out.with_name(temporary_name(out.name)), "f32" if single else "f64"
    with replacing(out, temporary), Trajectory(temporary, scenes, real) as copy:
        for world in range(len(scenes)):
            with frames(file, world) as trajectory:
                for frame in trajectory:
                    copy.write(world, frame)
    return out
