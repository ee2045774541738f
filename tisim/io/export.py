"""Frames of a run for other programs: VTK (ParaView), extended XYZ (OVITO, ASE), or a copy as H5MD."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from tisim.errors import InputError, must
from tisim.files.atomic import replace_file, replacing, temporary_name
from tisim.io.reader import Frame, Frames, frames, worlds
from tisim.io.run_folder import units
from tisim.io.trajectory import Recording, Trajectory
from tisim.scene.initial_state import Arrays

FORMATS = ("vtk", "xyz", "h5md")
_KNOWN = {"position": "pos", "velocity": "velo"}
"""Names of OVITO's."""
VERTEX = 1
"""VTK's cell of one point."""
_VTK_TYPES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


def export(
    file: Path, kind: str, folder: Path, progress: Callable[[float], None] = lambda fraction: None
) -> Path:
    """Write all frames and worlds of a trajectory.h5 or result.h5; returns what to open.

    kind : "vtk", a .pvd with the times and a .vtu for each frame; "xyz", one extended XYZ file; "h5md", the
    file again, once all of it has been found undamaged. A world of several has its number in the name.
    progress : called with the finished fraction, 0..1. InputError for another format, or no such file.
    """
    check(file, kind)
    if kind == "h5md":
        return _h5md(file, folder / f"{file.stem}_copy.h5")
    number, made = worlds(file), []
    for world in range(number):
        name = _name(file, world, number)
        with frames(file, world) as found:
            steps = _reported(found, progress, world, number)
            made.append(_vtk(steps, folder, name) if kind == "vtk" else _xyz(found, steps, folder, name))
    return made[0]


def check(file: Path, kind: str) -> None:
    """InputError unless the file can be written in this format."""
    must(kind in FORMATS, "format", f"one of {', '.join(FORMATS)}", kind)
    first = _first(file)
    sound = kind != "h5md" or "id" in first.arrays
    must(sound, "file", "a trajectory.h5 for format h5md", str(file))


def _first(file: Path) -> Frame:
    """The first frame of the first world that has one; InputError where none has."""
    for world in range(worlds(file)):
        with frames(file, world) as found:
            if len(found):
                return found[0]
    raise InputError(f"file must be one with a frame; received {str(file)!r}, with none yet")


def names(file: Path, kind: str) -> list[str]:
    """The names of all files that ``export`` makes."""
    if kind == "h5md":
        return [f"{file.stem}_copy.h5"]
    made, number = [], worlds(file)
    for world in range(number):
        name = _name(file, world, number)
        with frames(file, world) as found:
            parts = [_part(name, k) for k in range(len(found))]
        made += [f"{name}.pvd", *parts] if kind == "vtk" else [f"{name}.xyz"]
    return made


def _reported(found: Frames, progress: Callable[[float], None], world: int, number: int) -> Iterator[Frame]:
    """The frames of a world; ``progress`` is called after each, with the finished fraction of all worlds."""
    for k, frame in enumerate(found):
        yield frame
        progress((world + (k + 1) / len(found)) / number)


def _vtk(steps: Iterator[Frame], folder: Path, name: str) -> Path:
    collection = ElementTree.Element("VTKFile", type="Collection", version="1.0", byte_order="LittleEndian")
    listed = ElementTree.SubElement(collection, "Collection")
    for k, frame in enumerate(steps):
        part = _part(name, k)
        replace_file(folder / part, _vtu(frame.arrays))
        ElementTree.SubElement(listed, "DataSet", timestep=repr(frame.time), part="0", file=part)
    replace_file(folder / f"{name}.pvd", _xml(collection))
    return folder / f"{name}.pvd"


def _name(file: Path, world: int, worlds: int) -> str:
    return file.stem if worlds == 1 else f"{file.stem}_{world}"


def _part(name: str, k: int) -> str:
    return f"{name}_{k:05d}.vtu"


