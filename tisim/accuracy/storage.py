"""The files of a study: cost.csv, cost.h5 and cost.png, rewritten after each new row.

cost.h5: group ``rows`` has one array per column, in the order of cost.csv, with ``errors`` and
``uncertainties`` of shape (rows, quantities) and ``seconds`` of shape (rows, repeats), NaN for missing
values. Group ``truths`` has the true value of each quantity, with its uncertainty, its origin, and the size
to which errors are relative. The attributes hold the scene as TOML, the settings and the versions, as in the
result.h5 of a run.
"""

from __future__ import annotations

import csv
import io
import json
import math
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tisim.accuracy.cost_study import Row, Study
from tisim.accuracy.quantity import QuantityEstimate, Truth
from tisim.backend import runtime
from tisim.errors import must
from tisim.files import checksum, output_folder, regular_file
from tisim.files.atomic import replace_file
from tisim.files.output_folder import ensure_writable
from tisim.io.run_folder import versions

COST_FORMAT = "tisim cost 3"
COST_CSV, HDF5, PICTURE = "cost.csv", "cost.h5", "cost.png"
COST_FILES = (COST_CSV, HDF5, PICTURE, output_folder.LOCK)
_TEXTS = ("method", "setting", "python", "options", "precision", "arithmetic", "failed")
_NUMBERS: dict[str, type] = {"starts": int, "steps": float, "sums": float, "rejections": float, "same": bool}


def write(study: Study, folder: str | Path) -> list[Path]:
    """Write cost.csv and cost.h5 into a folder, created if missing; return their paths. Earlier ones are
    replaced. RunError if the disk is full."""
    folder = Path(folder)
    ensure_writable(folder)
    replace_file(folder / COST_CSV, as_csv(study).encode())
    _write_rows(study, folder / HDF5)
    return [folder / COST_CSV, folder / HDF5]


