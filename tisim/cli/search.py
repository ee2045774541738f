"""The commands of inverse design: ``tisim optimize``, ``tisim compare`` and ``tisim cache``."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tisim.cli import scene_arguments, targets
from tisim.cli.options import (
    Arithmetic,
    Device,
    Fresh,
    Out,
    Overwrite,
    Plugins,
    Precision,
    Seed,
    Size,
    Threads,
    given_words,
    nameable,
)
from tisim.console import err, out, print_stopping
from tisim.errors import RunError
from tisim.files.atomic import replace_file
from tisim.files.output_folder import resume_hint
from tisim.interrupt import Interrupt
from tisim.streams import say

if TYPE_CHECKING:
    from tisim.optimize.problem.problem import Problem

Executor = Annotated[
    str, typer.Option(help="Executor of the runs: batch (this process), processes:N or dask://HOST:PORT.")
]
Inverse = Annotated[
    str,
    typer.Argument(
        metavar="CASE_OR_FILE", help="A case of 'tisim cases', or your own NAME.py with a PROBLEM or a CASE."
    ),
]
Measurements = Annotated[
    Path | None,
    typer.Option(
        "--measured", metavar="FILE.csv", callback=nameable,
        help="Measurements to calibrate the case against, in place of its own.",
    ),
]  # fmt: skip
SearchChanges = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="search.KEY=VALUE", help="Change a setting of the search. Repeatable."),
]
StartingDesigns = Annotated[
    Path | None,
    typer.Option(
        "--start-from", metavar="FILE.csv", callback=nameable,
        help="Designs to run first: one column per gene, as in best.csv.",
    ),
]  # fmt: skip
Experiments = Annotated[
    Path | None,
    typer.Option(
        "--experiments", metavar="FILE.csv", callback=nameable,
        help="Designs with measured objectives, to learn from without running them.",
    ),
]  # fmt: skip
FixedGenes = Annotated[
    list[str] | None,
    typer.Option("--fix", metavar="GENE=VALUE", help="Fix a gene at a value within its range. Repeatable."),
]


def optimize(
    context: typer.Context,
    case: Inverse,
    size: Size = None,
    folder: Out = None,
    seed: Seed = None,
    variant: Annotated[
        str | None, typer.Option(help="Name of the inverse problem, for a case with several.")
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="genetic, gaussian-process, nsga2 or random; zohdi, restart or cma-es for one objective; "
            "or a method of a plugin."
        ),
    ] = None,
    generations: Annotated[
        int | None, typer.Option(help="Number of generations after the first, random one.")
    ] = None,
    population: Annotated[int | None, typer.Option(help="Designs per generation.")] = None,
    target: Annotated[
        float | None, typer.Option(help="Stop when the best value is as good as this; for one objective.")
    ] = None,
    budget_evaluations: Annotated[int | None, typer.Option(help="Stop after this number of runs.")] = None,
    budget_minutes: Annotated[float | None, typer.Option(help="Stop after this wall time.")] = None,
    start_from: StartingDesigns = None,
    experiments: Experiments = None,
    warm_start: Annotated[
        bool,
        typer.Option(
            "--warm-start", help="Learn from all runs in the folder, and run their best designs first."
        ),
    ] = False,
    measured: Measurements = None,
    fixed: FixedGenes = None,
    changes: SearchChanges = None,
    fresh: Fresh = None,
    overwrite: Overwrite = False,
    device: Device = "cpu",
    precision: Precision = "f64",
    arithmetic: Arithmetic = "strict",
    threads: Threads = 0,
    executor: Executor = "batch",
    plugins: Plugins = None,
) -> None:
    """Search for the best design of a case, or of your own problem.

    Your own problem is a Python file with a PROBLEM. All results are stored in search.h5. The same command,
    given again, resumes where it was stopped.
    """
    from tisim.optimize.beginning import Beginning
    from tisim.optimize.evaluation.executors import evaluator_for
    from tisim.optimize.search_folder import SEARCH_FILE, resume_or_clear
    from tisim.optimize.session import session
    from tisim.optimize.settings import Settings, fit, proposed, without_dependent_options

    problem, defaults = targets.inverse_problem(case, size, variant, measured)
    problem = problem.fix(**scene_arguments.assignments(fixed or (), "--fix"))
    options = {
        "seed": seed,
        "generations": generations,
        "options.population": population,
        "target": target,
        "max_evaluations": budget_evaluations,
        "wall_clock_s": None if budget_minutes is None else 60 * budget_minutes,
        **scene_arguments.table_changes("search", scene_arguments.assignments(changes or ())),
    }
    changed = {key: value for key, value in options.items() if value is not None}
    settings = Settings(
        **scene_arguments.with_changes(
            without_dependent_options(proposed(problem, defaults, method), changed), changed
        )
    )
    beginning = Beginning.of(problem, start_from, experiments, warm_start)
    fit(problem, settings, beginning)
    out_folder = folder or Path("out") / problem.name
    with closing(evaluator_for(problem, executor, device, precision, threads, arithmetic)) as evaluator:
        resume_or_clear(out_folder, fresh, overwrite)
        outcome = session(
            problem, settings, evaluator, out_folder, out(), err(), print_stopping, overwrite,
            begun=fresh is False, beginning=beginning,
            command=given_words(context, ("folder", "fresh", "overwrite", "executor", "threads")),
        )  # fmt: skip
    if outcome.interrupted:
        err().print(
            f"stopped; {out_folder / SEARCH_FILE} has all finished runs. {resume_hint(fresh, overwrite)}"
        )
        raise typer.Exit(130)
    if not outcome.logbook:
        hint = resume_hint(fresh, overwrite)
        raise RunError(f"the time limit was reached before the first generation. {hint}")
    if outcome.best is None:
        raise RunError(f"no design has run to its end; 'tisim cache {out_folder / SEARCH_FILE}' says why")


def problem_of(words: Sequence[str]) -> Problem:
    """Return the inverse problem of ``tisim optimize`` with these arguments and options; InputError if there
    is none."""
    command = typer.main.get_command(_optimize_alone)
    options = command.make_context("optimize", list(words), resilient_parsing=True).params
    problem, _ = targets.inverse_problem(
        options["case"], options["size"], options["variant"], options["measured"]
    )
    return problem.fix(**scene_arguments.assignments(options["fixed"] or (), "--fix"))


_optimize_alone = typer.Typer(add_completion=False)
_optimize_alone.command()(optimize)


def compare(
    case: Inverse,
    methods: Annotated[
        str, typer.Option(help="Method names, separated by commas.")
    ] = "random,zohdi,cma-es,genetic",
    evaluations: Annotated[int, typer.Option(help="Number of runs allowed for each search.")] = 400,
    repeats: Annotated[int, typer.Option(help="Number of searches with each method.")] = 5,
    fresh_starts: Annotated[
        int, typer.Option(help="Number of held-out random starts from which each best design is run again.")
    ] = 24,
    size: Size = None,
    folder: Out = None,
    variant: Annotated[
        str | None, typer.Option(help="Name of the inverse problem, for a case with several.")
    ] = None,
    measured: Measurements = None,
    fixed: FixedGenes = None,
    changes: SearchChanges = None,
    fresh: Fresh = None,
    overwrite: Overwrite = False,
    device: Device = "cpu",
    precision: Precision = "f64",
    arithmetic: Arithmetic = "strict",
    threads: Threads = 0,
    executor: Executor = "batch",
    plugins: Plugins = None,
) -> None:
    """Compare search methods at equal numbers of runs: by their best designs, or by the hypervolumes of their
    fronts for several objectives.

    The same command, given again, resumes where it was stopped; with other methods or numbers it reuses the
    runs.
    """
    from tisim.optimize.evaluation.executors import evaluator_for
    from tisim.optimize.report import comparison
    from tisim.optimize.settings import without_dependent_options
    from tisim.optimize.storage.cache import Cache

    problem, defaults = targets.inverse_problem(case, size, variant, measured)
    problem = problem.fix(**scene_arguments.assignments(fixed or (), "--fix"))
    changed = scene_arguments.table_changes("search", scene_arguments.assignments(changes or ()))
    base = scene_arguments.with_changes(without_dependent_options(defaults, changed), changed)
    names = [name.strip() for name in methods.split(",") if name.strip()]
    out_folder = folder or Path("out") / f"compare-{problem.name}"
    plan = comparison.plan(problem, base, names, evaluations, repeats, fresh_starts)
    results = []
    with (
        # Invalid arguments raise before anything in the folder is removed.
        closing(evaluator_for(problem, executor, device, precision, threads, arithmetic)) as evaluator,
        comparison.claim(out_folder, fresh, overwrite) as resume,
        Cache(out_folder / comparison.COMPARISON_FILE) as run_cache,
        Interrupt(print_stopping) as ctrl_c,
    ):
        comparison.check(out_folder, run_cache, problem, evaluator.settings)
        if resume:
            err().print(
                f"going on with {out_folder / comparison.COMPARISON_FILE}, which has {len(run_cache)} runs"
            )
        searches = comparison.compare(plan, evaluator, run_cache, lambda _: ctrl_c.check())
        try:
            for result in searches:
                results.append(result)
                line = f"{result.method}, search {result.repeat + 1} of {repeats}: "
                line += comparison.summary(problem, result)
                err().print(line, highlight=False, markup=False)
        except KeyboardInterrupt:
            message = f"stopped; {out_folder / comparison.COMPARISON_FILE} has all finished runs."
            err().print(f"{message} {resume_hint(fresh, overwrite)}")
            raise
    replace_file(out_folder / comparison.CSV, comparison.as_csv(problem, results))
    out().print(comparison.table(problem, results))
    out().print(f"written  {out_folder / comparison.CSV}", highlight=False, markup=False)


def cache(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="The search.h5 of a search.", callback=nameable)
    ],
    verify: Annotated[
        bool, typer.Option("--verify", help="Check every record; exit code 1 if any is damaged.")
    ] = False,
    compact: Annotated[bool, typer.Option("--compact", help="Drop damaged and duplicate records.")] = False,
) -> None:
    """List the runs stored by a search; verify or compact the file."""
    from tisim.optimize.report.cache_summary import summary
    from tisim.optimize.storage import maintenance

    if compact:
        print(f"{maintenance.compact(file)} evaluations kept")
    if verify:
        report = maintenance.verify(file)
        print(
            f"{report.rows} evaluations and {report.journal} in the journal; {len(report.damaged)} damaged, "
            f"{len(report.conflicts)} in conflict, {report.duplicates} double, {report.torn} bytes unfinished"
        )
        for damage in (*report.damaged, *(f"in conflict: {key}" for key in report.conflicts)):
            say(damage)
        if not report.ok:
            raise typer.Exit(1)
    if not (compact or verify):
        out().print(summary(file))
