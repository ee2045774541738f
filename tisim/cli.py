"""The command line. Thin: a command calls what a script would call, and prints it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from tisim import __version__, request, runtime
from tisim.errors import InputError, RunError
from tisim.simulation import Result, Simulation

app = typer.Typer(
    help="Clouds of interacting particles, and a genetic algorithm that designs them backwards.",
    no_args_is_help=True, pretty_exceptions_enable=False, add_completion=False, rich_markup_mode=None,
)  # fmt: skip

Target = Annotated[str, typer.Argument(metavar="CASE_OR_TOML", help="A case of 'tisim cases', or a scene file.")]
CaseName = Annotated[str, typer.Argument(metavar="CASE", help="A case of 'tisim cases'.")]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a setting of the scene, such as effects.impact.hardness=3e5. Repeatable."),
]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder to write to; out/NAME by default.")]
Seed = Annotated[int | None, typer.Option(help="Of all that is random.")]
Size = Annotated[str | None, typer.Option(help="Size of the case: small, default or paper.")]
Device = Annotated[str, typer.Option(help="cpu or cuda.")]
Precision = Annotated[str, typer.Option(help="f64 or f32.")]
Threads = Annotated[int, typer.Option(help="CPU threads; 0 for all cores.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace what an earlier run has left.")]


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Exit codes: 0 done; 1 a run or check failed; 2 wrong input, nothing was run; 130 stopped by Ctrl-C."""
    try:
        app(arguments, prog_name="tisim")
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    except RunError as error:
        print(error, file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    sys.exit(0)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False) -> None:
    if version:
        print(f"tisim {__version__} ({runtime.backend()})")
        raise typer.Exit


@app.command()
def run(
    target: Target, set_: Changes = None, out: Out = None, seed: Seed = None, size: Size = None,
    device: Device = "cpu", precision: Precision = "f64", threads: Threads = 0, overwrite: Overwrite = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from where Ctrl-C stopped the same run.")] = False,
) -> None:  # fmt: skip
    """Run a scene; write result.h5, scene.toml, versions.json and the picture cloud.png."""
    from tisim import checkpoint, output

    runtime.start(device, precision, threads)
    name, scene = request.scene(target, size, seed, set_ or ())
    folder = output.Folder(out or Path("out") / name)
    folder.check(overwrite, resume)
    simulation = Simulation(scene)
    simulation.load([scene])
    if resume:
        checkpoint.restore(simulation, folder.checkpoint)
    output.writable(folder.path)
    if not _advance(simulation, name):
        checkpoint.save(simulation, folder.checkpoint)
        _stderr().print(
            f"stopped at {simulation.fraction():.1%}; {folder.checkpoint} is written. "
            "To go on, give the same command with --resume."
        )
        raise typer.Exit(130)
    result = simulation.results()[0]
    paths = output.write(result, folder)
    _stdout().print(_summary(result, paths))
    if not result.status.ok:
        print(f"run failed {result.status.reason}", file=sys.stderr)
        raise typer.Exit(1)


def _advance(simulation: Simulation, name: str) -> bool:
    """Run to the end behind a bar; False when Ctrl-C has stopped it, between two steps."""
    from tisim.interrupt import Interrupt

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(),
               TextColumn("left"), TimeRemainingColumn())  # fmt: skip
    with Progress(*columns, console=_stderr()) as bar, Interrupt(_stopping) as ctrl_c:
        task = bar.add_task(name, total=1.0)

        def progress(fraction: float) -> None:
            bar.update(task, completed=fraction)
            ctrl_c.check()

        try:
            simulation.run(progress)
        except KeyboardInterrupt:
            if ctrl_c.forced:
                raise
            return False
    return True


def _summary(result: Result, paths: Sequence[Path]) -> Table:
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_row("status", "ok" if result.status.ok else "failed")
    table.add_row("time", f"{result.time:g} s of {result.scene.duration:g} s")
    table.add_row("particles", f"{len(result.start['mass'])} at the start, {len(result.state['mass'])} at the end")
    table.add_row("work", ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in result.work.items()))
    table.add_row("wall time", f"{result.wall_s:.2f} s")
    table.add_row("written", "\n".join(map(str, paths)))
    return table


