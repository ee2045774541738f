"""Checkpoints: a simulation is saved between two steps and resumed with bitwise identical results.

A checkpoint holds every particle field, the clock, the state of each world and its counters. Pair lists are
not saved: they are rebuilt, and results do not depend on the time of a rebuild. A failed world is saved at
its last good step, and its failure is found again after restoring. If a step is under way in some world, the
checkpoint also holds the state before that step.

Shapes and ranges of the arrays are checked before kernels use them. A checksum detects damage, but not a file
written by another program. For example, a count above the capacity would make kernels read outside of the
memory.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tisim.backend import runtime
from tisim.engine.loading import check_field
from tisim.engine.monitor import Monitor, MonitoredWorlds
from tisim.errors import Words, must
from tisim.files import checksum
from tisim.scene.initial_state import Arrays
from tisim.state.fields import CORE_OF_WORLDS, Field, names_of
from tisim.state.status import WorldStatus

CHECKPOINT_FORMAT = "tisim checkpoint 5"
BEFORE_STEP = "before"
"""Name of the group with the state before the step that is under way."""
ROUNDED_PART = 1e-9
"""Bound of the relative rounding error of times."""
Columns = Mapping[str, np.ndarray]


def _identity(simulation: MonitoredWorlds) -> dict[str, Any]:
    """Return the properties that must be equal in a checkpoint and in the simulation that it is restored
    to."""
    return {
        "scenes": json.dumps([scene.digest() for scene in simulation.scenes]),
        **simulation.runtime.settings,
        "backend": runtime.backend(),
        "worlds": simulation.worlds,
        "capacity": simulation.s.capacity,
    }


def save(simulation: MonitoredWorlds, path: str | Path) -> None:
    """Write a checkpoint of a loaded simulation that is between two steps.

    At every instant, path is either the old or the complete new file. Raise RunError if the disk is full.
    """
    simulation.s.check()
    with checksum.create_file(Path(path)) as file:
        file.attrs.update({"format": CHECKPOINT_FORMAT, "wall_s": simulation.wall_s, **_identity(simulation)})
        file.attrs.update({"edits": json.dumps(simulation.edits), "sorted": simulation.sort is not None})
        image = simulation.s.image()
        for name, values in image.items():
            file[name] = values
        for field in simulation.s.reported:
            file[field.name].attrs["unit"] = field.unit
        if image["underway"].any():
            for name, values in simulation.monitor.replay.whole().items():
                file[f"{BEFORE_STEP}/{name}"] = values


@dataclass(frozen=True)
class Snapshot:
    """The particles of each world at the time of a checkpoint.

    times : s, shape (worlds,). steps : number of steps taken, shape (worlds,).
    states : for each world the arrays of its particles by field name, SI; shape (n,) or (n, 3).
    """

    times: np.ndarray
    steps: np.ndarray
    states: tuple[Arrays, ...]


def snapshot(path: str | Path) -> Snapshot:
    """Return the particles in a checkpoint; if a step is under way, their state before that step.

    Raise InputError if the file is not a checkpoint, is truncated or damaged.
    """
    with checksum.open_file(Path(path), "checkpoint", CHECKPOINT_FORMAT) as file:
        return snapshot_in(file)


def snapshot_in(file: h5py.File) -> Snapshot:
    """Return the particles in an open checkpoint, as ``snapshot`` does."""
    group, worlds = file.get(BEFORE_STEP, file), len(json.loads(file.attrs["scenes"]))
    arrays = _read(group, [name for name in file if "unit" in file[name].attrs])
    books = _read(group, ("count", "time", "steps"))
    shape = arrays["mass"].shape if "mass" in arrays else ()
    whole = len(shape) == 2 and shape[0] >= worlds
    whole = whole and all(values.shape[:2] == shape for values in arrays.values())
    whole = whole and all(values.shape == shape[:1] for values in books.values())
    must(whole, "checkpoint", "of particles in rows of one length", shape)
    counts, times, steps = (books[name][:worlds] for name in ("count", "time", "steps"))
    fits = bool(((counts >= 0) & (counts <= shape[1])).all())
    must(fits, "checkpoint's count", f"between 0 and {shape[1]}", counts.tolist())
    # Particles may be sorted by position in memory; a snapshot is in the order of ids.
    by_id = bool(file.attrs["sorted"])
    orders = [np.argsort(arrays["id"][w, :n]) if by_id else np.arange(n) for w, n in enumerate(counts)]
    states = tuple({k: v[w, order] for k, v in arrays.items()} for w, order in enumerate(orders))
    return Snapshot(times, steps, states)


def restore(simulation: MonitoredWorlds, path: str | Path) -> None:
    """Restore a simulation, loaded with the same scenes, to the state in a checkpoint.

    Raise InputError if the file is not a checkpoint, is truncated or damaged, or is of other scenes, another
    precision or another capacity; the simulation is then unchanged.
    """
    simulation.s.check()
    with checksum.open_file(Path(path), "checkpoint", CHECKPOINT_FORMAT) as file:
        for name, value in _identity(simulation).items():
            _require_equal(name, value, file.attrs[name])
        wall_s, edits = float(file.attrs["wall_s"]), json.loads(file.attrs["edits"])
        names, own, used = simulation.s.saved(), simulation.s.image(), len(simulation.scenes)
        columns = _read(file, names)
        group = file.get(BEFORE_STEP, file)
        before = _read(group, names)
        for saved in (columns, before):
            _check_columns(saved, own, simulation.s.fields, used)
    simulation.put(columns)
    simulation.wall_s = wall_s
    simulation.edits = edits
    simulation.monitor = Monitor(simulation, before)
    simulation.monitor.check_worlds()


def _read(group: h5py.Group, names: Iterable[str]) -> Arrays:
    """Return the named data sets of a checkpoint."""
    for name in names:
        must(
            isinstance(group.get(name), h5py.Dataset),
            "checkpoint",
            f"one that holds {name}",
            Words("one without"),
        )
    return {name: np.asarray(group[name]) for name in names}


def _require_equal(name: str, value: Any, received: Any) -> None:
    if name == "scenes":
        must(value == received, "checkpoint", "of the same scenes", Words("one of others"))
    must(value == received, f"checkpoint's {name}", str(value), received)


def _check_columns(columns: Columns, own: Columns, fields: Sequence[Field], worlds: int) -> None:
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
    end, seed = own["end"][:worlds], own["seed"][:worlds]
    same = np.array_equal(columns["seed"][:worlds], seed)
    must(same, "checkpoint's seed", f"{seed.tolist()}", columns["seed"][:worlds].tolist())
    # A world that has ended before its duration, at rest for example, has an earlier end.
    saved, time = columns["end"][:worlds], columns["time"][:worlds]
    ended = (saved >= 0) & (saved < end) & (time >= saved * (1 - ROUNDED_PART))
    rule = f"{end.tolist()}, or the time at which a world ended before"
    must(bool(((saved == end) | ended).all()), "checkpoint's end", rule, saved.tolist())
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
