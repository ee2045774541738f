"""The HDF5 file of a cache: evaluations as columns, a group for each problem, and any number of named tables.

The file is always built completely in memory, and then written by ordinary system calls: a full disk is
detected by write(), not inside the HDF5 library. It contains its own description for readers who have only
h5py.
"""

from __future__ import annotations

import contextlib
import io
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tisim import InputError
from tisim.errors import Words, must
from tisim.files import regular_file
from tisim.files.checksum import verified, with_checksum
from tisim.files.hdf5 import SIGNATURE
from tisim.optimize.storage.runs_table import KINDS, RunsTable
from tisim.optimize.storage.table import (
    Hdf5Table,
    dataset_names,
    read_tables,
    write_column,
    write_table,
)

EVALUATIONS_FORMAT = "tisim evaluations 2"
EVALUATIONS = "evaluations"
README = """\
Runs of a search for good designs, written by tisim (optimize.read reads it; so does any program for HDF5).

/evaluations/<problem>   a row for each run of a design from one random start, in columns of equal length:
    genes/<name>         the design; attributes unit, low, high, scale (on which the search is uniform)
    values/<name>        what the run gave; attribute unit. Objectives have the attribute direction, which
                         says what is wanted: "smallest" or "largest"; constraints have at_least and at_most,
                         the bounds of their values. NaN where the run failed.
    start, seed          number of the random start and the seed that it was made from
    ok, reason           1 for a run that ended well, 0 for one that failed, and why
    wall_s, created      seconds that it took; when it was stored, in seconds since 1970 (UTC)
    work                 counts of the run, as JSON
    key                  SHA-256 of all that decides the values: scene, seed, precision and objectives
    crc                  CRC-32 of the cells of the row, by which damage is found
    The attributes genes and values have the names in order, as JSON. Rows are in the order of their storage.

/searches/<name>         a search. Attributes: problem; settings, identity (all that decides its course) and
                         versions, as JSON; stopped, the rule that ended it (empty while it goes on)
    genes, objectives    what it varies and what it wants: names, units, ranges, directions
    constraints          further conditions on designs, if there are any: names, units, bounds
    starting_designs     designs that it was told to run first
    experiments          designs that it learnt from as it began, as they were measured
    warm_start           the same of designs that other searches in this file had run by then
    logbook              a row for each generation
    command              the words of the command that began it, if it was a command
    designs              a row for each design, in the order of their first estimation: gen, the generation of
                         it; rank in the hall of fame (0: outside), best, starts, converged, feasible, failed
    designs/genes        its genes
    designs/values       the mean of each objective and constraint and its standard error; of reported designs
                         also the mean from fresh starts and the ends of its interval
    hall_of_fame         the best designs, the best first; of several objectives the front. Each objective is
                         the mean over the starts; "95 % +-" is half of its confidence interval

Columns have the attribute unit where they have one. In names "/" is written as U+2215. The attribute written
is when this file was, in nanoseconds since 1970 (UTC).
While a search goes on, its newest runs are in the file .journal beside this one, and come into this one when
they have become 64 KiB and a quarter of what is here, and at the end. optimize.read has them, too.
"""
_MEANINGS: Mapping[str, Mapping[str, str]] = {
    "key": {"description": "SHA-256 of all that decides the values"},
    "start": {"description": "number of the random start"},
    "seed": {"description": "seed of the random start"},
    "ok": {"description": "1: ended well, 0: failed"},
    "reason": {"description": "why it failed"},
    "wall_s": {"unit": "s", "description": "time that the run took"},
    "created": {"unit": "s", "description": "when it was stored, since 1970-01-01 (UTC)"},
    "work": {"description": "counts of the run, as JSON"},
    "crc": {"description": "CRC-32 of the cells of the row"},
}
GENES_TABLE, OBJECTIVES_TABLE, CONSTRAINTS_TABLE = "genes", "objectives", "constraints"
"""Names of the tables, below a search, that describe the genes, objectives and constraints of its problem."""


@dataclass(frozen=True)
class Content:
    """The content of a cache file.

    runs : intact evaluations. tables : by name, damaged ones included. damaged : a description of each row
        with a wrong checksum.
    """

    runs: list[RunsTable] = field(default_factory=list)
    tables: dict[str, Hdf5Table] = field(default_factory=dict)
    damaged: list[str] = field(default_factory=list)