@app.command()
def cases() -> None:
    """List the cases."""
    from cases.case import every

    table = Table(box=None, padding=(0, 2, 0, 0))
    for heading in ("case", "what it is", "sizes", "inverse problem", "source"):
        table.add_column(heading, overflow="fold")
    for case in every().values():
        sizes = "\n".join(f"{name}: {size.summary}" for name, size in case.sizes.items())
        table.add_row(case.name, case.title, sizes, ", ".join(case.variants) or "none", case.source)
    _stdout().print(table)


@app.command()
def explain(
    target: Target, set_: Changes = None, seed: Seed = None, size: Size = None,
    device: Device = "cpu", precision: Precision = "f64",
) -> None:  # fmt: skip
    """Say what a scene is made of - effects, memory, phases of a step - and what it leaves out."""
    from tisim.explain import explain, render

    runtime.start(device, precision)
    _, scene = request.scene(target, size, seed, set_ or ())
    _stdout().print(render(explain(scene)))


@app.command()
def check(
    case: CaseName, device: Device = "cpu", precision: Precision = "f64", threads: Threads = 0
) -> None:
    """Run a case's own checks; exit code 1 when one fails."""
    from cases.case import find

    runtime.start(device, precision, threads)
    table = Table(box=None, padding=(0, 2, 0, 0))
    for heading in ("check", "measured", "expected", "off by", "allowed", ""):
        table.add_column(heading, justify="left" if heading in ("check", "") else "right")
    failed = 0
    with _stderr().status("checking") as status:
        for item in find(case).check():
            failed += not item.ok
            table.add_row(
                item.name, f"{item.measured:.10g}", f"{item.expected:.10g}",
                f"{abs(item.measured - item.expected):.1e}", f"{item.bound:.1e}",
                "[green]pass" if item.ok else "[bold red]FAIL",
            )  # fmt: skip
            status.update(f"checked: {item.name}")
    _stdout().print(table)
    if failed:
        print(f"{failed} of {table.row_count} checks failed", file=sys.stderr)
        raise typer.Exit(1)


@app.command()
def doctor() -> None:
    """Say what this machine is to tisim, and what the other backend would give."""
    from tisim.doctor import findings

    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    with _stderr().status("measuring"):
        for finding in findings():
            table.add_row(finding.name, finding.value, finding.note)
    _stdout().print(table)


@app.command()
def optimize(
    case: CaseName, size: Size = None, out: Out = None, seed: Seed = None,
    variant: Annotated[str | None, typer.Option(help="Which inverse problem of the case; its first by default.")] = None,
    generations: Annotated[int | None, typer.Option(help="After the random start.")] = None,
    population: Annotated[int | None, typer.Option(help="Designs per generation.")] = None,
    target: Annotated[float | None, typer.Option(help="Stop at a fitness this low.")] = None,
    budget_evaluations: Annotated[int | None, typer.Option(help="Stop after so many runs.")] = None,
    budget_minutes: Annotated[float | None, typer.Option(help="Stop after so much time.")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="search.KEY=VALUE", help="Any setting of the search. Repeatable."),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume/--fresh", help="Go on with the folder's search, or begin a new one.")] = True,
    overwrite: Overwrite = False,
    device: Device = "cpu", precision: Precision = "f64", threads: Threads = 0,
) -> None:  # fmt: skip
    """Search for the best design of a case; all of it goes to search.h5, and running again goes on from there."""
    from optimize.session import Wishes, session

    runtime.start(device, precision, threads)
    wishes = Wishes(
        size=size or "default", variant=variant, fresh=not resume, overwrite=overwrite,
        search={"seed": seed, "generations": generations, "population": population, "target": target,
                "max_evaluations": budget_evaluations,
                "wall_clock_s": None if budget_minutes is None else 60 * budget_minutes},
        changes=request.assignments(set_ or ()),
    )  # fmt: skip
    raise typer.Exit(session(case, wishes, out, _stdout(), _stderr(), _stopping))
