"""A session runs a search in a folder: it locks the folder, shows progress, handles Ctrl-C and writes the
results."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from tisim.backend import runtime
from tisim.console import err, print_stopping
from tisim.console import out as standard_output
from tisim.errors import must
from tisim.files import output_folder, pictures
from tisim.files.atomic import replace_file
from tisim.files.output_folder import claim
from tisim.interrupt import Interrupt
from tisim.optimize.beginning import NOTHING, Beginning
from tisim.optimize.designs_csv import Given
from tisim.optimize.evaluation.executors import evaluator_for
from tisim.optimize.evaluation.runs import Evaluator, start_seed
from tisim.optimize.methods.individual import Individual
from tisim.optimize.outcome import Outcome, Progress
from tisim.optimize.problem.problem import Problem
from tisim.optimize.report import report
from tisim.optimize.report.analysis import Analysis
from tisim.optimize.report.display import Display
from tisim.optimize.search import search
from tisim.optimize.search_folder import (
    SEARCH_FILE,
    SEARCH_FILES,
    SHOWN_FILE,
    check,
    check_problem,
    results_of,
)
from tisim.optimize.search_records import store_command
from tisim.optimize.settings import Settings, fit, identity, proposed, search_name
from tisim.optimize.storage.cache import Cache
from tisim.optimize.warm_start import warmed


def run(
    problem: Problem,
    *,
    out: str | Path | None = None,
    executor: str = "batch",
    verbose: bool = False,
    starting_designs: Given | None = None,
    experiments: Given | None = None,
    warm_start: bool = False,
    **settings: Any,
) -> Outcome:
    """Search for the best design of a problem, or the front of several objectives.

    out : folder for the files that ``tisim optimize`` writes; running again with the same folder resumes an
        interrupted search. Without a folder, only the returned outcome is kept.
    executor : "batch" (this process), "processes:N" or "dask://HOST:PORT".
    verbose : show tables and a progress bar on the terminal.
    starting_designs : designs that are run before generation 0, with every method: a CSV file with a column
        for each gene, such as best.csv, or dictionaries by gene name.
    experiments : the same, with measured values of each design, and standard errors if known; the method
        learns from them and does not run them (optimize.experiments).
    warm_start : learn from all runs of other searches of the problem in the folder, and run the best of their
        designs first.
    settings : fields of Settings, such as ``generations=10``, ``seed=1``, ``options={"population": 12}``,
        ``ensemble={"max_starts": 8}``.

    Device, precision and arithmetic are set by ``tisim.init``. Ctrl-C ends the search and is reported in
    ``Outcome.stopped``. Other threads that call ``tisim.run``, or ``tisim.init`` with other settings, wait
    until a search in this process has ended. InputError for invalid settings, before anything runs.
    """
    search_settings = Settings(**proposed(problem, settings, settings.get("method")))
    beginning = Beginning.of(problem, starting_designs, experiments, warm_start)
    must(not warm_start or out is not None, "warm_start", "given with a folder, out", warm_start)
    fit(problem, search_settings, beginning)
    with ExitStack() as stack:
        evaluator = _evaluator(problem, executor, stack)
        if out is not None:
            say, bar = (standard_output(), err()) if verbose else (Console(quiet=True), Console(quiet=True))
            return session(
                problem, search_settings, evaluator, Path(out), say, bar, print_stopping, beginning=beginning
            )
        with tempfile.TemporaryDirectory() as folder, Cache(Path(folder) / SEARCH_FILE) as cache:
            return _search_with_display(
                problem,
                search_settings,
                beginning,
                evaluator,
                cache,
                err() if verbose else Console(quiet=True),
                print_stopping,
            )


def _evaluator(problem: Problem, executor: str, stack: ExitStack) -> Evaluator:
    """Return the named evaluator with the settings of ``tisim.init``, which a plain function does not need.

    The stack closes the evaluator, and until then reserves the runtime of this process for it.
    """
    if problem.function is not None:
        return stack.enter_context(closing(evaluator_for(problem, executor)))
    in_this_process = executor == "batch"
    if in_this_process:
        stack.enter_context(runtime.turn)
    now = runtime.current()
    threads = now.threads if in_this_process else 0
    settings = now.device, now.precision, threads, now.arithmetic
    return stack.enter_context(closing(evaluator_for(problem, executor, *settings)))


def session(
    problem: Problem,
    settings: Settings,
    evaluator: Evaluator,
    folder: Path,
    say: Console,
    bar: Console,
    stopping: Callable[[], None],
    overwrite: bool = False,
    begun: bool = False,
    beginning: Beginning = NOTHING,
    command: Sequence[str] = (),
) -> Outcome:
    """Start or resume a search in the folder, and write the files listed in optimize.search_folder.

    say : console for lines and tables; bar : console for the progress bar.
    stopping : called on Ctrl-C, which ends the search cleanly (Outcome.interrupted).
    overwrite : replace files of other origin that have the same names.
    begun : refuse a search that has not begun in the folder.
    command : the words of the command that is given, which are stored.

    InputError if the folder contains searches of another problem or files of other origin, or cannot be
    written. Meanwhile other processes may join the search, or run other searches of the problem, but not
    clear the folder.
    """
    claim(folder, SEARCH_FILES, overwrite)
    with output_folder.lock(folder, exclusive=False):
        with Cache(folder / SEARCH_FILE) as cache:
            check_problem(folder, "search", cache, identity(problem, settings, evaluator.settings))
            beginning = warmed(cache, problem, settings, evaluator.settings, beginning)
            requested = identity(problem, settings, evaluator.settings, beginning)
            known = check(folder, cache, requested, begun)
            if known or len(cache):
                what = "going on with" if known else "another search in"
                bar.print(f"{what} {folder / SEARCH_FILE}, which has {len(cache)} runs", highlight=False)
            if beginning.warm is not None:
                bar.print(f"a warm start from {len(beginning.warm)} designs", highlight=False)
            store_command(cache, search_name(requested), command)
            outcome = _search_with_display(problem, settings, beginning, evaluator, cache, bar, stopping)
        paths = [folder / SEARCH_FILE]
        if outcome.best is not None:
            paths += _write_results(outcome, outcome.best, evaluator, folder, say)
    say.print("written  " + "\n         ".join(map(str, paths)), highlight=False, markup=False)
    return outcome


def _write_results(
    outcome: Outcome, best: Individual, evaluator: Evaluator, folder: Path, say: Console
) -> list[Path]:
    """Print the results of a search, and write its result files in place of earlier ones; return their
    paths."""
    problem = outcome.problem
    analysis = None if outcome.interrupted else Analysis.of(outcome)
    run = None if outcome.interrupted else _BestRun.of(best, outcome, evaluator)
    say.print(report.best_table(outcome))
    say.print(report.notes(outcome))
    if problem.met_at is not None:
        say.print(report.met_table(outcome))
    with results_of(folder, outcome.name):
        paths = [folder / SHOWN_FILE, *report.write(outcome, folder).values()]
        if analysis is not None:
            paths += analysis.write(folder)
            for table in analysis.tables():
                say.print(table)
        if run is not None:
            paths += run.write(problem, folder, say)
    return paths


def _search_with_display(
    problem: Problem,
    settings: Settings,
    beginning: Beginning,
    evaluator: Evaluator,
    cache: Cache,
    bar: Console,
    stopping: Callable[[], None],
) -> Outcome:
    """Run the search with a progress bar, until it ends or Ctrl-C stops it."""
    with Interrupt(stopping) as ctrl_c, Display(problem, settings, bar) as display:

        def step(progress: Progress) -> None:
            display.step(progress)
            ctrl_c.check()

        return search(
            problem, evaluator, cache, settings, beginning,
            on_generation=display.generation, on_progress=step,
        )  # fmt: skip


@dataclass(frozen=True)
class _BestRun:
    """The best design of a search, run once more from the first start for the report.

    result : None if the problem has neither ``picture`` nor ``details``.
    """

    design: dict[str, Any]
    scene: Any
    result: Any

    @classmethod
    def of(cls, best: Individual, outcome: Outcome, evaluator: Evaluator) -> _BestRun:
        """Return that run."""
        problem, settings = outcome.problem, outcome.settings
        design = problem.genome.decode(best)
        own = None if settings.ensemble.common_starts else design
        scene = problem.scene(design, start_seed(settings.seed, 0, own))
        if problem.picture is None and problem.details is None:
            return cls(design, scene, None)
        _, result = next(evaluator.evaluate([scene]))
        return cls(design, scene, result)

    def write(self, problem: Problem, folder: Path, say: Console) -> list[Path]:
        """Write its scene, picture and details; return the paths."""
        paths = []
        if problem.function is None:
            paths.append(folder / "best_scene.toml")
            replace_file(paths[-1], self.scene.to_toml().encode())
        if problem.details is not None:
            details = problem.details(self.design, self.result)
            paths.append(folder / "best_run.csv")
            replace_file(paths[-1], report.details_csv(details))
            say.print(report.details_table(details))
        if (draw := problem.picture) is not None:
            picture = folder / "best_cloud.png"
            paths += pictures.write_beside_data(picture, lambda: draw(self.scene, self.result))
        return paths
