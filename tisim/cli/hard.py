"""The command ``tisim hard`` lists the hard cases, and measures whether their numbers stay within bounds."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from tisim.backend import runtime
from tisim.cli.check import VERDICTS
from tisim.cli.options import Device, Overwrite, Threads, nameable
from tisim.console import err, out, plain_table, progress_bar
from tisim.errors import RunError, must
from tisim.files import output_folder, pictures

if TYPE_CHECKING:
    from tisim.cases.hard.hard_case import HardCase
    from tisim.cases.hard.report import Finished

Names = Annotated[
    list[str] | None,
    typer.Argument(metavar="[NAME]...", help="Families and cases to run; without a name, list all."),
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        callback=nameable,
        help="Also write numbers and pictures to this folder.",
    ),
]
Whole = Annotated[bool, typer.Option("--all", help="Run all hard cases.")]


def hard(
    names: Names = None, everything: Whole = False, folder: Out = None,
    device: Device = "cpu", threads: Threads = 0, overwrite: Overwrite = False,
) -> None:  # fmt: skip
    """List the hard cases, or run some and print each number beside its bound; exit code 1 when one fails.

    With --out, also write the numbers as hard_cases.csv, .h5 and .md, and the pictures of the cases.
    """
    from tisim.cases.hard.hard_case import selected

    chosen = selected(names or ())
    must(not (names and everything), "--all", "given without names", names)
    if not names and not everything:
        must(folder is None, "--out", "given with names or --all", folder)
        _print_list(chosen)
        return
    runtime.init(device, threads=threads)
    if folder is None:
        finished = _run(chosen)
    else:
        from tisim.cases.hard import report

        drawn = {f"{case.name}.png": case.figure for case in chosen if case.figure}
        output_folder.claim(folder, (*report.HARD_FILES, *drawn), overwrite)
        with output_folder.lock(folder):
            finished = _run(chosen)
            paths = report.write(finished, folder)
            for name, draw in drawn.items():
                paths += pictures.write_beside_data(folder / name, draw)
        out().print("\n".join(map(str, paths)))
    outcomes = [outcome.ok for one in finished for outcome in one.outcomes]
    if not all(outcomes):
        raise RunError(f"{outcomes.count(False)} of {len(outcomes)} numbers are out of bounds")


def _print_list(cases: list[HardCase]) -> None:
    """Print each family with its cases: why they are hard, and the numbers that must hold."""
    from tisim.cases.hard.hard_case import title

    for family in dict.fromkeys(case.family for case in cases):
        out().print(Text.assemble((family, "bold"), f"  {title(family)}"))
        for case in cases:
            if case.family == family:
                out().print(Text(f"  {case.name}", "bold"))
                out().print(Text(f"    {case.difficulty}"))
                table = plain_table()
                for bound in case.bounds:
                    table.add_row(f"      {bound.quantity}", bound.allowed)
                out().print(table)
    print("'tisim hard NAME' runs a family or a case, and 'tisim hard --all' runs all.")


def _run(cases: list[HardCase]) -> list[Finished]:
    """Run cases with their progress on standard error, and print each when it has ended."""
    from tisim.cases.hard.report import Finished

    finished = []
    console = err()
    with progress_bar("", "{task.description}", console) as bar:
        bar.disable = not console.is_terminal
        task = bar.add_task("", total=len(cases))
        for case in cases:
            bar.update(task, description=case.name)
            began = time.process_time()
            one = Finished(case, case.run(), time.process_time() - began)
            finished.append(one)
            _print_outcomes(one)
            bar.advance(task)
    return finished


def _print_outcomes(one: Finished) -> None:
    out().print(Text.assemble((one.case.name, "bold"), f"  {one.case.difficulty}"))
    table = plain_table()
    for outcome in one.outcomes:
        table.add_row(
            f"  {outcome.bound.quantity}", outcome.measured, outcome.bound.allowed, VERDICTS[outcome.ok]
        )
    out().print(table)
