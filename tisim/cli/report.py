"""The command ``tisim report`` writes pages that show a run, a search or a study of costs in a browser."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tisim.backend import runtime
from tisim.cli import targets
from tisim.cli.inspect import Lines, World, case_pictures, case_spectra, print_missing, trajectory_file
from tisim.cli.options import Overwrite, Plugins, given_options, nameable
from tisim.console import err, shown_progress
from tisim.errors import InputError, must
from tisim.files import output_folder, pictures, regular_file
from tisim.streams import say

if TYPE_CHECKING:
    from tisim.optimize.problem.problem import Problem
    from tisim.optimize.report.search_data import SearchData

RUN_PAGE, SEARCH_PAGE, COST_PAGE = "a run", "a search", "a study of costs"
"""Kinds of pages."""
PAGE_OF = {"search.h5": SEARCH_PAGE, "cost.h5": COST_PAGE}
"""Kinds of pages that are not of a run, by the file from which they are made."""
OPTIONS_OF = {
    RUN_PAGE: {
        "world": "--world",
        "fields": "--field",
        "contacts": "--contacts",
        "checks": "--checks",
        "lines": "--lines",
    },
    SEARCH_PAGE: {"search": "--search", "designs": "--designs", "problem": "--problem"},
}  # fmt: skip
"""The options of ``tisim report`` that are for one kind of page alone, by the names of its parameters."""


def report(
    context: typer.Context,
    file: Annotated[
        Path,
        typer.Argument(
            help="The folder of a run, of a search or of 'tisim cost', or its trajectory.h5, result.h5, "
            "search.h5 or cost.h5.",
            metavar="FILE",
            callback=nameable,
        ),
    ],
    to: Annotated[
        Path | None,
        typer.Option(
            "--to",
            metavar="NAME.html",
            callback=nameable,
            help="File to write; report.html in the folder of FILE by default.",
        ),
    ] = None,
    limit: Annotated[
        float,
        typer.Option(metavar="MB", help="Largest size of the file; frames or designs are left out."),
    ] = 15.0,
    world: World = 0,
    fields: Annotated[
        list[str] | None,
        typer.Option(
            "--field",
            metavar="NAME",
            help="Of a run: a quantity of particles for colours; all by default. Repeatable.",
        ),
    ] = None,
    contacts: Annotated[
        bool, typer.Option("--contacts/--no-contacts", help="Of a run: store the contacts of grains.")
    ] = True,
    checks: Annotated[
        Path | None,
        typer.Option(
            "--checks",
            metavar="FILE.csv",
            callback=nameable,
            help="Of a run: checks that 'tisim check --out' has written.",
        ),
    ] = None,
    lines: Lines = None,
    search: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Of several searches in a folder: the name; by default the last that ended."
        ),
    ] = None,
    designs: Annotated[
        int,
        typer.Option(
            min=0, max=100, help="Of a search: run this number of its best designs, to show their particles."
        ),
    ] = 0,
    problem: Annotated[
        str | None,
        typer.Option(
            metavar="CASE_OR_FILE",
            help="Of a search: its problem, for --designs; by default the one of its command.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    plugins: Plugins = None,
) -> None:
    """Write a page that shows a run, a search or a study of costs.

    It is one HTML file, to open in a browser without a network. The page of a run shows the particles in
    three dimensions and in motion, the scene, time series and balances, and the pictures of the case. The
    page of a search shows its convergence, its front and all its designs; the page of a study shows errors
    against times.
    """
    must(
        regular_file.is_folder(file) or regular_file.exists(file),
        "FILE",
        "an existing folder or file",
        str(file),
    )
    kind, source = _kind(file)
    given = given_options(context)
    for of_kind, options in OPTIONS_OF.items():
        wrong = [option for name, option in options.items() if name in given and of_kind != kind]
        must(not wrong, "options", f"for the page of {kind}, as {file} holds one", ", ".join(wrong))
    path = to or source.parent / "report.html"
    must(path.suffix in (".html", ".htm"), "--to", "a file NAME.html", str(path))
    if kind == RUN_PAGE:
        _run(source, path, world, fields, limit, contacts, checks, lines, overwrite)
    elif kind == SEARCH_PAGE:
        _search(source, path, search, designs, problem, limit, overwrite)
    else:
        _study(source, path, limit, overwrite)
    print(path)


def _kind(path: Path) -> tuple[str, Path]:
    """Return the kind of a page, and the file from which it is made. InputError if a folder has none."""
    if not regular_file.is_folder(path):
        return PAGE_OF.get(path.name, RUN_PAGE), path
    run = ("trajectory.h5", "result.h5", "checkpoint.h5")
    if not any(regular_file.exists(path / name) for name in run):
        for name, kind in PAGE_OF.items():
            if any(regular_file.exists(path / one) for one in (name, f"{name}.journal")):
                return kind, path / name
        raise InputError(
            f"folder must be the folder of a run, a search or 'tisim cost'; received {str(path)!r}, without "
            f"their files"
        )
    return RUN_PAGE, trajectory_file(path)


def _run(
    file: Path, path: Path, world: int, fields: Sequence[str] | None, limit: float, contacts: bool,
    checks: Path | None, lines: str | None, overwrite: bool,
) -> None:  # fmt: skip
    from tisim.io.reader import frames
    from tisim.plotting.field_lines import check_lines
    from tisim.plotting.time_series import mark_missing
    from tisim.report.run_report import read_checks, run_report
    from tisim.report.viewer_data import ReportOptions

    with frames(file, world) as trajectory, pictures.drawing(f"pictures of {file}"):
        check_lines(trajectory.scene, lines)
        found = case_pictures(trajectory) if len(trajectory) > 1 else {}
        drawn = {
            name.removesuffix(".png").replace("_", " "): pictures.image(mark_missing(figure, trajectory))
            for name, figure in found.items()
        }
        spectra = case_spectra(trajectory) if len(trajectory) > 1 else ()
        print_missing(trajectory.missing)
    rows = read_checks(checks) if checks else ()
    options = ReportOptions(limit, fields or None, contacts, drawn, spectra, rows, lines)
    output_folder.claim(path.parent, (path.name,), overwrite)
    with err().status("writing"):
        run_report(file, path, world, options)


def _study(file: Path, path: Path, limit: float, overwrite: bool) -> None:
    from tisim.report.cost_report import cost_report

    output_folder.claim(path.parent, (path.name,), overwrite)
    cost_report(file, path, limit)


def _search(
    file: Path, path: Path, name: str | None, designs: int, target: str | None, limit: float, overwrite: bool
) -> None:
    from tisim.files.atomic import replace_file
    from tisim.optimize.report.recorded_designs import best_designs, check_problem, record, scenes
    from tisim.optimize.report.search_data import read_search
    from tisim.optimize.report.search_page import SearchPageOptions, search_html

    data = read_search(file, name)
    SearchPageOptions(limit)
    problem = _problem(data, designs > 0, target)
    texts: Mapping[int, str] = {}
    if problem is not None:
        check_problem(data, problem)
        count = max(designs, int(data.settings.get("hall_of_fame", 1)))
        if problem.function is None:
            shown = scenes(data, problem, best_designs(data, count))
            texts = {k: scene.to_toml() for k, scene in shown.items()}
    output_folder.claim(path.parent, (path.name,), overwrite)
    recorded = []
    if problem is not None and designs:
        evaluator = data.identity["evaluator"]
        runtime.init(
            evaluator.get("device", "cpu"), evaluator.get("precision", "f64"),
            arithmetic=evaluator.get("arithmetic", "strict"),
        )  # fmt: skip
        chosen = best_designs(data, designs)
        with shown_progress(f"running {len(chosen)} designs") as progress:
            recorded = record(data, problem, chosen, limit, progress)
    replace_file(path, search_html(data, SearchPageOptions(limit, texts, recorded)).encode())


def _problem(data: SearchData, needed: bool, target: str | None) -> Problem | None:
    """Return the problem of a search: the given one, or the one of its command.

    A file of the user is loaded only if it is ``needed``, as its code then runs.
    """
    from tisim.cli.search import problem_of

    words = list(data.command)
    if target is not None:
        words = ["optimize", target, *words[2:]]
    if not words:
        must(not needed, "--problem", "given for a search that was begun in Python", None)
        return None
    if not needed and targets.is_python_file(words[1]):
        return None
    try:
        return problem_of(words[1:])
    except InputError as error:
        if needed:
            raise
        command = shlex.join(["tisim", *words])
        say(f"the page has no scenes, as the problem of '{command}' is not found: {error}")
        return None
