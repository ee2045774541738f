"""Trials on a full disk, in a process: ``python -m tests.soak.crowded KIND SEED FIRST LAST FOLDER``.

KIND is the way in which the disk is made full: "limit", a system limit on the size of files, or "tmpfs", a
small file system, for which the process needs mounts of its own (``unshare -rm``). Each trial gives a command
a random part of the space that it needs. For each trial from FIRST to LAST - 1 it prints, as lines of JSON,
the name of the trial, and then its column of Counts ("" if it is good) and the reason.
"""

from __future__ import annotations

import contextlib
import io
import json
import shutil
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from tests.files.full_disk import files_of_at_most
from tests.soak import damage
from tisim import Box, Cloud, RunError, Scene, Simulation
from tisim.backend import runtime
from tisim.cli import main as command_line
from tisim.engine.checkpoint import restore, save
from tisim.steppers import FixedStep, Verlet

FRAMES = 20
SCENE = Scene(
    particles=Cloud(number=30, radius=4e-4, density=3000.0, deviation=(60.0, 60.0, 60.0)),
    domain=Box(low=(-5e-3,) * 3, high=(5e-3,) * 3),
    stepper=Verlet(control=FixedStep(dt=1e-6)),
    duration=1e-3,
)


class Wrong(Exception):
    """A trial has gone wrong: the column of Counts, and the reason."""


def limited(folder: Path, size: int) -> contextlib.AbstractContextManager[None]:
    """No file can grow beyond ``size`` bytes."""
    return files_of_at_most(size)


@contextlib.contextmanager
def mounted(folder: Path, size: int) -> Iterator[None]:
    """The file system of the folder has space for ``size`` more bytes, rounded to system pages."""
    used = shutil.disk_usage(folder).used
    mount(folder, f"remount,size={used + max(size, damage.BLOCK)}")
    try:
        yield
    finally:
        mount(folder, "remount,size=1g")


