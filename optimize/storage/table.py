"""Named tables in the HDF5 file of a cache: the settings, logbook and best designs of a search."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tisim.errors import must
from tisim.optimize.storage.record import canonical

_OWN_ATTRIBUTES = ("columns", "crc32")


@dataclass(frozen=True)
class Hdf5Table:
    """Named columns of equal length (numbers or strings) and attributes (numbers or strings).

    about : attributes of columns, such as their unit, by the column's name.
    intact : whether its checksum is right.
    Raises InputError if the columns differ in length.
    """

    columns: Mapping[str, Sequence[Any]]
    attrs: Mapping[str, Any]
    about: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    intact: bool = True

    def __post_init__(self) -> None:
        lengths = {name: len(column) for name, column in self.columns.items()}
        must(len(set(lengths.values())) <= 1, "table columns", "all of one length", lengths)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def rows_kept_in(self, new: Hdf5Table) -> int | None:
        """Return the number of rows if all of them are the first rows of the new table; otherwise None."""
        same = dict(self.attrs) == dict(new.attrs) and self.about == new.about and self.intact
        if not same or list(self.columns) != list(new.columns):
            return None
        begins = all(equal(column, new.columns[name][: len(self)]) for name, column in self.columns.items())
        return len(self) if begins else None

    def continued(self, kept: int, columns: Mapping[str, Sequence[Any]]) -> Hdf5Table:
        """Return the table with these rows after its first ``kept`` rows."""
        longer = {name: [*self.columns.get(name, ())[:kept], *column] for name, column in columns.items()}
        return Hdf5Table(longer, self.attrs, self.about)


def equal(column: Sequence[Any], other: Sequence[Any]) -> bool:
    """Return whether two columns are equal; NaN equals NaN."""
    one, two = list(column), list(other)
    return one == two or canonical(one) == canonical(two)


def write_table(group: h5py.Group, table: Hdf5Table) -> None:
    """Write a table into a group, next to the tables below it. A damaged table stays marked as damaged."""
    names = dataset_names(table.columns)
    for name, column in table.columns.items():
        text = any(isinstance(value, str) for value in column)
        data = text_column([str(value) for value in column]) if text else np.asarray(column)
        dataset = write_column(group, names[name], data)
        for key, value in table.about.get(name, {}).items():
            dataset.attrs[key] = value
    for key, value in table.attrs.items():
        group.attrs[key] = value
    group.attrs["columns"] = json.dumps(list(table.columns))
    checksum = _checksum(_content(group))
    group.attrs["crc32"] = checksum if table.intact else checksum ^ 1


def write_column(group: h5py.Group, name: str, data: NDArray[Any]) -> h5py.Dataset:
    """Write a column; bytes are UTF-8 text of a fixed length."""
    kind = h5py.string_dtype("utf-8", data.dtype.itemsize) if data.dtype.kind == "S" else data.dtype
    return group.create_dataset(name, data=data.astype(kind, copy=False))


def read_tables(file: h5py.File) -> dict[str, Hdf5Table]:
    """Return the tables in the file by name, damaged ones included."""
    names: list[str] = []
    file.visititems(lambda name, item: names.append(name) if "crc32" in item.attrs else None)
    return {name: _read_table(file[name]) for name in names}


def _read_table(group: h5py.Group) -> Hdf5Table:
    table = _content(group)
    try:
        intact = _checksum(table) == int(group.attrs["crc32"])
    except (ValueError, TypeError):
        intact = False
    return table if intact else Hdf5Table(table.columns, table.attrs, table.about, intact=False)


def _content(group: h5py.Group) -> Hdf5Table:
    heads = json.loads(group.attrs["columns"])
    datasets = {head: group[name] for head, name in dataset_names(heads).items()}
    about = {head: attributes(dataset) for head, dataset in datasets.items() if len(dataset.attrs)}
    return Hdf5Table({head: _cells(dataset) for head, dataset in datasets.items()}, attributes(group), about)


def _cells(dataset: h5py.Dataset) -> list[Any]:
    values = dataset[...].tolist()
    return [value.decode(errors="replace") if isinstance(value, bytes) else value for value in values]


def attributes(item: h5py.Group | h5py.Dataset) -> dict[str, Any]:
    """Return the attributes of a table or a column: numbers and strings."""
    values = {name: value for name, value in item.attrs.items() if name not in _OWN_ATTRIBUTES}
    return {name: value.tolist() if hasattr(value, "tolist") else value for name, value in values.items()}


def text_column(cells: Sequence[str]) -> NDArray[Any]:
    """Return text as a column of cells of one length, so that a damaged byte damages only one row."""
    return np.array([cell.encode() for cell in cells], dtype=bytes)


def dataset_names(heads: Iterable[str]) -> dict[str, str]:
    """Return a distinct dataset or group name for each heading. HDF5 treats "/" as a path separator and "."
    as the group itself, so a unit like m/s is written with U+2215."""
    names: dict[str, str] = {}
    for head in heads:
        name = head.replace("/", "\u2215").replace("\0", "\u2400")
        name = "\u2024" if name == "." else name or "\u2205"
        while name in names.values():
            name += "'"
        names[head] = name
    return names


def _checksum(table: Hdf5Table) -> int:
    parts: list[Any] = [list(table.columns), dict(table.columns), dict(table.attrs)]
    return zlib.crc32(canonical([*parts, table.about] if table.about else parts))
