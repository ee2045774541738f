"""The HDF5 file of a cache: one row per evaluation in /evaluations, and any number of named tables.

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
from tisim.errors import must
from tisim.files import regular_file
from tisim.files.checksum import verified, with_checksum

EVALUATIONS_FORMAT = "tisim evaluations 1"
EVALUATIONS = "evaluations"

_COLUMNS: dict[str, Any] = {
    "key": bytes, "problem": bytes, "fitness": np.float64, "ok": np.uint8, "reason": bytes, "seed": np.int64,
    "design": bytes, "work": bytes, "wall_s": np.float64, "created": np.float64, "crc": np.uint32,
}  # fmt: skip
_OTHERS = "others"
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
def opened(path: Path) -> Iterator[h5py.File]:
    """The file for reading. InputError, naming it, unless it is a whole HDF5 file written by a cache.

    HDF5 gets what its checksum says is whole, and nothing else: given a damaged structure, or another
    program's, it may never return.
    """
    rule = f"{path} must be a whole HDF5 file written by a cache; received"
    content = regular_file.content(path)
    if content is None:
        raise InputError(f"{rule} nothing")
    inside = verified(content)
    if inside is None:
        raise InputError(
            f"{rule} {len(content)} bytes that are damaged, cut short or another program's "
            "('tisim cache --compact' keeps what can be read)"
        )
    with h5py.File(io.BytesIO(inside), "r") as file:
        if file.attrs.get("format") != EVALUATIONS_FORMAT or EVALUATIONS not in file:
            raise InputError(f"{rule} one with {', '.join(file) or 'nothing in it'}")
        try:
            yield file
        except InputError:
            raise
        except (OSError, KeyError, RuntimeError, ValueError) as error:
            raise InputError(f"{path} must be undamaged; received {error}") from error


def image(
    old: Path | None, records: Sequence[Record], tables: Mapping[str, Hdf5Table], damaged: bool = True
) -> bytes:
    """The bytes of a new file: these records, the tables of the file old, and tables (which win).

    damaged : whether to take over tables whose checksum fails.
    """
    with h5py.File("image", "w", driver="core", backing_store=False) as new:
        new.attrs["format"] = EVALUATIONS_FORMAT
        if old is not None:
            with opened(old) as file:
                for name in set(file) - {EVALUATIONS}:
                    file.copy(file[name], new, name)
        for name in [] if damaged else damaged_tables(new):
            _clear(new[name])
        for name, table in tables.items():
            _write_table(new.require_group(name), table)
        _write_rows(new.create_group(EVALUATIONS), records)
        new.flush()
        data: list[tuple[int, int]] = []
        new.visititems(lambda _, item: data.append(_place(item)) if isinstance(item, h5py.Dataset) else None)
        return with_checksum(bytes(new.id.get_file_image()), data)


def read_rows(file: h5py.File) -> tuple[list[Record], list[str]]:
    """The whole evaluations in order, and a description of each row whose checksum fails."""
    columns = {name: file[EVALUATIONS][name][...] for name in _COLUMNS}
    if _OTHERS in file[EVALUATIONS]:
        columns[_OTHERS] = file[EVALUATIONS][_OTHERS][...]
    lengths = {name: len(column) for name, column in columns.items()}
    must(len(set(lengths.values())) == 1, f"columns of {file.filename}", "all of one length", lengths)
    records, damaged = [], []
    for row in range(lengths["key"]):
        cells = {name: column[row] for name, column in columns.items()}
        crc = int(cells.pop("crc"))
        try:
            record = _record(cells)
            whole = zlib.crc32(record.payload()) == crc
        except (ValueError, TypeError, ArithmeticError):
            whole = False
        if whole:
            records.append(record)
        else:
            damaged.append(f"row {row}: its checksum does not fit")
    return records, damaged


def read_table(file: h5py.File, name: str) -> Hdf5Table:
    """One table. InputError if there is none of that name, or it is damaged."""
    must(name in tables(file), "table name", f"one of {tables(file)}", name)
    must(
        name not in damaged_tables(file),
        f"table {name}",
        "whole ('tisim cache --compact' drops it)",
        "damage",
    )
    return _read_table(file[name])


def tables(file: h5py.File) -> list[str]:
    """Names of the tables in the file."""
    found: list[str] = []
    file.visititems(lambda name, item: found.append(name) if "crc32" in item.attrs else None)
    return found


def attributes(group: h5py.Group) -> dict[str, Any]:
    """The attributes of a table: numbers and strings."""
    found = {
        name: getattr(value, "tolist", lambda value=value: value)() for name, value in group.attrs.items()
    }
    return {name: value for name, value in found.items() if name not in ("columns", "crc32")}


def damaged_tables(file: h5py.File) -> list[str]:
    """Names of the tables whose checksum fails."""
    bad = []
    for name in tables(file):
        try:
            whole = _crc(_read_table(file[name])) == int(file[name].attrs["crc32"])
        except (OSError, KeyError, RuntimeError, ValueError, TypeError):
            whole = False
        if not whole:
            bad.append(name)
    return bad


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
        others=tuple(math.nan if v is None else v for v in json.loads(cells.get(_OTHERS, b"[]"))),
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
        group[_OTHERS] = _strings([canonical(others) for others in finite])


def _strings(values: Sequence[bytes]) -> np.ndarray:
    longest = max([1, *map(len, values)])
    return np.array(values, dtype=h5py.string_dtype("utf-8", longest))


def _clear(group: h5py.Group) -> None:
    """Take a table away; those below it stay."""
    for name in [name for name, item in group.items() if isinstance(item, h5py.Dataset)]:
        del group[name]
    for name in list(group.attrs):
        del group.attrs[name]


def _write_table(group: h5py.Group, table: Hdf5Table) -> None:
    _clear(group)
    for name, column in table.columns.items():
        text = any(isinstance(value, str) for value in column)
        data = _strings([str(value).encode() for value in column]) if text else np.asarray(column)
        group[_dataset(name)] = data
    for name, value in table.attrs.items():
        group.attrs[name] = value
    group.attrs["columns"] = json.dumps(list(table.columns))
    group.attrs["crc32"] = _crc(_read_table(group))


def _read_table(group: h5py.Group) -> Hdf5Table:
    columns = {}
    for name in json.loads(group.attrs["columns"]):
        values = group[_dataset(name)][...].tolist()
        columns[name] = [value.decode() if isinstance(value, bytes) else value for value in values]
    return Hdf5Table(columns, attributes(group))


def _place(dataset: h5py.Dataset) -> tuple[int, int]:
    """Offset and size in bytes of a dataset's raw data; an empty one has none."""
    return dataset.id.get_offset() or 0, dataset.id.get_storage_size()


def _dataset(heading: str) -> str:
    """HDF5 takes "/" for a path; headings have units like m/s. U+2215 looks the same."""
    return heading.replace("/", "\u2215")


def _crc(table: Hdf5Table) -> int:
    return zlib.crc32(canonical([list(table.columns), dict(table.columns), dict(table.attrs)]))
