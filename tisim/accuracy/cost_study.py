"""A cost study measures the error and the run time of many settings of a scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tisim import version
from tisim.accuracy.quantity import Quantity, usual
from tisim.accuracy.reference import Truth
from tisim.accuracy.row import Row, decades, tied
from tisim.accuracy.runner import Progress, StudyRunner
from tisim.backend import runtime
from tisim.errors import RunError, is_whole, must
from tisim.files import pictures
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from rich.console import RenderableType


class Study:
    """A study measures the run time and the error of the settings of a scene.

    quantities : quantities whose errors are measured; by default ``quantity.usual``.
    coarser, finer : decades of error to scan above and below the scene's own setting.
    repeats : number of times each setting is timed.
    precisions : "f64", and other precisions to try.
    arithmetics : "strict", and "fast" to try fast arithmetic in f64.
    starts : numbers of random starts (seeds) to try, for random quantities.
    budget : wall seconds of running, without compiling; settings that would exceed it are left out.
    limit : wall seconds, without compiling, after which the run of a setting is stopped; its row says so.
    require_reference : whether to raise RunError before any setting is run if the reference cannot tell
        settings apart.
    rows, truths : the results so far, in order; one truth for each quantity.
    complete : whether all settings are measured.

    To measure another precision or arithmetic, tisim is initialised again: simulations made before must not
    be used afterwards.
    """

    def __init__(
        self,
        scene: Scene,
        quantities: Sequence[Quantity] = (),
        *,
        coarser: int = 3,
        finer: int = 0,
        repeats: int = 3,
        precisions: Sequence[str] = ("f64", "f32"),
        arithmetics: Sequence[str] = ("strict",),
        starts: Sequence[int] = (8, 32, 128),
        budget: float = math.inf,
        limit: float = math.inf,
        require_reference: bool = False,
    ) -> None:
        must(isinstance(scene, Scene), "scene", "a Scene", scene)
        must(is_whole(repeats, 1), "repeats", "a whole number, at least 1", repeats)
        for name, decades_of_error in (("coarser", coarser), ("finer", finer)):
            must(is_whole(decades_of_error, -16), name, "a whole number of decades", decades_of_error)
        must(coarser + finer >= 0, "coarser + finer", "at least 0", coarser + finer)
        must(len(precisions) > 0 and precisions[0] == "f64", "precisions", "f64 and others", precisions)
        for precision in precisions:
            must(precision in runtime.PRECISIONS, "precision", "f64 or f32", precision)
        rule = "strict, or strict and fast"
        must(tuple(arithmetics) in (("strict",), runtime.ARITHMETICS), "arithmetics", rule, arithmetics)
        must(list(starts) == sorted(set(starts)), "starts", "given from few to many", list(starts))
        must(len(starts) > 0 and starts[0] > 1, "starts", "at least 2", list(starts))
        must(budget > 0, "budget", "greater than 0", budget)
        must(limit > 0, "limit", "greater than 0", limit)
        self.scene = scene
        self.quantities = tuple(quantities) or usual(scene)
        kinds = {quantity.random for quantity in self.quantities}
        names = [quantity.name for quantity in self.quantities]
        must(len(set(names)) == len(names), "quantities", "of different names", names)
        must(len(kinds) == 1, "quantities", "all random, or none", sorted(kinds))
        self.random = kinds == {True}
        self.levels = tuple(float(k) for k in range(coarser, -finer - 1, -1))
        self.repeats, self.precisions, self.arithmetics = repeats, tuple(precisions), tuple(arithmetics)
        self.budget, self.limit, self.require_reference = budget, limit, require_reference
        self.starts = tuple(starts) if self.random else (1,)
        self.rows: list[Row] = []
        self.truths: tuple[Truth, ...] = ()
        self.complete = False

    def __repr__(self) -> str:
        names = ", ".join(quantity.name for quantity in self.quantities)
        state = "complete" if self.complete else "not complete"
        return f"Study({self.scene.name!r}: {names}; {len(self.rows)} rows, {state})"

    @property
    def numbers(self) -> list[tuple[str, str]]:
        """The (precision, arithmetic) pairs to try; other arithmetics are tried in f64 only."""
        return [(p, "strict") for p in self.precisions] + [("f64", a) for a in self.arithmetics[1:]]

    def sweep_settings(self) -> dict[str, Any]:
        """Return the choices that determine the measured settings; a study is complete for these only."""
        return {"levels": self.levels, "precisions": self.precisions, "arithmetics": self.arithmetics}

    def identity(self) -> dict[str, Any]:
        """Return the properties that must be equal for the rows of an earlier study to be reused."""
        return {
            "tisim": version.__version__,
            "scene": self.scene.digest(),
            "quantities": [quantity.name for quantity in self.quantities],
            "finest": self.levels[-1],
            "starts": list(self.starts),
            "device": runtime.current().device,
            "threads": runtime.current().threads,
            "backend": runtime.backend(),
        }

    def run(self, progress: Progress | None = None, finished: Callable[[], object] | None = None) -> None:
        """Measure all missing rows. finished : called after each new row, and after the truths.

        InputError if the scene cannot be run or has no setting to vary. If an error is raised, finished rows
        are kept. Other threads that call ``tisim.run`` wait until the study ends.
        """
        if self.complete:
            return
        with runtime.turn:
            before = runtime.current()
            try:
                StudyRunner(self, progress or (lambda fraction, what: None), finished or (lambda: None)).run()
            finally:
                runtime.init(before.device, before.precision, before.threads, before.arithmetic)

    def cheapest(self, error: float, quantity: str | None = None) -> Row:
        """Return the cheapest setting whose error in a quantity (by default the first) is at most ``error``.
        Among settings with indistinguishable timings, the one with the least work is returned.

        RunError, naming the smallest error reached, if no setting is accurate enough.
        """
        k = self.index(quantity)
        if best := tied(self.rows, error, k):
            return best[0]
        name = f"error of {self.quantities[k].name}"
        measured = [row for row in self.rows if row.errors]
        if not measured:
            failed = next((f": {row.failed}" for row in self.rows if row.failed), "")
            raise RunError(f"{name} must be of a setting that was measured; there is none{failed}")
        least = min(measured, key=lambda row: row.at_most(k))
        finer = "more starts go further" if self.random else "finer settings go further"
        raise RunError(
            f"{name} must be at least {least.at_most(k):.1e}, the least that was reached ({least.method}, "
            f"{least.setting}; {finer}); received {error:g}"
        )

    def decades(self, quantity: str | None = None) -> dict[float, list[Row]]:
        """Return, for each power of ten of the error, the settings with the shortest time within the timing
        uncertainty, the one with the least work first."""
        return decades(self.rows, self.index(quantity))

    def index(self, quantity: str | None) -> int:
        """Return the index of a quantity of the study by its name; 0 for None."""
        names = [q.name for q in self.quantities]
        must(quantity is None or quantity in names, "quantity", f"one of {', '.join(names)}", quantity)
        return names.index(quantity) if quantity is not None else 0

    def table(self) -> RenderableType:
        """Return a table of the time, work and errors of every setting, for printing with rich."""
        from tisim.accuracy.table import table

        return table(self)

    def write(self, folder: str | Path) -> list[Path]:
        """Write cost.csv and cost.h5 (see storage.py) into a folder, created if missing; return their
        paths."""
        from tisim.accuracy.storage import write

        return write(self, Path(folder))

    def picture(self, path: str | Path) -> Path:
        """Draw error against time, one line per method; the suffix, such as .png, gives the format."""
        from tisim.accuracy.plot import picture

        return pictures.write(Path(path), lambda: picture(self))

    def line(self, method: str) -> list[Row]:
        """Return the rows of a method, in the order of its settings."""
        return [row for row in self.rows if row.method == method]


def study(scene: Scene, quantities: Sequence[Quantity] = (), **settings: Any) -> Study:
    """Return a completed ``Study`` of a scene with these settings."""
    cost_study = Study(scene, quantities, **settings)
    cost_study.run()
    return cost_study