def mount(folder: Path, options: str) -> None:
    """Make the folder a file system in memory."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)], check=True)


class Bench:
    """tisim commands on one scene, compiled once, and their output on a disk with enough space."""

    def __init__(self, folder: Path) -> None:
        self.simulation = Simulation(SCENE)
        self.toml = folder / "scene.toml"
        self.toml.write_text(SCENE.to_toml())
        self.whole = folder / "whole"
        # The rest of the command is unchanged.
        command_line.Simulation = lambda scene: self.simulation  # type: ignore[assignment, misc]
        assert self.call("run", self.toml, "--frames", FRAMES, "--out", self.whole) == 0
        self.frames = damage._frames(self.whole / "trajectory.h5")
        self.result = damage._frames(self.whole / "result.h5")
        for words in EXPORTS.values():
            assert self.call(*words(self.whole / "trajectory.h5", self.whole)) == 0

    def call(self, *words: object) -> int:
        """The exit code of a command."""
        output = io.StringIO()
        try:
            with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
                command_line.main([str(word) for word in words])
        except SystemExit as exit_:
            if exit_.code not in (0, 1, 2):
                raise Wrong("tracebacks", f"exit code {exit_.code}: {output.getvalue()}") from None
            return int(exit_.code)
        raise AssertionError("a command ends with an exit code")

    def check(self, folder: Path, code: int) -> None:
        """All files that a command has left must equal the files on a disk with enough space, or hold their
        first frames."""
        for path in folder.iterdir():
            if path.name.endswith(".new") or ".new." in path.name:
                raise Wrong("wrong", f"{path.name} is left")
            if path.suffix == ".h5" and path.name not in ("checkpoint.h5", "cost.h5"):
                parts = damage._frames(path)
                expected = self.result if path.name == "result.h5" else self.frames
                whole = path.name != "trajectory.h5" or code == 0
                if parts != (expected if whole else expected[: len(parts)]):
                    raise Wrong("wrong", f"{path.name} holds {len(parts)} of {len(expected)} parts")
            elif path.name in ("cloud.png", "time_series.png") or path.suffix == ".gif":
                with Image.open(path) as picture:
                    picture.load()
            elif path.suffix in (".vtu", ".pvd", ".xyz") and path.read_bytes() != (
                (self.whole / path.name).read_bytes()
            ):
                raise Wrong("wrong", f"{path.name} is not what it is on a disk with room")


def run(bench: Bench, folder: Path, full_disk: Callable, rng: np.random.Generator) -> None:
    """``tisim run --frames``; with enough space again, it continues to the same end."""
    command = ("run", bench.toml, "--frames", FRAMES, "--out", folder)
    with full_disk(folder, _part(rng, bench.whole / "trajectory.h5", bench.whole / "cloud.png")):
        code = bench.call(*command)
        bench.check(folder, code)
    names = [path.name for path in folder.iterdir()]
    if code:
        code = bench.call(*command, "--resume" if "checkpoint.h5" in names else "--overwrite")
    bench.check(folder, code)
    if code or damage._frames(folder / "result.h5") != bench.result:
        raise Wrong("lost", f"the run did not go on from {names}: exit code {code}")


def checkpoint(bench: Bench, folder: Path, full_disk: Callable, rng: np.random.Generator) -> None:
    """A second checkpoint replaces a first one: the file is one of the two."""
    simulation, path = bench.simulation, folder / "checkpoint.h5"
    simulation.load([SCENE])
    simulation.run(steps=10)
    save(simulation, path)
    steps = 10
    simulation.run(steps=10)
    with full_disk(folder, _part(rng, path)), contextlib.suppress(RunError):
        save(simulation, path)
        steps = 20
    bench.check(folder, 0)
    simulation.load([SCENE])
    restore(simulation, path)
    if simulation.results()[0].work["steps"] != steps:
        raise Wrong("lost", f"the checkpoint of step {steps}")


def cost(bench: Bench, folder: Path, full_disk: Callable, rng: np.random.Generator) -> None:
    """A study is rewritten with one more row: the file has all rows or all but the last."""
    from tisim.accuracy import storage

    path, study = damage._cost(folder), damage._study()
    storage.resume(study, folder)
    rows = damage._rows(path)
    study.rows.append(study.rows[0])
    with full_disk(folder, _part(rng, path)), contextlib.suppress(RunError):
        storage.write(study, folder)
        rows = [repr(row) for row in study.rows]
    if damage._rows(path) != rows:
        raise Wrong("lost", f"some of {len(rows)} rows")


def show(name: str) -> Callable:
    """A command that draws or exports a trajectory."""

    def trial(bench: Bench, folder: Path, full_disk: Callable, rng: np.random.Generator) -> None:
        file = bench.whole / "trajectory.h5"
        files = [
            path for path in bench.whole.iterdir() if path.name in MADE[name] or path.suffix in MADE[name]
        ]
        with full_disk(folder, _part(rng, *files)):
            code = bench.call(*EXPORTS[name](file, folder))
            bench.check(folder, code)

    return trial


EXPORTS: dict[str, Callable[[Path, Path], tuple]] = {
    "plot": lambda file, to: ("plot", file, "--out", to, "--overwrite"),
    "movie": lambda file, to: ("movie", file, "--to", to / "flow.gif"),
    "export vtk": lambda file, to: ("export", file, "--out", to),
    "export xyz": lambda file, to: ("export", file, "--format", "xyz", "--out", to),
    "export h5md": lambda file, to: ("export", file, "--format", "h5md", "--out", to),
}
MADE = {
    "plot": ("time_series.png",), "movie": (".gif",), "export vtk": (".vtu", ".pvd"), "export xyz": (".xyz",),
    "export h5md": ("trajectory_copy.h5",),
}  # fmt: skip
TRIALS = {"run": run, "checkpoint": checkpoint, "cost": cost, **{name: show(name) for name in EXPORTS}}


def _part(rng: np.random.Generator, *files: Path) -> int:
    """A random part of the size (bytes) of the largest of these files, occasionally all of it."""
    return int(rng.uniform(0, 1.1) * max(file.stat().st_size for file in files))


def trial(
    bench: Bench, name: str, folder: Path, full_disk: Callable, rng: np.random.Generator
) -> tuple[str, str]:
    """The column of Counts of a trial and the reason; empty if it is good."""
    folder.mkdir(parents=True)
    try:
        if full_disk is mounted:
            mount(folder, "size=1g")
        TRIALS[name](bench, folder, full_disk, rng)
    except Wrong as wrong:
        return wrong.args
    except BaseException:
        return "tracebacks", traceback.format_exc()
    return "", ""


def main() -> None:
    kind, seed, first, last, folder = sys.argv[1], *map(int, sys.argv[2:5]), Path(sys.argv[5])
    runtime.init()
    bench = Bench(folder)
    for k in range(first, last):
        name = list(TRIALS)[k % len(TRIALS)]
        print(json.dumps([name]), flush=True)
        rng = np.random.default_rng([seed, k])
        full_disk = {"limit": limited, "tmpfs": mounted}[kind]
        print(json.dumps(trial(bench, name, folder / str(k) / "out", full_disk, rng)), flush=True)


if __name__ == "__main__":
    main()
