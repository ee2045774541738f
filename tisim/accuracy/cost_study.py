"""A cost study: the error and the run time of many settings of a scene, and the choice of the cheapest.

Timings that overlap within their uncertainty are treated as equal. Among such settings the one with the
fewest force evaluations, which is independent of the machine, is chosen, unless another setting is both
faster and more accurate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tisim import version
from tisim.accuracy.quantity import Quantity, Truth, usual
from tisim.backend import runtime
from tisim.data_frames import data_frame
from tisim.errors import RunError, is_whole, must
from tisim.notebook import ShownInNotebook
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from pandas import DataFrame

TRUSTED = 3.0
"""An error counts as known if it is at least this many times its uncertainty."""
TIMED_ONCE, TIMED_OFTEN = 0.15, 0.05
"""Relative uncertainty of a time that was measured once, and more than once."""
CLOCK_RESOLUTION = 1e-3
"""Smallest uncertainty of a time, s."""
ROUNDING = 1e-11
"""Two relative errors that differ by at most this are equal up to rounding; such laws give the same
result."""


@dataclass(frozen=True)
class Row:
    """A row of a study: the cost and the error of one setting.

    method : name of its sweep, which is one line in the picture.
    setting : description of the setting.
    python : stepper, and exchanged laws and materials, as Python.
    options : options of ``tisim run`` that produce the setting, as a shell line.
    starts : number of random starts of each run.
    seconds : wall seconds of each repeat; the limit if the run was stopped for taking too long.
    steps, sums, rejections : steps, force evaluations and rejected steps per particle, averaged over
        particles and starts.
    errors : for each quantity its relative error, and the uncertainty of that error.
    failed : the reason for a missing result, otherwise empty.
    same : whether this is a cheaper law that gives the same errors here as the law it approximates.
    """

    method: str
    setting: str
    python: str
    options: str
    precision: str
    starts: int
    seconds: tuple[float, ...] = ()
    steps: float = math.nan
    sums: float = math.nan
    rejections: float = math.nan
    errors: tuple[tuple[float, float], ...] = ()
    failed: str = ""
    same: bool = False
    arithmetic: str = "strict"

    @property
    def key(self) -> tuple[str, str]:
        """The method and the setting, which identify a row."""
        return self.method, self.setting

    @property
    def median(self) -> float:
        """The median of the wall seconds of all repeats, s; NaN if there are none."""
        return float(np.median(self.seconds)) if self.seconds else math.nan

    @property
    def spread(self) -> float:
        """The longest minus the shortest of the wall seconds of all repeats, s."""
        return max(self.seconds) - min(self.seconds) if self.seconds else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """The shortest and the longest plausible wall time of the setting, s: the measured range, widened by
        the uncertainty of timing."""
        uncertainty = max(
            CLOCK_RESOLUTION, (TIMED_OFTEN if len(self.seconds) > 1 else TIMED_ONCE) * self.median
        )
        return min(*self.seconds, self.median - uncertainty), max(*self.seconds, self.median + uncertainty)

    @property
    def stopped_after(self) -> float:
        """The time limit at which the run was stopped, wall seconds; infinite for all other rows."""
        return max(self.seconds) if self.failed and self.seconds else math.inf

    def same_errors(self, other: Row) -> bool:
        """Return whether another row has the same errors up to rounding."""
        if other is self or not (self.errors and other.errors):
            return False
        return all(abs(a[0] - b[0]) <= ROUNDING for a, b in zip(self.errors, other.errors, strict=True))

    def at_most(self, quantity: int = 0) -> float:
        """Return the relative error of a quantity plus its uncertainty; infinite if the run has failed."""
        return sum(self.errors[quantity]) if self.errors else math.inf

    def trusted(self, quantity: int = 0) -> bool:
        """Return whether the error of a quantity is well above its uncertainty."""
        return bool(self.errors) and self.errors[quantity][0] >= TRUSTED * self.errors[quantity][1]


def tied(rows: Iterable[Row], error: float, quantity: int = 0) -> list[Row]:
    """Return the fastest rows, within the timing uncertainty, among rows whose error of a quantity is at most
    ``error``. The first is the recommended one: of the rows that no other row beats in both time and error,
    it takes the least work."""
    good = [row for row in rows if row.at_most(quantity) <= error and not row.same]
    if not good:
        return []
    _, latest = min((row.interval for row in good), key=lambda interval: interval[1])
    fast = [row for row in good if row.interval[0] <= latest]

    def beaten(row: Row) -> bool:
        return any(
            other.median < row.median and other.at_most(quantity) < row.at_most(quantity) for other in good
        )

    return sorted(fast, key=lambda row: (beaten(row), row.sums * row.starts, row.median))


def decades(rows: Sequence[Row], quantity: int = 0) -> dict[float, list[Row]]:
    """Return ``tied`` for each power of ten of the error, from the largest error down to the smallest
    reached."""
    reached = [row.at_most(quantity) for row in rows if 0 < row.at_most(quantity) < math.inf]
    if not reached:
        return {}
    highest, lowest = math.ceil(math.log10(max(reached))), math.ceil(math.log10(min(reached)))
    by_error = {}
    for power in range(min(highest, 0), lowest - 1, -1):
        if best := tied(rows, 10.0**power, quantity):
            by_error[10.0**power] = best
    return by_error


class Study(ShownInNotebook):
    """The run time and the error of the settings of a scene, as far as ``run`` has measured them.

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
    """

    shown_by = "tisim.accuracy.report:study_cell"

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
        must(
            len(precisions) > 0 and precisions[0] == "f64",
            "precisions",
            "a list that begins with f64",
            precisions,
        )
        for precision in precisions:
            must(precision in runtime.PRECISIONS, "precision", "f64 or f32", precision)
        rule = "strict, or strict and fast"
        must(tuple(arithmetics) in (("strict",), runtime.ARITHMETICS), "arithmetics", rule, arithmetics)
        must(list(starts) == sorted(set(starts)), "starts", "in increasing order", list(starts))
        must(len(starts) > 0 and starts[0] > 1, "starts", "at least 2", list(starts))
        must(budget > 0, "budget", "greater than 0", budget)
        must(limit > 0, "limit", "greater than 0", limit)
        self.scene = scene
        self.quantities = tuple(quantities) or usual(scene)
        kinds = {quantity.random for quantity in self.quantities}
        names = [quantity.name for quantity in self.quantities]
        must(len(set(names)) == len(names), "quantities", "quantities with different names", names)
        must(len(kinds) == 1, "quantities", "all random or all deterministic", sorted(kinds))
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
            raise RunError(f"{name} must be measured; received no setting that ran{failed}")
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

    def to_frame(self) -> DataFrame:
        """Return the rows as a pandas data frame: method, setting, work, wall time and its spread, and the
        relative error of each quantity with its uncertainty.

        ``frame.attrs["units"]`` has the unit of each column that has one. InputError if pandas is not
        installed.
        """
        names = ("method", "setting", "precision", "arithmetic", "starts", "steps", "sums", "rejections")
        columns: dict[str, list[Any]] = {name: [getattr(row, name) for row in self.rows] for name in names}
        columns["seconds"] = [row.median for row in self.rows]
        columns["spread"] = [row.spread for row in self.rows]
        for k, quantity in enumerate(self.quantities):
            pairs = [row.errors[k] if row.errors else (math.nan, math.nan) for row in self.rows]
            columns[f"error of {quantity.name}"] = [error for error, _ in pairs]
            columns[f"uncertainty of {quantity.name}"] = [uncertainty for _, uncertainty in pairs]
        columns["failed"] = [row.failed for row in self.rows]
        return data_frame(columns, {"seconds": "s", "spread": "s"})

    def line(self, method: str) -> list[Row]:
        """Return the rows of a method, in the order of its settings."""
        return [row for row in self.rows if row.method == method]
