"""The HDF5 file of a cache has one row per evaluation in /evaluations, and any number of named tables.

The file is always built whole, in memory, and then written by ordinary system calls: a full disk is met by
write(), not inside the HDF5 library. Strings have one fixed length per column, so damage to a byte is damage
to a row and not to the column.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from optimize.storage.record import Record, canonical
from tisim import InputError
from tisim.errors import Words, must
from tisim.files import regular_file
from tisim.files.checksum import verified, with_checksum
from tisim.files.superblock import SIGNATURE

EVALUATIONS_FORMAT = "tisim evaluations 1"
EVALUATIONS = "evaluations"

_COLUMNS: dict[str, Any] = {
    "key": bytes, "problem": bytes, "fitness": np.float64, "ok": np.uint8, "reason": bytes, "seed": np.int64,
    "design": bytes, "work": bytes, "wall_s": np.float64, "created": np.float64, "crc": np.uint32,
}  # fmt: skip
_OTHER_OBJECTIVES = "others"
"""Column with the further objectives as JSON; absent in files in which all evaluations have one."""


@dataclass(frozen=True)
class Hdf5Table:
    """Named columns of equal length (numbers or strings) and attributes (numbers or strings).

    Raises InputError if the columns differ in length.
    """

    columns: Mapping[str, Sequence[Any]]
    attrs: Mapping[str, Any]

    def __post_init__(self) -> None:
        lengths = {name: len(column) for name, column in self.columns.items()}
        must(len(set(lengths.values())) <= 1, "table columns", "all of one length", lengths)


@contextlib.contextmanager
def open_evaluations(path: Path) -> Iterator[h5py.File]:
    """Yield the file for reading. InputError, naming it, unless it is a whole HDF5 file written by a cache.

    HDF5 gets what its checksum says is whole, and nothing else: given a damaged structure, or another
    program's, it may never return.
    """
    rule = f"{path} must be a whole HDF5 file written by a cache; received"
    content = regular_file.content(path)
    if content is None:
        raise InputError(f"{rule} nothing")
    if content and not content.startswith(SIGNATURE):
        raise InputError(f"{rule} a file that is another program's, or damaged at its start")
    image = verified(content)
    if image is None:
        raise InputError(
            f"{rule} {len(content)} bytes that are damaged, cut short or another program's "
            "('tisim cache --compact' keeps what can be read)"
        )
    with h5py.File(io.BytesIO(image), "r") as file:
        if file.attrs.get("format") != EVALUATIONS_FORMAT or EVALUATIONS not in file:
            raise InputError(f"{rule} one with {', '.join(file) or 'nothing in it'}")
        try:
            yield file
        except InputError:
            raise
        except (OSError, KeyError, RuntimeError, ValueError) as error:
            raise InputError(f"{path} must be undamaged; received {error}") from error


def build_image(
    old: Path | None, records: Sequence[Record], tables: Mapping[str, Hdf5Table], damaged: bool = True
) -> bytes:
    """Return the bytes of a new file with these records, the tables of the file old, and tables (which win).

    damaged : whether to take over tables whose checksum fails.
    """
    with h5py.File("image", "w", driver="core", backing_store=False) as file:
        file.attrs["format"] = EVALUATIONS_FORMAT
        if old is not None:
            with open_evaluations(old) as old_file:
                for name in set(old_file) - {EVALUATIONS}:
                    old_file.copy(old_file[name], file, name)
        for name in [] if damaged else damaged_tables(file):
            _clear_table(file[name])
        for name, table in tables.items():
            _write_table(file.require_group(name), table)
        _write_rows(file.create_group(EVALUATIONS), records)
        file.flush()
        datasets: list[h5py.Dataset] = []
        file.visititems(lambda _, item: datasets.append(item) if isinstance(item, h5py.Dataset) else None)
        data = [_extent(dataset) for dataset in datasets]
        return with_checksum(bytes(file.id.get_file_image()), data)


def read_rows(file: h5py.File) -> tuple[list[Record], list[str]]:
    """Return the whole evaluations in order, and a description of each row whose checksum fails."""
    columns = {name: file[EVALUATIONS][name][...] for name in _COLUMNS}
    if _OTHER_OBJECTIVES in file[EVALUATIONS]:
        columns[_OTHER_OBJECTIVES] = file[EVALUATIONS][_OTHER_OBJECTIVES][...]
    lengths = {name: len(column) for name, column in columns.items()}
    must(len(set(lengths.values())) == 1, f"columns of {file.filename}", "all of one length", lengths)
    records, damaged = [], []
    for row in range(lengths["key"]):
        cells = {name: column[row] for name, column in columns.items()}
        crc = int(cells.pop("crc"))
        try:
            record = _record(cells)
            intact = zlib.crc32(record.payload()) == crc
        except (ValueError, TypeError, ArithmeticError):
            intact = False
        if intact:
            records.append(record)
        else:
            damaged.append(f"row {row}: its checksum does not fit")
    return records, damaged


def read_table(file: h5py.File, name: str) -> Hdf5Table:
    """Return one table. InputError if there is none of that name, or it is damaged."""
    must(name in tables(file), "table name", f"one of {tables(file)}", name)
    must(
        name not in damaged_tables(file),
        f"table {name}",
        "whole ('tisim cache --compact' drops it)",
        Words("damage"),
    )
    return _read_table(file[name])


def tables(file: h5py.File) -> list[str]:
    """Return the names of the tables in the file."""
    names: list[str] = []
    file.visititems(lambda name, item: names.append(name) if "crc32" in item.attrs else None)
    return names


def attributes(group: h5py.Group) -> dict[str, Any]:
    """Return the attributes of a table: numbers and strings."""
    values = {
        name: getattr(value, "tolist", lambda value=value: value)() for name, value in group.attrs.items()
    }
    return {name: value for name, value in values.items() if name not in ("columns", "crc32")}


def damaged_tables(file: h5py.File) -> list[str]:
    """Return the names of the tables whose checksum fails."""
    damaged = []
    for name in tables(file):
        try:
            intact = _table_checksum(_read_table(file[name])) == int(file[name].attrs["crc32"])
        except (OSError, KeyError, RuntimeError, ValueError, TypeError):
            intact = False
        if not intact:
            damaged.append(name)
    return damaged


def _record(cells: Mapping[str, Any]) -> Record:
    text = {name: bytes(cell).decode() for name, cell in cells.items() if _COLUMNS.get(name) is bytes}
    return Record(
        key=text["key"],
        problem=text["problem"],
        fitness=float(cells["fitness"]),
        ok=bool(cells["ok"]),
        reason=text["reason"],
        seed=int(cells["seed"]),
        design=json.loads(text["design"]),
        work=json.loads(text["work"]),
        wall_s=float(cells["wall_s"]),
        created=float(cells["created"]),
        others=tuple(math.nan if v is None else v for v in json.loads(cells.get(_OTHER_OBJECTIVES, b"[]"))),
    )


def _write_rows(group: h5py.Group, records: Sequence[Record]) -> None:
    for name, kind in _COLUMNS.items():
        if name == "crc":
            group[name] = np.array([zlib.crc32(record.payload()) for record in records], dtype=kind)
        elif name in ("design", "work"):
            group[name] = _strings([canonical(dict(getattr(record, name))) for record in records])
        elif kind is bytes:
            group[name] = _strings([getattr(record, name).encode() for record in records])
        else:
            group[name] = np.array([getattr(record, name) for record in records], dtype=kind)
    if any(record.others for record in records):
        finite = [[v if math.isfinite(v) else None for v in record.others] for record in records]
        group[_OTHER_OBJECTIVES] = _strings([canonical(others) for others in finite])


def _strings(values: Sequence[bytes]) -> np.ndarray:
    longest = max([1, *map(len, values)])
    return np.array(values, dtype=h5py.string_dtype("utf-8", longest))


def _clear_table(group: h5py.Group) -> None:
    """Remove a table; those below it stay."""
    for name in [name for name, item in group.items() if isinstance(item, h5py.Dataset)]:
        del group[name]
    for name in list(group.attrs):
        del group.attrs[name]


def _write_table(group: h5py.Group, table: Hdf5Table) -> None:
    _clear_table(group)
    for name, column in table.columns.items():
        text = any(isinstance(value, str) for value in column)
        data = _strings([str(value).encode() for value in column]) if text else np.asarray(column)
        group[_dataset_name(name)] = data
    for name, value in table.attrs.items():
        group.attrs[name] = value
    group.attrs["columns"] = json.dumps(list(table.columns))
    group.attrs["crc32"] = _table_checksum(_read_table(group))


def _read_table(group: h5py.Group) -> Hdf5Table:
    columns = {}
    for name in json.loads(group.attrs["columns"]):
        values = group[_dataset_name(name)][...].tolist()
        columns[name] = [value.decode() if isinstance(value, bytes) else value for value in values]
    return Hdf5Table(columns, attributes(group))


def _extent(dataset: h5py.Dataset) -> tuple[int, int]:
    """Return offset and size in bytes of a dataset's raw data; those of an empty one are 0."""
    return dataset.id.get_offset() or 0, dataset.id.get_storage_size()


def _dataset_name(heading: str) -> str:
    """Return the name of a column's dataset: HDF5 takes "/" for a path, so a unit like m/s gets U+2215."""
    return heading.replace("/", "\u2215")


def _table_checksum(table: Hdf5Table) -> int:
    return zlib.crc32(canonical([list(table.columns), dict(table.columns), dict(table.attrs)]))
