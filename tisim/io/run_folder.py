"""A run writes result.h5, scene.toml, versions.json and cloud.png to its folder; trajectory.h5 if asked.

result.h5 is written last, so a folder that holds one holds a whole run. Its groups ``start`` and ``end`` have
one array per particle quantity, shape (n,) or (n, 3), with its unit; ``work`` has the counts, ``measures``
what effects keep of the world; the attributes say how the run ended and under which settings, and hold the
scene as TOML. A checksum of the whole file stands behind its end (see checksum.py).
"""

from __future__ import annotations

import json
import platform
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from tisim import version
from tisim.backend import runtime
from tisim.components import serialization
from tisim.engine.assembly import needed_fields
from tisim.engine.result import Result, Status
from tisim.errors import must
from tisim.files import checksum, lock, ownership, regular_file
from tisim.files.atomic import replace_file
from tisim.files.resuming import resumes
from tisim.io.reader import RESULT, refuse_damage
from tisim.scene import plugins
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.worlds.fields import SHARED, resolve_fields

DATA = ("result.h5", "checkpoint.h5", "trajectory.h5", "scene.toml", "versions.json", "cloud.png")
"""These are the names of the files that are about one run, in the order in which a new run removes them:
without the result the folder is that of an interrupted run, and a checkpoint is of use only with the frames
before it."""
RUN_FILES = (*DATA, lock.LOCK)
"""These are the names of all files that a run writes."""


@dataclass(frozen=True)
class RunFolder:
    """This is the folder that a run writes to."""

    path: Path

    @property
    def result(self) -> Path:
        return self.path / "result.h5"

    @property
    def trajectory(self) -> Path:
        return self.path / "trajectory.h5"

    @property
    def checkpoint(self) -> Path:
        return self.path / "checkpoint.h5"

    def check(self, fresh: bool | None = None, overwrite: bool = False) -> bool:
        """Return whether a run resumes what is here (see ``resuming.resumes``); touch nothing.

        Raise InputError when a run is under way here, or writing here would lose what is not to be lost.
        """
        lock.check(self.path)
        return self._check(fresh, overwrite)

    def _check(self, fresh: bool | None, overwrite: bool) -> bool:
        finished = regular_file.exists(self.result)
        resumable = regular_file.exists(self.checkpoint) and not finished
        resume = resumes(self.path, "run", resumable, "a finished run" * finished, fresh, overwrite)
        frames_lost = regular_file.exists(self.trajectory) and not (resume or fresh or overwrite)
        rule = "without an interrupted run (or give --fresh; there is no checkpoint to go on from)"
        must(not frames_lost, "output folder", rule, str(self.path))
        ownership.check(self.path, RUN_FILES, overwrite)
        return resume

    @contextmanager
    def claim(self, fresh: bool | None = None, overwrite: bool = False) -> Iterator[bool]:
        """Make the folder, mark it as one of tisim's, and hold its lock.

        It yields whether the run resumes what is here. Where it does not, what an earlier one has left is
        removed, so that nothing of it is taken for the new one's, even if that is killed. Raise InputError
        where ``check`` raises it, and where the folder cannot be made or locked.
        """
        ownership.claim(self.path, RUN_FILES, overwrite)
        with lock.acquire(self.path):
            resume = self._check(fresh, overwrite)  # another run may have come and gone since then
            for name in () if resume else DATA:
                (self.path / name).unlink(missing_ok=True)
            yield resume


def versions() -> dict[str, str]:
    """Return the versions of what a result depends on beside its scene."""
    return {
        "tisim": version.__version__,
        "backend": runtime.backend(),
        "numpy": np.__version__,
        "h5py": h5py.__version__,
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        **plugins.versions(),
    }


def write(result: Result, folder: RunFolder) -> list[Path]:
    """Write all files of a run, in place of any before; return their paths. Raise RunError on a full disk."""
    from tisim.plotting import cloud

    folder.result.unlink(missing_ok=True)
    paths = {name: folder.path / name for name in ("scene.toml", "versions.json", "cloud.png")}
    replace_file(paths["scene.toml"], result.scene.to_toml().encode())
    replace_file(
        paths["versions.json"], (json.dumps({**versions(), **result.settings}, indent=2) + "\n").encode()
    )
    with tempfile.SpooledTemporaryFile() as image:
        cloud.cloud(result).savefig(image, dpi=150, format="png")
        image.seek(0)
        replace_file(paths["cloud.png"], image.read())
    write_result(result, folder.result)
    folder.checkpoint.unlink(missing_ok=True)
    return [folder.result, *paths.values()]


def write_result(result: Result, path: Path) -> None:
    """Write the result.h5 of a run, in place of any before. Raise RunError on a full disk."""
    with checksum.create_file(path) as file:
        file.attrs.update({
            "format": RESULT, "scene": result.scene.to_toml(), "ok": result.status.ok,
            "reason": result.status.reason, "time": result.time, "wall_s": result.wall_s,
            "settings": json.dumps(result.settings), "versions": json.dumps(versions()),
        })  # fmt: skip
        unit_of = units(result.scene)
        for name, arrays in (("start", result.start), ("end", result.state)):
            _write_arrays(file.create_group(name), arrays, unit_of)
        file.create_group("work").attrs.update(result.work)
        file.create_group("measures").attrs.update(result.measures)


def read_result(path: Path) -> Result:
    """Return the Result that ``write_result`` has written, to the bit. Raise InputError unless it is
    whole."""
    with checksum.open_file(path, "result", RESULT) as file, refuse_damage():
        arrays = {
            group: {name: np.asarray(values) for name, values in file[group].items()}
            for group in ("start", "end")
        }
        return Result(
            scene=Scene.from_dict(serialization.parse(file.attrs["scene"])),
            state=arrays["end"],
            start=arrays["start"],
            time=float(file.attrs["time"]),
            work={name: int(count) for name, count in file["work"].attrs.items()},
            status=Status(bool(file.attrs["ok"]), str(file.attrs["reason"])),
            wall_s=float(file.attrs["wall_s"]),
            settings=json.loads(file.attrs["settings"]),
            measures={name: float(value) for name, value in file["measures"].attrs.items()},
        )


def units(scene: Scene) -> dict[str, str]:
    """Return the unit of each quantity that particles of a scene have, by name."""
    fields = resolve_fields((*SHARED, *needed_fields(scene.acting(), scene.stepper)))
    return {field.name: field.unit for field in fields}


def _write_arrays(group: h5py.Group, arrays: Arrays, unit_of: dict[str, str]) -> None:
    for name, values in arrays.items():
        group.create_dataset(name, data=values).attrs["unit"] = unit_of.get(name, "")
