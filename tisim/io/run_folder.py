"""The folder of a run: result.h5, scene.toml, versions.json and cloud.png, and trajectory.h5 if requested.

result.h5 is written after the other data, so a folder with this file holds a complete run; only the picture
is written later. Its groups ``start`` and ``end`` have one array per particle quantity, shape (n,) or (n, 3),
with its unit; ``work`` has the counters and ``measures`` the measures of the world. The attributes hold the
status of the run, its settings, and the scene as TOML. A checksum of the whole file follows the HDF5 data
(see checksum.py).
"""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from tisim import version
from tisim.backend import runtime
from tisim.components import serialization
from tisim.engine.assembly import units
from tisim.engine.result import Result, Status
from tisim.errors import InputError, must
from tisim.files import checksum, output_folder, pictures, regular_file
from tisim.files.atomic import replace_file
from tisim.files.output_folder import resumes
from tisim.io.reader import RESULT, frames, refuse_damage, world_count
from tisim.scene import plugins
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DATA = ("result.h5", "checkpoint.h5", "trajectory.h5", "scene.toml", "versions.json", "cloud.png")
"""Files of one run, in the order in which a new run removes them: without result.h5 the folder is one of an
interrupted run, and a checkpoint is useful only with the earlier frames."""
RUN_FILES = (*DATA, output_folder.LOCK)
"""Names of all files that a run writes."""


@dataclass(frozen=True)
class RunFolder:
    """The output folder of a run."""

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

    def check(self, scene: Scene, fresh: bool | None = None, overwrite: bool = False) -> bool:
        """Return whether a run of a scene resumes the work in this folder (see ``output_folder.resumes``);
        nothing is changed.

        Raise InputError if another run is in progress here, or if writing would destroy results. Frames of a
        run that was killed before its first checkpoint may be overwritten, because the same scene reproduces
        them.
        """
        output_folder.check_unlocked(self.path)
        return self._check(scene, fresh, overwrite)

    def _check(self, scene: Scene, fresh: bool | None, overwrite: bool) -> bool:
        finished = regular_file.exists(self.result)
        resumable = regular_file.exists(self.checkpoint) and not finished
        resume = resumes(self.path, "run", resumable, "a finished run" * finished, fresh, overwrite)
        output_folder.check(self.path, RUN_FILES, overwrite)
        if regular_file.exists(self.trajectory) and not (resume or fresh or overwrite):
            rule = "without frames of another scene (or give --fresh)"
            must(self._has_frames_of(scene), "output folder", rule, str(self.path))
        return resume

    def _has_frames_of(self, scene: Scene) -> bool:
        """Return whether the trajectory in this folder is of this scene only."""
        try:
            with frames(self.trajectory) as trajectory:
                return world_count(self.trajectory) == 1 and trajectory.scene.digest() == scene.digest()
        except InputError:
            return False

    @contextmanager
    def claim(self, scene: Scene, fresh: bool | None = None, overwrite: bool = False) -> Iterator[bool]:
        """Create the folder, mark it as tisim's, and hold its lock.

        Yields whether the run resumes earlier work. If it does not, the files of an earlier run are removed,
        so that they cannot be taken for results of the new run, even if that is killed. Raise InputError as
        ``check`` does, and if the folder cannot be created or locked.
        """
        output_folder.claim(self.path, RUN_FILES, overwrite)
        with output_folder.lock(self.path):
            resume = self._check(scene, fresh, overwrite)  # another run may have finished in the meantime
            for name in () if resume else DATA:
                (self.path / name).unlink(missing_ok=True)
            yield resume


def versions() -> dict[str, str]:
    """Return the versions of the software on which a result depends."""
    return {
        "tisim": version.__version__,
        "backend": runtime.backend(),
        "numpy": np.__version__,
        "h5py": h5py.__version__,
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        **plugins.versions(),
    }


def write(result: Result, folder: RunFolder, draw: Callable[[Result], Figure] | None = None) -> list[Path]:
    """Write all files of a run, replacing earlier ones; return their paths. Raise RunError if the disk is
    full.

    draw : draws cloud.png, which is written last; no picture if None. If drawing fails, a message is printed
        on standard error and the picture is left out.
    """
    # The folder may have been removed during the run.
    folder.path.mkdir(parents=True, exist_ok=True)
    folder.result.unlink(missing_ok=True)
    paths = {name: folder.path / name for name in ("scene.toml", "versions.json")}
    replace_file(paths["scene.toml"], result.scene.to_toml().encode())
    replace_file(
        paths["versions.json"], (json.dumps({**versions(), **result.settings}, indent=2) + "\n").encode()
    )
    write_result(result, folder.result)
    folder.checkpoint.unlink(missing_ok=True)
    written = [folder.result, *paths.values()]
    if draw is None:
        return written
    return written + pictures.write_beside_data(folder.path / "cloud.png", lambda: draw(result))


def write_result(result: Result, path: Path) -> None:
    """Write the result.h5 of a run, replacing an earlier one. Raise RunError if the disk is full."""
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


def result_in(file: h5py.File) -> Result:
    """Return the Result in an open file written by ``write_result``, bitwise equal. Raise InputError if its
    content is damaged."""
    with refuse_damage():
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


def _write_arrays(group: h5py.Group, arrays: Arrays, unit_of: dict[str, str]) -> None:
    for name, values in arrays.items():
        group.create_dataset(name, data=values).attrs["unit"] = unit_of.get(name, "")
