"""Writing of a trajectory, the particles of a run at many times, to an H5MD file during the run.

A frame is the state at the end of the first step at or after each requested time; recording does not change
the steps. The file has a group of particles for each scene: ``all``, or ``world_0`` and so on. Particles are
in the order of their ids; frames with fewer particles are padded (see h5md.py). The observables of a group
are the measures of its world, such as forces on walls.

The file can be read after every single write by any reader, so also after the run was killed (see
tisim/files/hdf5.py). A reader that meets an unfinished write must retry, as reader.py does. ``step`` is
extended last, so all frames that it counts are complete. The file is created under a temporary name, with all
datasets but no frames, and then renamed.
"""

from __future__ import annotations

import errno
import io
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from tisim import version
from tisim.engine.assembly import measured, needed_fields
from tisim.errors import InputError, RunError, Words, must
from tisim.files import regular_file
from tisim.files.atomic import replace_file, temporary_name
from tisim.files.hdf5 import GrowingFile
from tisim.interrupt import defer_signals
from tisim.io import h5md
from tisim.io.reader import Frame, frames, world_count
from tisim.scene.scene import Scene
from tisim.state.fields import Field, resolve_fields

LIBVER = ("v110", "v110")
"""Oldest and newest HDF5 version of the file format; earlier versions have no checksums of the file
structure."""
DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class Trajectory:
    """A file that frames are written to, for scenes that run one after another or side by side.

    It is a context manager: without ``with``, ``close`` must be called.
    """

    def __init__(self, path: str | Path, scenes: Sequence[Scene], real: str = "f64") -> None:
        """Create the file, replacing an earlier one. real : "f64" or "f32".

        Raise InputError if it cannot be created, RunError if the disk is full.
        """
        self.scenes, self.path = list(scenes), Path(path)
        self.fields = [recorded_fields(scene) for scene in scenes]
        _replace(self.path, self._empty_image(np.float64 if real == "f64" else np.float32))
        self._resources = ExitStack()
        try:
            self._open()
        except BaseException:
            self._finish()
            raise

    # HDF5 calls GrowingFile. A signal handler must not raise there, because HDF5 could then not close the
    # file.
    @defer_signals()
    def _open(self) -> None:
        self.disk = self._resources.enter_context(GrowingFile(self.path))
        self.file = self._resources.enter_context(h5py.File(self.disk, "r+", libver=LIBVER))
        # From here on only rows can be added.
        self.file.swmr_mode = True
        names = h5md.group_names(len(self.scenes))
        self.groups = [self.file[f"particles/{name}"] for name in names]
        self.checksums = [self.file[f"{h5md.CHECKSUMS}/{name}"] for name in names]
        self.observables = [
            {one: self.file[f"{h5md.OBSERVABLES}/{name}/{one}/value"] for one in measured(scene.effects)}
            for name, scene in zip(names, self.scenes, strict=True)
        ]

    def _empty_image(self, real: Any) -> bytes:
        """Return the bytes of the file without frames."""
        image = io.BytesIO()
        with h5py.File(image, "w", libver=LIBVER) as file:
            h5md.write_metadata(file, version.__version__)
            names = h5md.group_names(len(self.scenes))
            for name, scene, fields in zip(names, self.scenes, self.fields, strict=True):
                group = file.create_group(f"particles/{name}")
                h5md.write_box(group, scene.domain)
                h5md.create_elements(group, fields, scene.capacity(), real)
                if scene.domain.shears():
                    h5md.create_edges(group)
                h5md.create_observables(file, name, measured(scene.effects))
                h5md.write_scene(file, name, scene.to_toml())
                h5md.create_checksums(file, name)
        return image.getvalue()

    @classmethod
    def resume(cls, path: str | Path, scene: Scene, time: float, real: str = "f64") -> Self:
        """Open the file of a stopped run without its frames after ``time`` (s), or create one.

        Raise InputError if the file is damaged, or of another scene; it is then unchanged.
        """
        path = Path(path)
        if not regular_file.exists(path):
            return cls(path, [scene], real)
        new = path.with_name(temporary_name(path.name))
        with frames(path) as before, ExitStack() as cleanup:
            same_scene = world_count(path) == 1 and before.scene.digest() == scene.digest()
            must(
                same_scene, "trajectory to go on with", "of the same scene", Words(f"{path}, of another one")
            )
            cleanup.callback(new.unlink, missing_ok=True)
            trajectory = cls(new, [scene], real)
            cleanup.push(trajectory)
            for frame in before:
                if frame.time <= time:
                    trajectory.write(0, frame)
            new.replace(path)
            cleanup.pop_all()
        trajectory.path = path
        return trajectory

    @defer_signals()
    def write(self, index: int, frame: Frame) -> None:
        """Add a frame of the scene with this index; raise RunError if the disk is full. Ctrl-C is
        deferred."""
        group, count = self.groups[index], len(frame.arrays["id"])
        order = np.argsort(frame.arrays["id"], kind="stable")
        row = group["position/step"].shape[0]
        arrays = {}
        for field in self.fields[index]:
            value = group[field.name]["value"]
            arrays[field.name] = frame.arrays[field.name][order].astype(value.dtype)
            value.resize((row + 1, max(count, value.shape[1]), *value.shape[2:]))
            value[row, :count] = arrays[field.name]
            self._flush(value)
        domain = self.scenes[index].domain
        if domain.shears():
            edges = group["box/edges/value"]
            edges.resize(row + 1, axis=0)
            edges[row] = domain.edges(frame.time)
            self._flush(edges)
        measures = {name: frame.measures.get(name, np.nan) for name in self.observables[index]}
        for name, observable in self.observables[index].items():
            observable.resize(row + 1, axis=0)
            observable[row] = measures[name]
            self._flush(observable)
        clock = h5md.clock_checksum(frame.step, frame.time, measures)
        # The step is written last: it marks the row as complete.
        for column, entry in (
            (self.checksums[index], (clock, h5md.frame_checksum(clock, arrays))),
            (group["position/time"], frame.time),
            (group["position/step"], frame.step),
        ):
            column.resize(row + 1, axis=0)
            column[row] = entry
            self._flush(column)

    def _flush(self, dataset: h5py.Dataset) -> None:
        dataset.flush()
        self._check()

    def _check(self) -> None:
        if self.disk.failure is not None:
            why = self.disk.failure.strerror or self.disk.failure
            raise RunError(f"{self.path} could not be written: {why}; frames before are intact")

    @defer_signals()
    def _finish(self) -> None:
        self._resources.close()

    def close(self) -> None:
        """Finish the file; raise RunError if some data could not be written."""
        self._finish()
        self._check()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._finish()
        if value is None:
            self._check()


def _replace(path: Path, image: bytes) -> None:
    try:
        replace_file(path, image)
    except RunError as error:
        cause = error.__cause__
        if not isinstance(cause, OSError) or cause.errno in DISK_FULL:
            raise
        rule = "a file that can be written"
        raise InputError(f"trajectory must be {rule}; received {str(path)!r} ({cause})") from None


def recorded_fields(scene: Scene) -> tuple[Field, ...]:
    """Return the fields in a trajectory of a scene: all except contact histories and scratch fields, unless a
    field says otherwise."""
    fields = resolve_fields(needed_fields(scene.acting(), scene.stepper))
    usual = {field: not (field.slots or field.scratch) for field in fields}
    return tuple(field for field in fields if (usual[field] if field.recorded is None else field.recorded))
