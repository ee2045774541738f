"""Reads files of the previous format, which are converted at the next fold.

In that format a run had the values of its objectives without their names, and its design as JSON. The names
are taken from the identities of the searches stored in the same file.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import h5py
from pydantic import BaseModel, ConfigDict

from tisim.optimize.storage.record import Integer64, Record, canonical
from tisim.optimize.storage.table import Hdf5Table

FORMAT = "tisim evaluations 1"
_TEXT = ("key", "problem", "reason", "design", "work")
_NUMBERS = ("fitness", "ok", "seed", "wall_s", "created", "crc")


class _OlderForm(BaseModel):
    """Validates an evaluation of that format, from a journal or from a row with its checksum."""

    model_config = ConfigDict(strict=True, extra="forbid")
    key: str
    problem: str
    fitness: float | None
    ok: bool
    reason: str
    seed: Integer64
    design: dict[str, float]
    work: dict[str, Any]
    wall_s: float
    created: float
    others: list[float | None] = []


def parse(payload: bytes, tables: Mapping[str, Hdf5Table]) -> Record:
    """Return the evaluation in a frame of a journal. ValueError if there is none, or no search in these
    tables names its objectives."""
    form = _OlderForm.model_validate_json(payload)
    values = [math.nan if value is None else value for value in (form.fitness, *form.others)]
    names, genes = _names(form.problem, len(values), tables)
    fields = form.model_dump(exclude={"fitness", "others", "design"})
    order = [gene for gene in dict.fromkeys((*genes, *form.design)) if gene in form.design]
    design = {gene: form.design[gene] for gene in order}
    return Record(**fields, values=dict(zip(names, values, strict=True)), design=design)


def read_rows(group: h5py.Group, tables: Mapping[str, Hdf5Table]) -> tuple[list[Record], list[str]]:
    """Return the valid evaluations in order, and a description of each invalid row."""
    columns = {name: group[name][...] for name in (*_TEXT, *_NUMBERS)}
    if "others" in group:
        columns["others"] = group["others"][...]
    records, damaged = [], []
    for row in range(len(columns["key"])):
        try:
            cells = {name: column[row].item() for name, column in columns.items()}
            records.append(parse(_payload(cells), tables))
        except (ValueError, TypeError, ArithmeticError) as error:
            unnamed = isinstance(error, _Unnamed)
            damaged.append(f"row {row}: {error if unnamed else 'its checksum does not fit'}")
    return records, damaged


class _Unnamed(ValueError):
    """No search in the file names the objectives."""


def _payload(cells: Mapping[str, Any]) -> bytes:
    """Return the row in the form of its journal frame; ValueError if its checksum is wrong."""
    text = {name: cells[name].decode() for name in _TEXT}
    fields = {**text, **{name: cells[name] for name in _NUMBERS if name != "crc"}}
    fields |= {name: json.loads(text[name]) for name in ("design", "work")}
    fields["fitness"] = cells["fitness"] if math.isfinite(cells["fitness"]) else None
    fields["ok"] = bool(cells["ok"])
    if others := json.loads(cells.get("others", b"[]")):
        fields["others"] = others
    payload = canonical(fields)
    if zlib.crc32(payload) != cells["crc"]:
        raise ValueError("checksum")
    return payload


def _names(problem: str, count: int, tables: Mapping[str, Hdf5Table]) -> tuple[Sequence[str], Sequence[str]]:
    """Return the names of this number of objectives, and of the genes, in order."""
    for table in tables.values():
        if table.intact and "identity" in table.attrs:
            identity = json.loads(table.attrs["identity"])
            names = identity.get("objective_order", list(identity.get("objectives", ())))
            if identity.get("problem") == problem and len(names) == count:
                return names, identity.get("gene_order", ())
    raise _Unnamed("no search in the file names its objectives")
