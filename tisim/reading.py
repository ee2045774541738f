"""Reading of any file written by a run or a cost study; the kind of file is recognised from its content."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py

from tisim.components import serialization
from tisim.engine import checkpoint
from tisim.errors import InputError, Words, must
from tisim.files import checksum, regular_file
from tisim.files.hdf5 import SIGNATURE, SIZE, is_valid
from tisim.io import run_folder
from tisim.io.reader import RESULT, RecordedTrajectory
from tisim.scene.scene import Scene

READABLE = (
    "the folder of a run, result.h5, trajectory.h5, checkpoint.h5, cost.h5, versions.json or scene as TOML"
)
"""The files that ``read`` can read, as listed in messages."""
SEARCH_FORMAT = "tisim evaluations"
"""Start of the format attribute of a search.h5. It is defined in the package of searches; a test checks that
both agree."""


def read(path: str | Path) -> Any:
    """Return the content of a file or folder written by a run.

    - The folder of a run, or a result.h5: its ``Result``, complete. The folder of a study: as its cost.h5.
    - A trajectory.h5, also while it grows: a ``RecordedTrajectory``, whose frames are read on access.
    - A checkpoint.h5: a ``Snapshot``, the state and the time of each world.
    - A cost.h5: the rows of a study, a list of ``tisim.accuracy`` Rows.
    - A scene as TOML: a ``Scene``. A versions.json: a dict.

    Raise InputError if it is anything else, does not exist, or is damaged.
    """
    must(isinstance(path, str | os.PathLike), "path", "text or a pathlib.Path", path)
    file_path = Path(path)
    if regular_file.is_folder(file_path):
        files = [file_path / name for name in ("result.h5", "cost.h5")]
        file = next((file for file in files if regular_file.exists(file)), None)
        rule = "one with a whole run or study (the files of an interrupted run are read one by one)"
        if file is None:
            raise InputError(f"folder must be {rule}; received {str(path)!r}")
        return read(file)
    must(regular_file.exists(file_path), "file to read", "an existing file", str(path))
    head = regular_file.content(regular_file.target(file_path), SIZE) or b""
    if not head.startswith(SIGNATURE):
        return _read_text(file_path)
    # A trajectory has its own checksums, and may be large.
    return RecordedTrajectory(file_path) if is_valid(head) else _read_hdf5(file_path)


def _read_hdf5(path: Path) -> Any:
    """Return the content of an HDF5 file that is written at once."""
    # Cost studies load SciPy, which takes a second and is not needed for trajectories and scenes.
    from tisim.accuracy import storage

    readers: dict[str, Callable[[h5py.File], Any]] = {
        RESULT: run_folder.result_in,
        checkpoint.CHECKPOINT_FORMAT: checkpoint.snapshot_in,
        storage.COST_FORMAT: storage.rows_in,
    }
    rule = f"{READABLE}; a search is read by `tisim.optimize.read`, and listed by `tisim cache`"
    with checksum.open_any(path, "file to read", READABLE) as file:
        kind = str(file.attrs.get("format", "none"))
        must(not kind.startswith(SEARCH_FORMAT), "file to read", rule, Words(f"{path}, of a search"))
        must(kind in readers, "file to read", READABLE, Words(f"{path}, of the format {kind}"))
        return readers[kind](file)


def _read_text(path: Path) -> Any:
    """Return the content of a text file: JSON or TOML."""
    content = regular_file.content(regular_file.target(path)) or b""
    try:
        text = content.decode()
        if text.lstrip().startswith("{"):
            versions = json.loads(text)
            must("tisim" in versions, "file to read", READABLE, Words(f"{path}, JSON of something else"))
            return versions
        table = serialization.parse(text)
    except (UnicodeDecodeError, RecursionError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        if path.suffix == ".toml":
            return Scene.from_toml(path)
        raise InputError(f"file to read must be {READABLE}; received {str(path)!r}") from None
    return Scene.from_dict(table, path.parent)
