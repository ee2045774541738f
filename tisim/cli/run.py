"""The command ``tisim run`` runs a scene to its end or until Ctrl-C, and resumes a run that was stopped."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.table import Table

from tisim.backend import runtime
from tisim.cli import scene_arguments
from tisim.cli.options import (
    Absent,
    Arithmetic,
    Changes,
    Device,
    Every,
    Frames,
    Fresh,
    Out,
    Overwrite,
    Plugins,
    Precision,
    SceneVariant,
    Seed,
    Size,
    Target,
    Threads,
)
from tisim.console import err, out, plain_table, print_stopping, progress_bar
from tisim.engine.observer import Observer, PeriodicCheckpoint
from tisim.engine.result import Result
from tisim.engine.simulation import Simulation
from tisim.errors import InputError, RunError, must
from tisim.files import regular_file
from tisim.files.output_folder import resume_hint
from tisim.interrupt import Interrupt
from tisim.state.fields import names_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def run(
    target: Target, absent: Absent = None, changes: Changes = None, folder: Out = None,
    seed: Seed = None, size: Size = None, device: Device = "cpu", precision: Precision = "f64",
    arithmetic: Arithmetic = "strict", threads: Threads = 0, fresh: Fresh = None,
    overwrite: Overwrite = False, frames: Frames = None, every: Every = None, plugins: Plugins = None,
    variant: SceneVariant = None,
) -> None:  # fmt: skip
    """Run a scene, and write its result and a picture.

    The files are result.h5, scene.toml, versions.json and cloud.png.
    """
    from tisim.engine import checkpoint
    from tisim.io import run_folder
    from tisim.io.recording import check_frames, recording_from_options

    scene_arguments.checkpoint_seconds()
    runtime.init(device, precision, threads, arithmetic)
    name, scene = scene_arguments.load_scene(target, size, seed, absent or (), changes or (), variant)
    out_folder = run_folder.RunFolder(folder or Path("out") / name)
    resume = out_folder.check(scene, fresh, overwrite)
    check_frames(scene, frames, "--frames", "--every")
    recording = recording_from_options(out_folder.trajectory, frames, every, resume)
    with err().status("compiling"):
        simulation = Simulation(scene)
        simulation.load([scene])
    with out_folder.claim(scene, fresh, overwrite) as resume_now:
        must(resume_now == resume, "output folder", "as it was when the command began", str(out_folder.path))
        if resume:
            _restore(simulation, out_folder.checkpoint)
        observer_context = recording.observer(simulation, resume) if recording else nullcontext()
        seconds = scene_arguments.checkpoint_seconds()
        checkpoints = PeriodicCheckpoint(out_folder.checkpoint, seconds)
        try:
            with observer_context as recorder:
                if resume:
                    err().print(f"going on with {out_folder.checkpoint}, from {_reached(simulation)}")
                observers = [recorder, checkpoints] if recorder else [checkpoints]
                finished = _advance(simulation, name, observers)
            paths = run_folder.write(simulation.results()[0], out_folder, _cloud) if finished else []
        except RunError as error:
            hint = resume_hint(fresh, overwrite, "make room and ")
            advice = _save_after_error(simulation, out_folder.checkpoint, hint)
            raise RunError(f"{error}. {advice}") from error
        if not finished:
            checkpoint.save(simulation, out_folder.checkpoint)
            err().print(
                f"stopped at {_reached(simulation)}; {out_folder.checkpoint} is written. "
                f"{resume_hint(fresh, overwrite)}"
            )
            raise typer.Exit(130)
    result = simulation.results()[0]
    paths += [out_folder.trajectory] if recording else []
    out().print(_summary(result, simulation.setup_s, paths))
    if not result.status.ok:
        raise RunError(f"run failed {result.status.reason}")


def _advance(simulation: Simulation, name: str, observers: Sequence[Observer]) -> bool:
    """Run to the end with a progress bar; return False if Ctrl-C has stopped the run between two steps."""
    with progress_bar("{task.description}") as bar, Interrupt(print_stopping) as ctrl_c:
        open_ended = bool(simulation.scenes[0].stepper.ends)
        task = bar.add_task(name, total=None if open_ended else 1.0)

        def report(simulation: Simulation) -> None:
            if open_ended:
                bar.update(task, description=f"{name}, {_reached(simulation)}")
            else:
                description = f"{name}, {simulation.remaining_steps():.3g} steps to go"
                # A failed run is not complete, so its simulated fraction is shown.
                bar.update(task, completed=float(simulation.simulated()[0]), description=description)
            ctrl_c.check()

        try:
            simulation.run(observers=[*observers, report])
        except KeyboardInterrupt:
            if ctrl_c.forced:
                raise
            return False
    return True


def _reached(simulation: Simulation) -> str:
    """Return how far a run has come: the simulated part of its duration, or the steps and the measures of a
    stepper that ends the run by itself."""
    stepper = simulation.scenes[0].stepper
    if not stepper.ends:
        return f"{simulation.fraction():.1%}"
    now = simulation.s.snapshot(("steps", *names_of(stepper.world_fields, "measure")))
    steps = int(now.pop("steps")[0])
    measures = [f"{name} {float(value[0]):.4g}" for name, value in now.items()] if steps else []
    return ", ".join((f"step {steps}", *measures))


def _restore(simulation: Simulation, path: Path) -> None:
    """Restore a simulation to the state in which the run was stopped."""
    from tisim.engine import checkpoint

    try:
        checkpoint.restore(simulation, path)
    except InputError as error:
        raise InputError(f"{error} (to begin anew, give --out or --fresh)") from None


def _save_after_error(simulation: Simulation, path: Path, hint: str) -> str:
    """Save a checkpoint after a file could not be written; return sentences that tell how to resume.

    hint : the command that resumes the run, as a sentence.
    """
    from tisim.engine import checkpoint

    try:
        checkpoint.save(simulation, path)
    except RunError:
        return (
            "No checkpoint could be written either"
            + "; the previous one is intact." * regular_file.exists(path)
        )
    return f"{path} is written. {hint}"


def _cloud(result: Result) -> Figure:
    from tisim.plotting.cloud import cloud

    return cloud(result)


def _summary(result: Result, setup_s: float, paths: Sequence[Path]) -> Table:
    counts = len(result.start["mass"]), len(result.state["mass"])
    table = plain_table()
    table.add_row("status", "ok" if result.status.ok else "failed")
    early = result.status.ok and not math.isclose(result.time, result.scene.duration)
    table.add_row("time", f"{result.time:g} s of {result.scene.duration:g} s" + ", ended by itself" * early)
    table.add_row("particles", f"{counts[0]} at the start, {counts[1]} at the end")
    for name, count in result.work.items():
        table.add_row(name.replace("_", " "), str(count))
    for name, value in result.measures.items():
        table.add_row(name.replace("_", " "), f"{value:.6g}")
    settings = result.settings
    table.add_row("device", ", ".join(settings[name] for name in ("device", "precision", "arithmetic")))
    if "threads" in settings:
        table.add_row("threads", settings["threads"])
    table.add_row("wall time", f"{result.wall_s:.2f} s, after {setup_s:.2f} s to compile")
    table.add_row("written", "\n".join(map(str, paths)))
    return table
