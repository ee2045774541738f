"""The result of a run: how each world ended, its state, and the counts of its work."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

from tisim.data_frames import data_frame, vector_columns
from tisim.errors import RunError, RunWarning
from tisim.notebook import VIEWER_HEIGHT, ShownInNotebook, ViewerCell, named
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from pandas import DataFrame

RUNNING = "running"
"""The reason of a world that has not ended yet."""
RESULTS = ("state", "measures")
"""Reading these of a failed run gives a warning, unless its status has been read before."""


@dataclass(frozen=True)
class Status:
    """A status says how a world ended: ``ok`` if it reached its end; otherwise ``reason`` gives the time, the
    place and the cause of the failure."""

    ok: bool
    reason: str

    @property
    def failed(self) -> bool:
        """Return whether the world has failed; a running world has not."""
        return not self.ok and self.reason != RUNNING


@dataclass(frozen=True)
class Result(ShownInNotebook):
    """The result of the run of one scene.

    If the run failed, ``tisim.run`` gives a ``RunWarning`` when ``state`` or ``measures`` is read, or the
    result is dropped, before ``status`` has been read. ``check()`` raises an error instead, and returns the
    result of a successful run: ``tisim.run(scene).check().state``.

    state : arrays of the live particles by field name, SI; shape (n,) or (n, 3). After a failure, the state
    after the last good step. If particles do not interact and take implicit or Brownian steps of their own,
    the last good step of the particle that failed.
    start : the same arrays for the initial state, with ids numbered from 0 in the order of the arrays.
    time : time of ``state``, s.
    work : counts up to that time (steps, particle_steps, and the counters of the effects).
    measures : the world fields of the kind "measure" and the values of ``Effect.measures``, at the end.
    wall_s : wall time of the batch divided by its number of worlds, s. It excludes set-up, compilation and
    observers, and includes the search for last good steps.
    settings : precision, device and threads of the run. ``edited`` lists values written to
    ``Simulation.state`` during the run; the scene and ``start`` then do not describe the run completely.
    """

    shown_by = "tisim.report.cells:result_cell"
    scene: Scene
    state: Arrays
    start: Arrays
    time: float
    work: dict[str, int]
    status: Status
    wall_s: float
    settings: dict[str, str] = field(default_factory=dict)
    measures: dict[str, float] = field(default_factory=dict)

    def check(self) -> Self:
        """Return the result itself; raise RunError with the reason if the run has failed."""
        if self.status.failed:
            raise RunError(f"{self.scene.name}: {self.status.reason}")
        return self

    def view(self, height: int = VIEWER_HEIGHT, **options: Any) -> ViewerCell:
        """Return a viewer of the start and the end, which a notebook shows in the output of a cell.

        height : pixels. options : of ``tisim.report.view``, which shows whole trajectories too.
        """
        viewer: ViewerCell = named("tisim.report.view:view")(self, height, **options)
        return viewer

    def to_frame(self, *, start: bool = False) -> DataFrame:
        """Return the particles at the end as a pandas data frame, one row each.

        A vector has three columns, such as ``velocity_x``. ``frame.attrs["units"]`` has the unit of each
        column that has one. start : return the initial state instead.

        InputError if pandas is not installed.
        """
        from tisim.engine.assembly import units

        columns, unit_of = vector_columns(self.start if start else self.state, units(self.scene))
        return data_frame(columns, unit_of)

    def watched(self) -> Self:
        """Return the result itself, and from now on warn a user who does not read its status."""
        self.__dict__["_unread"] = True
        return self

    def __repr__(self) -> str:
        # Printing a result shows its status.
        n, status = len(self.start.get("mass", ())), self.status.reason
        return f"Result({self.scene.name!r}: {n} particles, {self.time:.6g} s, {status})"

    def __getstate__(self) -> dict[str, Any]:
        # The copy takes over the warning.
        own = dict(self.__dict__)
        self.__dict__["_unread"] = False
        return own

    def __getattribute__(self, name: str) -> Any:
        if name == "status":
            object.__getattribute__(self, "__dict__")["_unread"] = False
        elif name in RESULTS:
            object.__getattribute__(self, "_warn")(f"its {name} is that of the last good step")
        return object.__getattribute__(self, name)

    def __del__(self, at_exit: Callable[[], bool] = sys.is_finalizing) -> None:
        # At exit modules may be gone already.
        if not at_exit():
            self._warn("its result has been dropped")

    def _warn(self, what: str) -> None:
        """Warn once if the run has failed and its status has not been read."""
        own = object.__getattribute__(self, "__dict__")
        if own.get("_unread") and own["status"].failed:
            own["_unread"] = False
            told = "read result.status first, or call result.check(), which raises"
            text = f"the run of {own['scene'].name!r} failed, and {what} ({told}): {own['status'].reason}"
            warnings.warn(text, RunWarning, stacklevel=3)
