"""A search with all around it: its file, its display, Ctrl-C, and what it leaves in its folder.

search.h5         every evaluation, the settings, logbooks and best designs; all that is needed to go on
best.csv          the best designs, all digits
convergence.png   (and .pdf) best and mean fitness by generation
best_scene.toml   the best design from the first random start, for ``tisim run``
best_cloud.png    that run at start and end, where the problem says how to draw it
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from optimize import report
from optimize.breeding import Individual
from optimize.cache import Cache
from optimize.display import Display
from optimize.ensemble import start_seed
from optimize.evaluator import Evaluator
from optimize.outcome import Outcome, Progress
from optimize.problem import Problem
from optimize.search import search
from optimize.settings import Settings
from tisim.durable import locked
from tisim.errors import must
from tisim.interrupt import Interrupt
from tisim.output import writable

FILE = "search.h5"


def clear(folder: Path, overwrite: bool) -> None:
    """Make way for a new search; InputError when there is one already and it is not to be overwritten."""
    file = folder / FILE
    begun = file.exists() or file.with_name(FILE + ".journal").exists()
    must(overwrite or not begun, "--fresh", "given with --overwrite where there is a search", str(folder))
    # The lock file stays: without it two processes could lock two different files.
    if begun:
        with locked(folder / (FILE + ".lock"), exclusive=True):
            for name in (FILE, FILE + ".journal"):
                (folder / name).unlink(missing_ok=True)


def session(
    problem: Problem,
    settings: Settings,
    folder: Path,
    say: Console,
    bar: Console,
    stopping: Callable[[], None],
) -> Outcome:
    """Search, or go on with the search in the folder, and write all that is listed above.

    say : where lines and tables go; bar : where the progress bar goes. Ctrl-C calls ``stopping`` and ends the
    search cleanly (Outcome.interrupted). InputError when the folder cannot be written or holds another file.
    """
    writable(folder)
    evaluator = Evaluator()
    try:
        with (
            Cache(folder / FILE) as cache,
            Interrupt(stopping) as ctrl_c,
            Display(problem, settings.generations, bar) as display,
        ):

            def step(where: Progress) -> None:
                display.step(where)
                ctrl_c.check()

            outcome = search(
                problem, evaluator, cache, settings, on_generation=display.generation, on_progress=step
            )
        paths = [folder / FILE]
        if outcome.best is not None:
            say.print(report.best_table(outcome))
            paths += report.write(outcome, folder).values()
            if not outcome.interrupted:
                paths += _show_best(outcome.best, outcome, evaluator, folder)
    finally:
        evaluator.close()
    say.print("written  " + "\n         ".join(map(str, paths)), highlight=False)
    return outcome


def _show_best(best: Individual, outcome: Outcome, evaluator: Evaluator, folder: Path) -> list[Path]:
    """Run the best design once more, from the first start, for its picture."""
    problem = outcome.problem
    scene = problem.scene(problem.genome.decode(best), start_seed(outcome.settings.seed, 0))
    text = folder / "best_scene.toml"
    text.write_text(scene.to_toml(), encoding="utf-8")
    if problem.picture is None:
        return [text]
    _, result = next(evaluator.evaluate([scene]))
    image = folder / "best_cloud.png"
    problem.picture(scene, result).savefig(image, dpi=150)
    return [text, image]