def _vtu(arrays: Arrays) -> bytes:
    """One frame as an unstructured grid of vertices, with every quantity as point data."""
    n = len(arrays["position"])
    root = ElementTree.Element(
        "VTKFile", type="UnstructuredGrid", version="1.0", byte_order="LittleEndian", header_type="UInt64"
    )
    grid = ElementTree.SubElement(root, "UnstructuredGrid")
    piece = ElementTree.SubElement(grid, "Piece", NumberOfPoints=str(n), NumberOfCells=str(n))
    data = ElementTree.SubElement(piece, "PointData", Scalars="radius", Vectors="velocity")
    for name, values in arrays.items():
        if name != "position":
            _data_array(data, name, values)
    _data_array(ElementTree.SubElement(piece, "Points"), "position", arrays["position"])
    cells = ElementTree.SubElement(piece, "Cells")
    _data_array(cells, "connectivity", np.arange(n))
    _data_array(cells, "offsets", np.arange(1, n + 1))
    _data_array(cells, "types", np.full(n, VERTEX, np.uint8))
    return _xml(root)


def _data_array(parent: ElementTree.Element, name: str, values: np.ndarray) -> None:
    """Base64 of the number of bytes and the bytes, little-endian."""
    small = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<"), copy=False))
    element = ElementTree.SubElement(
        parent, "DataArray", type=_VTK_TYPES[small.dtype.str[1:]], Name=name, format="binary"
    )
    if small.ndim > 1:
        element.set("NumberOfComponents", str(small.shape[1]))
    data = small.tobytes()
    element.text = base64.b64encode(np.array([len(data)], "<u8").tobytes() + data).decode()


def _xml(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _xyz(found: Frames, steps: Iterator[Frame], folder: Path, name: str) -> Path:
    """Extended XYZ: for each frame the number of particles, a line of keys, and a line for each particle.

    All particles are of the species X, which is no element. Positions are in m, not in the Angstrom that
    chemistry takes for granted; the key Units has the unit of each column: "pos:m velo:m/s mass:kg", and
    "1" where there is none, with dots within a unit.
    """
    low, high = found.scene.domain.bounds()
    box = ""
    if low is not None and high is not None:
        lattice = " ".join(repr(float(x)) for x in np.diag(high - low).ravel())
        origin = " ".join(repr(float(x)) for x in low)
        pbc = "T T T" if found.scene.domain.joined() else "F F F"
        box = f'Lattice="{lattice}" Origin="{origin}" pbc="{pbc}" '
    path = folder / f"{name}.xyz"
    new = path.with_name(temporary_name(path.name))
    with replacing(path, new), new.open("w") as text:
        for frame in steps:
            columns, properties = _columns(frame.arrays)
            keys = f'Properties={properties} Units="{_units(found, frame.arrays)}" '
            keys += f"Time={frame.time!r} Step={frame.step}"
            text.write(f"{len(columns[0])}\n{box}{keys}\n")
            text.writelines("X " + " ".join(map(repr, row)) + "\n" for row in zip(*columns, strict=True))
    return path


def _columns(arrays: Arrays) -> tuple[list[list[float]], str]:
    """Columns of numbers, and what they are; position first, and names as OVITO knows them."""
    columns: list[list[float]] = []
    properties = ["species:S:1"]
    for name in _order(arrays):
        values = arrays[name].reshape(len(arrays[name]), -1)
        kind = "I" if values.dtype.kind in "iu" else "R"
        properties.append(f"{_KNOWN.get(name, name)}:{kind}:{values.shape[1]}")
        columns += [column.tolist() for column in values.T]
    return columns, ":".join(properties)


def _units(found: Frames, arrays: Arrays) -> str:
    """The unit of each quantity, as the key Units says it."""
    known = units(found.scene)
    spelled = {name: known.get(name, "").replace(" ", ".") or "1" for name in _order(arrays)}
    return " ".join(f"{_KNOWN.get(name, name)}:{unit}" for name, unit in spelled.items())


def _order(arrays: Arrays) -> list[str]:
    return sorted(arrays, key=lambda name: (name != "position", name != "velocity", name))


def _h5md(file: Path, out: Path) -> Path:
    """A copy; of a world that has no frame yet, its scene."""
    scenes = []
    for world in range(worlds(file)):
        with frames(file, world) as found:
            scenes.append(found.scene)
    single = _first(file).arrays["position"].dtype == np.float32
    new, real = out.with_name(temporary_name(out.name)), "f32" if single else "f64"
    with replacing(out, new), Trajectory(Recording(new, frames=1), scenes, real) as copy:
        for world in range(len(scenes)):
            with frames(file, world) as found:
                for frame in found:
                    copy.write(world, frame)
    return out