@contextlib.contextmanager
def open_evaluations(path: Path) -> Iterator[h5py.File]:
    """Yield the file for reading. InputError, naming it, unless it is a complete HDF5 file written by a
    cache.

    Only data with a valid checksum is passed to HDF5, which may hang on a damaged file or one from another
    program.
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
            "('tisim cache --compact' keeps the readable part)"
        )
    with h5py.File(io.BytesIO(image), "r") as file:
        found = Words(f"one of the format {file.attrs.get('format')!r}")
        must(by_cache(file), str(path), f"a file of the format {EVALUATIONS_FORMAT!r}", found)
        try:
            yield file
        except InputError:
            raise
        except (OSError, KeyError, RuntimeError, ValueError) as error:
            raise InputError(f"{path} must be undamaged; received {error}") from error


def by_cache(file: h5py.File) -> bool:
    """Return whether the file is of the format that a cache writes."""
    kind = file.attrs.get("format")
    return isinstance(kind, str) and kind == EVALUATIONS_FORMAT


def read(path: Path) -> Content:
    """Return the content of the file. InputError, naming it, unless it is complete and written by a cache."""
    with open_evaluations(path) as file:
        return read_content(file)


def read_content(file: h5py.File) -> Content:
    """Return the content of an open file."""
    found = read_tables(file)
    parts = [read_runs(group) for group in file[EVALUATIONS].values()]
    return Content([runs for runs, _ in parts], found, [text for _, damaged in parts for text in damaged])


def build_image(runs: Sequence[RunsTable], tables: Mapping[str, Hdf5Table]) -> bytes:
    """Return the bytes of a new file with these evaluations and tables."""
    with h5py.File("image", "w", driver="core", backing_store=False) as file:
        file.attrs["format"], file.attrs["README"] = EVALUATIONS_FORMAT, README
        # This makes the structure's checksum unique; a journal identifies its file by it.
        file.attrs["written"] = time.time_ns()
        group, about = file.create_group(EVALUATIONS), descriptions(tables)
        names = dataset_names(_numbered([part.problem for part in runs]))
        for part, name in zip(runs, names.values(), strict=True):
            _write_runs(group.create_group(name), part, about.get(part.problem, {}))
        for name, table in tables.items():
            write_table(file.require_group(name), table)
        file.flush()
        datasets: list[h5py.Dataset] = []
        file.visititems(lambda _, item: datasets.append(item) if isinstance(item, h5py.Dataset) else None)
        data = [_extent(dataset) for dataset in datasets]
        return with_checksum(bytes(file.id.get_file_image()), data)


def _numbered(problems: Sequence[str]) -> list[str]:
    """Return a name for each table of evaluations; further ones of the same problem, with other genes, are
    numbered."""
    before = [problems[:k].count(problem) for k, problem in enumerate(problems)]
    return [name if not n else f"{name} ({n + 1})" for name, n in zip(problems, before, strict=True)]


def descriptions(tables: Mapping[str, Hdf5Table]) -> dict[str, dict[str, dict[str, Any]]]:
    """Return the searches' descriptions of genes, objectives and constraints: problem, name, attributes.

    NaN and "" stand for attributes that a gene does not have.
    """
    about: dict[str, dict[str, dict[str, Any]]] = {}
    for name, search in tables.items():
        for kind in (GENES_TABLE, OBJECTIVES_TABLE, CONSTRAINTS_TABLE):
            table = tables.get(f"{name}/{kind}")
            if table is None or not table.intact or "problem" not in search.attrs:
                continue
            for cells in zip(*table.columns.values(), strict=True):
                fields = dict(zip(table.columns, cells, strict=True))
                known = about.setdefault(str(search.attrs["problem"]), {})
                key = f"{kind}/{fields.pop('name', '')}"
                known[key] = {k: v for k, v in fields.items() if v == v and v != ""}
    return about


def _write_runs(group: h5py.Group, part: RunsTable, about: Mapping[str, Mapping[str, Any]]) -> None:
    group.attrs["problem"] = part.problem
    columns: dict[str, NDArray[Any]] = {**part.facts, "crc": part.checksums()}
    for name, column in columns.items():
        write_column(group, name, column).attrs.update(_MEANINGS[name])
    for kind, tables, parts in (
        ("genes", (GENES_TABLE,), part.genes),
        ("values", (OBJECTIVES_TABLE, CONSTRAINTS_TABLE), part.values),
    ):
        below, names = group.create_group(kind), dataset_names(parts)
        group.attrs[kind] = json.dumps(list(parts))
        for name, column in parts.items():
            written = write_column(below, names[name], column)
            for table in tables:
                written.attrs.update(about.get(f"{table}/{name}", {}))


def read_runs(group: h5py.Group) -> tuple[RunsTable, list[str]]:
    """Return the intact evaluations of a problem, and a description of each row with a wrong checksum."""
    facts = {name: group[name][...] for name in KINDS}
    parts = {}
    for kind in ("genes", "values"):
        names = dataset_names(json.loads(group.attrs[kind]))
        parts[kind] = {head: group[kind][name][...] for head, name in names.items()}
    crc = group["crc"][...]
    columns = {**facts, **parts["genes"], **parts["values"], "crc": crc}
    lengths = {name: len(column) for name, column in columns.items()}
    must(len(set(lengths.values())) == 1, f"columns of {group.name}", "all of one length", lengths)
    runs = RunsTable(str(group.attrs["problem"]), facts, parts["genes"], parts["values"])
    intact = runs.checksums() == crc
    if np.all(intact):
        return runs, []
    rows = np.flatnonzero(~intact)
    return runs.chosen(intact), [f"{runs.problem}, row {row}: its checksum does not fit" for row in rows]


def _extent(dataset: h5py.Dataset) -> tuple[int, int]:
    """Return offset and size in bytes of a dataset's raw data; 0 and 0 for an empty one."""
    return dataset.id.get_offset() or 0, dataset.id.get_storage_size()
