"""The layout of trajectories: H5MD 1.1 (P. de Buyl, P. H. Colberg and F. Hoefling, Comput. Phys. Commun. 185
(2014) 1546, and nongnu.org/h5md).

The following parts of the specification are used: metadata, the units module, observables, and particle
groups with a variable number of particles, in which entries with the fill value as id are placeholders. In
addition, the group ``parameters``, reserved for programs, has the scenes as TOML and checksums of all frame
data, because HDF5 1.10 and later verify the structure of a file but not its data.
"""

from __future__ import annotations

import getpass
import re
import struct
import zlib
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from tisim.domains.domain import Domain
from tisim.errors import Words, must
from tisim.scene.initial_state import Arrays
from tisim.state.fields import Field

VERSION = (1, 1)
ABSENT = -1
"""The id of a placeholder entry; its other values are NaN, or 0 for integers."""
ASCII = h5py.string_dtype("ascii")
CHUNK = 1 << 16
"""Number of particles of a frame that are stored and compressed in one chunk."""
CHUNK_ROWS = 1024
"""Number of frames whose times and checksums are stored in one chunk."""
SCENES, CHECKSUMS = "parameters/scenes", "parameters/checksums"
OBSERVABLES = "observables"
"""Group with the measures of each world, such as forces on walls, under the name of its particle group."""


def group_names(worlds: int) -> list[str]:
    """Return the names of the particle groups for a number of worlds."""
    return ["all"] if worlds == 1 else [f"world_{index}" for index in range(worlds)]


def write_metadata(file: h5py.File, version: str) -> None:
    """Write the group ``h5md``: author, program and version of the format."""
    group = file.create_group("h5md")
    group.attrs.create("version", VERSION, dtype=np.int32)
    group.create_group("author").attrs["name"] = np.bytes_(_author())
    creator = group.create_group("creator")
    creator.attrs["name"], creator.attrs["version"] = np.bytes_("tisim"), np.bytes_(version)
    units = group.create_group("modules/units")
    units.attrs.create("version", (1, 0), dtype=np.int32)
    units.attrs.create("system", "SI", dtype=ASCII)


def _author() -> str:
    try:
        return getpass.getuser().encode("ascii", "replace").decode()
    except (KeyError, OSError):
        return "unknown"


def unit_string(text: str) -> str:
    """Return a unit in the notation of the units module: "kg/m^3" becomes "kg m-3"."""
    symbols = []
    for sign, part in zip((1, -1), text.split("/", 1), strict=False):
        for symbol, power in re.findall(r"([A-Za-z]+)(?:\^?(-?\d+))?", part):
            exponent = sign * int(power or 1)
            symbols.append(symbol if exponent == 1 else f"{symbol}{exponent:+d}")
    return " ".join(symbols)


def write_box(group: h5py.Group, domain: Domain) -> None:
    """Write the group ``box``. Along a periodic axis, positions are those of the image inside the domain.

    In addition to the specification, ``origin`` is the lower corner of the domain, m. Time-dependent edges
    are created by ``create_edges``.
    """
    low, high = domain.bounds()
    box = group.create_group("box")
    box.attrs.create("dimension", 3, dtype=np.int32)
    box.attrs["boundary"] = np.array([b"periodic" if joined else b"none" for joined in domain.joined()])
    if low is not None and high is not None:
        # The data are in the header of the dataset, which has a checksum that HDF5 verifies.
        compact = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        compact.set_layout(h5py.h5d.COMPACT)
        fixed = {"origin": low} if domain.shears() else {"edges": high - low, "origin": low}
        for name, values in fixed.items():
            space, double = h5py.h5s.create_simple(values.shape), h5py.h5t.NATIVE_DOUBLE
            h5py.h5d.create(box.id, name.encode(), double, space, compact)
            box[name][...] = values
            _with_unit(box[name], "m")