def as_csv(study: Study) -> str:
    """Return all rows of a study as CSV, with all digits."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    names = [q.name for q in study.quantities]
    errors = [f"{what} of {name}" for name in names for what in ("error", "uncertainty")]
    writer.writerow([*_TEXTS, *_NUMBERS, "seconds", "least seconds", "most seconds", "repeats", *errors])
    for row in study.rows:
        times = [row.median, min(row.seconds), max(row.seconds)] if row.seconds else [math.nan] * 3
        uncertain_errors = [x for pair in row.errors for x in pair] or [math.nan] * len(errors)
        values = [getattr(row, name) for name in (*_TEXTS, *_NUMBERS)]
        writer.writerow([*values, *times, len(row.seconds), *uncertain_errors])
    return text.getvalue()


def _write_rows(study: Study, path: Path) -> None:
    with checksum.create_file(path) as file:
        file.attrs.update({
            "format": COST_FORMAT, "scene": study.scene.to_toml(), "identity": json.dumps(study.identity()),
            "settings": json.dumps(_settings(study)), "versions": json.dumps(versions()),
            "complete": json.dumps(study.sweep_settings() if study.complete else None),
        })  # fmt: skip
        rows = file.create_group("rows")
        for name in _TEXTS:
            rows[name] = np.array([getattr(row, name) for row in study.rows], dtype=h5py.string_dtype())
        for name, kind in _NUMBERS.items():
            rows[name] = np.array([getattr(row, name) for row in study.rows], dtype=kind)
        rows["seconds"] = _padded([row.seconds for row in study.rows])
        quantities = len(study.quantities)
        pairs = np.full((len(study.rows), quantities, 2), np.nan)
        for k, row in enumerate(study.rows):
            if row.errors:
                pairs[k] = row.errors
        rows["errors"], rows["uncertainties"] = pairs[..., 0], pairs[..., 1]
        truths = file.create_group("truths")
        for quantity, truth in zip(study.quantities, study.truths, strict=False):
            value = truths.create_dataset(quantity.name, data=truth.estimate.value)
            value.attrs.update({
                "uncertainty": truth.estimate.uncertainty, "source": truth.source, "size": truth.size,
                "errors are relative to": quantity.relative_to,
            })  # fmt: skip


def _settings(study: Study) -> dict[str, Any]:
    where = runtime.current()
    return {
        "device": where.device,
        "threads": where.threads,
        "precisions": list(study.precisions),
        "arithmetics": list(study.arithmetics),
    }


def _padded(rows: Sequence[Sequence[float]]) -> np.ndarray:
    values = np.full((len(rows), max(map(len, rows), default=0)), np.nan)
    for k, row in enumerate(rows):
        values[k, : len(row)] = row
    return values


def resumes(folder: Path, fresh: bool | None, overwrite: bool) -> bool:
    """Return whether a study continues from the files in the folder; see ``output_folder.resumes``."""
    begun = regular_file.exists(folder / HDF5)
    return output_folder.resumes(folder, "measurement", begun, "measured costs" * begun, fresh, overwrite)


def clear(folder: Path) -> None:
    """Remove the files of an earlier study, so that they are not taken for results of a new one."""
    for name in (HDF5, COST_CSV, PICTURE):
        (folder / name).unlink(missing_ok=True)


def resume(study: Study, folder: Path) -> None:
    """Load into a study the rows and truths that an earlier study of the same scene has stored in a folder.

    Rows stopped at a shorter time limit than that of this study are dropped and measured again. InputError if
    the stored study differs; no effect if the folder has none.
    """
    path = folder / HDF5
    if not regular_file.exists(path):
        return
    with checksum.open_file(path, f"output folder's {HDF5}", COST_FORMAT) as file:
        same = json.loads(file.attrs["identity"]) == study.identity()
        rule = "without the study of another scene, version, machine or depth (or give --out or --overwrite)"
        must(same, "output folder", rule, str(folder))
        stored = rows_in(file)
        study.rows = [row for row in stored if row.stopped_after >= study.limit]
        study.truths = _truths(file["truths"], study)
        complete = file.attrs["complete"] == json.dumps(study.sweep_settings())
        study.complete = complete and len(study.rows) == len(stored)


@dataclass(frozen=True)
class StoredQuantity:
    """A quantity of a stored study: its name, the origin of its true value, the error of this value, and the
    size to which errors are relative, in words."""

    name: str
    source: str
    error: float
    relative_to: str


@dataclass(frozen=True)
class StoredStudy:
    """A study as its file has it, also while it is running.

    name : of the scene. scene : as TOML. settings : device, threads, precisions and arithmetics.
    complete : whether all settings are measured.
    """

    name: str
    scene: str
    rows: list[Row]
    quantities: list[StoredQuantity]
    settings: dict[str, Any]
    versions: dict[str, Any]
    complete: bool


def stored(path: Path) -> StoredStudy:
    """Return the study in a folder, or in a cost.h5. InputError if there is none, or it is damaged."""
    file_path = path / HDF5 if regular_file.is_folder(path) else path
    must(regular_file.exists(file_path), "file", f"a study of costs, {HDF5}", str(file_path))
    with checksum.open_file(file_path, "file", COST_FORMAT) as file:
        identity, scene = json.loads(file.attrs["identity"]), str(file.attrs["scene"])
        truths = file["truths"]
        quantities = [
            StoredQuantity(
                name,
                str(truths[name].attrs["source"]),
                float(truths[name].attrs["uncertainty"]) / float(truths[name].attrs["size"]),
                str(truths[name].attrs["errors are relative to"]),
            )
            for name in identity["quantities"]
            if name in truths
        ]
        return StoredStudy(
            name=str(tomllib.loads(scene).get("name", "scene")),
            scene=scene,
            rows=rows_in(file),
            quantities=quantities,
            settings=json.loads(file.attrs["settings"]),
            versions=json.loads(file.attrs["versions"]),
            complete=json.loads(file.attrs["complete"]) is not None,
        )


def rows_in(file: h5py.File) -> list[Row]:
    """Return the rows in an open cost.h5."""
    group = file["rows"]
    columns: dict[str, list[Any]] = {name: list(group[name].asstr()) for name in _TEXTS}
    columns |= {name: [kind(value) for value in group[name]] for name, kind in _NUMBERS.items()}
    columns["seconds"] = [tuple(map(float, times[~np.isnan(times)])) for times in group["seconds"][:]]
    columns["errors"] = [
        () if np.isnan(error).all() else tuple(zip(map(float, error), map(float, off), strict=True))
        for error, off in zip(group["errors"][:], group["uncertainties"][:], strict=True)
    ]
    make: Callable[..., Row] = Row
    return [make(**dict(zip(columns, values, strict=True))) for values in zip(*columns.values(), strict=True)]


def _truths(group: Any, study: Study) -> tuple[Truth, ...]:
    if not len(group):
        return ()
    return tuple(
        Truth(
            QuantityEstimate(group[q.name][()], float(group[q.name].attrs["uncertainty"])),
            str(group[q.name].attrs["source"]),
            float(group[q.name].attrs["size"]),
        )
        for q in study.quantities
    )
