"""The command ``tisim cost`` measures how the accuracy of a scene depends on the run time."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tisim.backend import runtime
from tisim.cli import scene_arguments, targets
from tisim.cli.options import (
    Absent,
    Changes,
    Device,
    Fresh,
    Out,
    Overwrite,
    Plugins,
    Seed,
    Target,
    Threads,
)
from tisim.console import err, out, print_stopping
from tisim.errors import must
from tisim.files import output_folder, pictures
from tisim.files.output_folder import resume_hint
from tisim.interrupt import Interrupt

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tisim.accuracy import Quantity, Row, Study
    from tisim.scene.scene import Scene

CostSize = Annotated[
    str | None,
    typer.Option(
        "--size", help="Size of the case; by default the size that 'tisim cases' marks for this command."
    ),
]
QUICK_LIMIT = 20.0
"""With --quick, a setting that runs longer than this is stopped, s."""


def cost(
    target: Target,
    error: Annotated[
        float | None, typer.Option(help="Print the cheapest settings with an error of at most this.")
    ] = None,
    quantity: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Quantity that --error refers to; by default the first in the table."
        ),
    ] = None,
    size: CostSize = None,
    seed: Seed = None,
    absent: Absent = None,
    changes: Changes = None,
    folder: Out = None,
    coarser: Annotated[
        int | None,
        typer.Option(
            min=-16, max=16, help="Decades of error to scan above the scene's own setting; 3 by default."
        ),
    ] = None,
    finer: Annotated[
        int | None,
        typer.Option(
            min=-16, max=16, help="Decades of error to scan below the scene's own setting; 0 by default."
        ),
    ] = None,
    repeats: Annotated[
        int | None, typer.Option(max=1000, help="Number of times each setting is timed; 3 by default.")
    ] = None,
    starts: Annotated[
        str | None, typer.Option(metavar="N,N,...", help="Numbers of random starts to try: 8,32,128.")
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="A quick estimate: scan down to one decade above the scene's own error, time each setting "
            "once, and give up if the reference cannot tell settings apart.",
        ),
    ] = False,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="With --quick, continue even if the reference is too inaccurate.")
    ] = False,
    limit: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help=f"Stop a setting that runs longer; {QUICK_LIMIT:g} with --quick, else none by default.",
        ),
    ] = None,
    budget: Annotated[
        float,
        typer.Option(
            metavar="MINUTES",
            help="Skip settings that would exceed this running time; compiling is not counted.",
        ),
    ] = math.inf,
    single: Annotated[bool, typer.Option("--f32/--no-f32", help="Also run in single precision.")] = True,
    fast: Annotated[bool, typer.Option("--fast/--no-fast", help="Also run with fast arithmetic.")] = True,
    device: Device = "cpu",
    threads: Threads = 0,
    fresh: Fresh = None,
    overwrite: Overwrite = False,
    plugins: Plugins = None,
) -> None:
    """Measure error against time for every setting of a scene.

    It writes cost.csv, cost.h5 and cost.png. The same command, given again, resumes where it was stopped, and
    answers --error from the stored measurements.
    """
    from tisim.accuracy import Study, report, storage

    must(error is None or error > 0, "--error", "greater than 0", error)
    runtime.init(device, "f64", threads)
    size = size or _size(target)
    name, scene = scene_arguments.load_scene(target, size, seed, absent or (), changes or ())
    study = Study(
        scene,
        _quantities(target, scene),
        coarser=3 if coarser is None else coarser,
        finer=(-1 if quick else 0) if finer is None else finer,
        repeats=(1 if quick else 3) if repeats is None else repeats,
        precisions=("f64", "f32") if single else ("f64",),
        arithmetics=("strict", "fast") if fast else ("strict",),
        starts=((4, 16, 64) if quick else (8, 32, 128)) if starts is None else _whole_numbers(starts),
        budget=60 * budget,
        limit=(QUICK_LIMIT if quick else math.inf) if limit is None else limit,
        require_reference=quick and not anyway,
    )
    quantity_index = study.index(quantity)
    out_folder = folder or Path("out") / f"{name}-cost"
    storage.resumes(out_folder, fresh, overwrite)
    output_folder.claim(out_folder, storage.COST_FILES, overwrite)
    with output_folder.lock(out_folder):
        if storage.resumes(out_folder, fresh, overwrite):
            storage.resume(study, out_folder)
            err().print(f"going on with {out_folder / storage.HDF5}, which has {len(study.rows)} settings")
        else:
            storage.clear(out_folder)
        finished = _measure(study, out_folder)
        if study.truths and study.rows:
            paths = storage.write(study, out_folder)
            paths += pictures.write_beside_data(out_folder / storage.PICTURE, lambda: _plot(study))
            out().print(report.table(study))
            out().print("\n".join([*report.notes(study), *map(str, paths)]))
    if not finished:
        err().print(
            f"stopped; {out_folder / storage.HDF5} has all measurements. {resume_hint(fresh, overwrite)}"
        )
        raise typer.Exit(130)
    if error is not None:
        row = study.cheapest(error, quantity)
        commands = answer(row, quantity_index, scene, target, size, seed, changes, device, threads, plugins)
        print(f"cheapest with an error of at most {error:g}:\n{commands}")


def _plot(study: Study) -> Figure:
    from tisim.accuracy import plot

    return plot(study)


def answer(
    row: Row, quantity: int, scene: Scene, target: str, size: str | None, seed: int | None,
    changes: Sequence[str] | None, device: str, threads: int, plugins: Sequence[str] | None,
) -> str:  # fmt: skip
    """Return the commands that run a row of the study of a scene, from the options given to this command."""
    from tisim.accuracy.report import recipe
    from tisim.accuracy.scene_changes import options

    tokens = shlex.split(row.options)
    pairs = list(zip(tokens[::2], tokens[1::2], strict=True))
    absent, settings = ([value for key, value in pairs if key == name] for name in ("--without", "--set"))
    measured_scene = scene.without(*absent).replace(scene_arguments.assignments(settings))
    # Stepper, effects and materials as measured, including changes from --set; all else as given.
    _, base = scene_arguments.load_scene(target, size, seed)
    arguments = [target, *_run_options(size, seed, changes, device, threads, plugins)]
    arguments += options(base, measured_scene, row.precision, row.arithmetic)
    return recipe(row, arguments, quantity)


def _run_options(
    size: str | None, seed: int | None, changes: Sequence[str] | None,
    device: str, threads: int, plugins: Sequence[str] | None,
) -> Iterator[str]:  # fmt: skip
    """Yield the options of this command that ``tisim run`` also needs, except those of stepper, effects and
    materials."""
    for name, value, default in (
        ("--size", size, None), ("--seed", seed, None),
        ("--device", device, "cpu"), ("--threads", threads, 0),
    ):  # fmt: skip
        if value != default:
            yield from (name, str(value))
    for change in changes or ():
        if change.partition("=")[0].strip().partition(".")[0] not in ("stepper", "effects", "materials"):
            yield from ("--set", change)
    for plugin in plugins or ():
        yield from ("--plugin", plugin)


def _size(target: str) -> str | None:
    """Return the size of a case at which costs are measured by default; None for a scene file."""
    return None if target.endswith(".toml") else targets.case(target, targets.SCENE_FILE).cost_size


def _quantities(target: str, scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities that the case compares; none for a scene file."""
    quantities = None if target.endswith(".toml") else targets.case(target).quantities
    return quantities(scene) if quantities else ()


def _whole_numbers(text: str) -> tuple[int, ...]:
    parts = [part.strip() for part in text.split(",")]
    must(
        all(part.isdecimal() and len(part) < 10 for part in parts),
        "--starts",
        "whole numbers with commas between",
        text,
    )
    return tuple(map(int, parts))


def _measure(study: Study, out_folder: Path) -> bool:
    """Run a study, show its progress and store each row when it is complete; return False after Ctrl-C."""
    from tisim.accuracy import runner, storage
    from tisim.cli.cost_progress import CostProgress

    with CostProgress(study) as progress, Interrupt(print_stopping) as ctrl_c:

        def report(fraction: float, what: str) -> None:
            progress.running(fraction, what)
            ctrl_c.check()

        def store_rows() -> None:
            storage.write(study, out_folder)
            progress.finished()

        try:
            runner.run(study, report, store_rows)
        except KeyboardInterrupt:
            if ctrl_c.forced:
                raise
            return False
    return True