def create_elements(group: h5py.Group, fields: tuple[Field, ...], capacity: int, real: Any) -> None:
    """Create an empty time-dependent element for each field; all share ``step`` and ``time`` of position."""
    for field in fields:
        element = group.create_group(field.name)
        if field.name == "position":
            element.create_dataset(
                "step", (0,), np.int64, maxshape=(None,), chunks=(CHUNK_ROWS,), fillvalue=-1
            )
            time = element.create_dataset("time", (0,), float, maxshape=(None,), chunks=(CHUNK_ROWS,))
            _with_unit(time, "s")
        else:
            element["step"], element["time"] = group["position/step"], group["position/time"]
        fill = ABSENT if field.name == "id" else 0 if field.integer else np.nan
        value = element.create_dataset(
            "value", field.shape(0, 0), np.int32 if field.integer else real,
            maxshape=field.shape(None, capacity),  # type: ignore[arg-type]
            chunks=field.shape(1, min(capacity, CHUNK)), fillvalue=fill,
            compression="gzip", compression_opts=1, shuffle=True,
        )  # fmt: skip
        _with_unit(value, field.unit)


def create_edges(group: h5py.Group) -> None:
    """Create an empty element for time-dependent edges of the box, with edge vectors as rows; it shares
    ``step`` and ``time`` of position."""
    edges = group.create_group("box/edges")
    edges["step"], edges["time"] = group["position/step"], group["position/time"]
    value = edges.create_dataset(
        "value", (0, 3, 3), float, maxshape=(None, 3, 3), chunks=(CHUNK_ROWS, 3, 3), fillvalue=np.nan
    )
    _with_unit(value, "m")


def create_observables(file: h5py.File, name: str, unit_of: Mapping[str, str]) -> None:
    """Create an empty observable for each measure of the world of a particle group, given their units; they
    share ``step`` and ``time`` of position."""
    position = file[f"particles/{name}/position"]
    for measure, unit in unit_of.items():
        observable = file.create_group(f"{OBSERVABLES}/{name}/{measure}")
        observable["step"], observable["time"] = position["step"], position["time"]
        value = observable.create_dataset(
            "value", (0,), float, maxshape=(None,), chunks=(CHUNK_ROWS,), fillvalue=np.nan
        )
        _with_unit(value, unit)


def write_scene(file: h5py.File, name: str, text: str) -> None:
    """Write the scene of a particle group, as TOML."""
    data = text.encode()
    array = np.frombuffer(data, np.uint8)
    dataset = file.create_dataset(f"{SCENES}/{name}", data=array, chunks=True, compression="gzip")
    dataset.attrs["crc32"] = np.uint32(zlib.crc32(data))


def read_scene(file: h5py.File, name: str) -> str:
    """Return the TOML written by ``write_scene``; raise InputError if it is damaged."""
    dataset = file[f"{SCENES}/{name}"]
    text = dataset[:].tobytes()
    intact = zlib.crc32(text) == dataset.attrs["crc32"]
    must(intact, "file", "undamaged", Words("a scene whose checksum does not fit"))
    return text.decode()


def create_checksums(file: h5py.File, name: str) -> h5py.Dataset:
    """Create the dataset of two checksums per frame: ``clock_checksum`` and ``frame_checksum``."""
    return file.create_dataset(
        f"{CHECKSUMS}/{name}", (0, 2), np.uint32, maxshape=(None, 2), chunks=(CHUNK_ROWS, 2)
    )


def clock_checksum(step: int, time: float, measures: Mapping[str, float]) -> int:
    """Return the CRC-32 of the step, the time (s) and the measures of a frame."""
    numbers = (measures[name] for name in sorted(measures))
    return zlib.crc32(struct.pack(f"<qd{len(measures)}d", step, time, *numbers))


def frame_checksum(clock: int, arrays: Arrays) -> int:
    """Return the CRC-32 of the arrays of a frame, starting from the checksum of its clock."""
    crc = clock
    for name in sorted(arrays):
        crc = zlib.crc32(arrays[name].tobytes(), crc)
    return crc


def _with_unit(dataset: h5py.Dataset, text: str) -> None:
    if text:
        dataset.attrs.create("unit", unit_string(text), dtype=ASCII)
