"""Validation of the arrays in a checkpoint: their shapes and ranges are checked before kernels use them.

A checksum detects damage, but not a file written by another program. For example, a count above the capacity
would make kernels read outside of the memory.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tisim.engine.loading import check_field
from tisim.errors import Words, must
from tisim.state.fields import CORE_OF_WORLDS, Field, names_of
from tisim.state.status import WorldStatus

ROUNDED_PART = 1e-9
"""Bound of the relative rounding error of times."""
Columns = Mapping[str, np.ndarray]


def check_columns(columns: Columns, own: Columns, fields: Sequence[Field], worlds: int) -> None:
    """Raise InputError unless columns of a checkpoint may replace those of a simulation.

    own : columns of the simulation, loaded with the same scenes, by name; the first ``worlds`` rows are in
        use.
    fields : particle fields.
    """
    for name, there in own.items():
        column = columns[name]
        rule = f"{there.dtype} numbers of shape {there.shape}"
        must(
            column.shape == there.shape and column.dtype == there.dtype,
            f"checkpoint's {name}",
            rule,
            Words(f"{column.dtype}, {column.shape}"),
        )
    capacity = own["mass"].shape[1]
    _within(columns, "count", 0, capacity)
    for name in ("status", "failed"):
        known = np.isin(columns[name], [int(one) for one in WorldStatus])
        must(bool(known.all()), f"checkpoint's {name}", "a known status", columns[name][~known].tolist()[:1])
    _check_times(columns, own, worlds)
    for name in names_of(CORE_OF_WORLDS, "counter"):
        _within(columns, name, 0, np.inf)
    for w in range(worlds):
        _check_particles(columns, fields, w, capacity)


def _check_times(columns: Columns, own: Columns, worlds: int) -> None:
    end = own["end"][:worlds]
    for name in ("end", "seed"):
        same = np.array_equal(columns[name][:worlds], own[name][:worlds])
        must(same, f"checkpoint's {name}", f"{own[name][:worlds].tolist()}", columns[name][:worlds].tolist())
    _within(columns, "time", 0.0, float(end.max(initial=0.0)) * (1 + ROUNDED_PART))
    most = ROUNDED_PART * float(end.max(initial=0.0))
    _within(columns, "time_carry", -most, most)


def _check_particles(columns: Columns, fields: Sequence[Field], w: int, capacity: int) -> None:
    """Check the particle fields of a world, except scratch fields of the stepper."""
    n = int(columns["count"][w])
    there = columns["mass"][w, :n] != 0
    for field in fields:
        values = columns[field.name][w, :n][there]
        if not field.scratch:
            check_field(field, values, len(values), "checkpoint")
        if field.lookup or (field.name.startswith("clump_") and field.integer):
            # These values are indices into memory.
            _within({field.name: values}, field.name, -capacity, capacity)


def _within(columns: Columns, name: str, low: float, high: float) -> None:
    values: Any = columns[name]
    fine = (values >= low) & (values <= high)
    must(
        bool(fine.all()), f"checkpoint's {name}", f"between {low:g} and {high:g}", values[~fine].tolist()[:1]
    )
