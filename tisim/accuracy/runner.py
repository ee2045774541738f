"""The runs of a study, in their order, with timing.

Every method is run from its coarsest setting to its finest. All methods are run at one level before the next
level, and repeats are interleaved. Drifting machine speed, an exhausted budget and Ctrl-C therefore affect
all methods alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tisim.accuracy.cost_study import Row, Study
from tisim.accuracy.quantity import (
    Quantity,
    estimate,
    reference_runs,
    require_known,
    truth_by_reference,
    truth_in_closed_form,
)
from tisim.accuracy.scene_changes import expression, in_steps_of_at_most, options, shell_line
from tisim.accuracy.sweep import Setting, SettingSweep, ensembles, methods
from tisim.accuracy.timing import OBSERVATIONS, Limit, OutOfTime, ResultCallback, SimulationCache, Timed
from tisim.backend import runtime
from tisim.components.accuracy_parameter import three_digits
from tisim.console import progress_bar
from tisim.engine.result import Result
from tisim.errors import InputError, RunError, must
from tisim.scene.scene import Scene

Progress = Callable[[float, str], None]
"""Called with the fraction of the study that is done, 0..1, and a description of the current run."""
DESCRIPTION_LENGTH = 48
"""Number of characters of the description of a run that a progress bar shows."""
REFERENCE_SEED_OFFSET = 1_000_000
"""Offset between the seeds of a random quantity's reference and of its rows, so that no start is shared."""
REFERENCE_STARTS = 4
"""The reference of a random quantity has this many times the largest number of starts; its confidence
interval is half as wide."""


def study(scene: Scene, quantities: Sequence[Quantity] = (), **settings: Any) -> Study:
    """Return a completed ``Study`` of a scene with these settings."""
    cost_study = Study(scene, quantities, **settings)
    run(cost_study)
    return cost_study


def run(
    study: Study, progress: Progress | bool | None = None, finished: Callable[[], object] | None = None
) -> None:
    """Measure all missing rows of a study.

    progress : called with the fraction of the study that is done, 0..1, and a description of the current run;
    True shows a progress bar, on a terminal or in a notebook.
    finished : called after each new row, and after the truths.

    InputError if the scene cannot be run or has no setting to vary. If an error is raised, finished rows are
    kept. Other threads that call ``tisim.run`` wait until the study ends. To measure another precision or
    arithmetic, tisim is initialised again: simulations made before must not be used afterwards.
    """
    if study.complete:
        return
    if progress is True:
        with progress_bar("{task.description}") as bar:
            task = bar.add_task("", total=1.0)

            def shown(fraction: float, what: str) -> None:
                bar.update(task, completed=fraction, description=what[:DESCRIPTION_LENGTH])

            return run(study, shown, finished)
    with runtime.turn:
        before = runtime.current()
        try:
            StudyRunner(study, progress or (lambda fraction, what: None), finished or (lambda: None)).run()
        finally:
            runtime.init(before.device, before.precision, before.threads, before.arithmetic)


@dataclass
class Trial:
    """A setting that is being run: the k-th of its method.

    cost : planned wall seconds of a repeat.
    runs : repeats so far.
    failed : the reason for not running it again.
    stopped_after : the time limit at which it was stopped (s), if it was.
    left_out : whether it does not fit the budget.
    in_rows : whether its row was added to the study.
    """

    method: SettingSweep
    k: int
    cost: float
    runs: list[Timed] = field(default_factory=list)
    failed: str = ""
    stopped_after: tuple[float, ...] = ()
    left_out: bool = False
    in_rows: bool = False

    @property
    def setting(self) -> Setting:
        """The setting."""
        return self.method.settings[self.k]

    def row(self, study: Study) -> Row:
        """Return its row: time and errors, or the reason for failure."""
        setting = self.setting
        steps, sums, rejections = math.nan, math.nan, math.nan
        errors: tuple[tuple[float, float], ...] = ()
        if not self.failed:
            steps, sums, rejections = self.runs[0].work
            errors = tuple(
                estimate(q, self.runs[0].results).error(truth.estimate, truth.size)
                for q, truth in zip(study.quantities, study.truths, strict=True)
            )
        laws = [effect for effect in setting.scene.effects if effect not in study.scene.effects]
        softer = [m for name, m in setting.scene.materials.items() if m != study.scene.materials[name]]
        return Row(
            method=self.method.name,
            setting=setting.description,
            python="; ".join(expression(part) for part in (setting.scene.stepper, *laws, *softer)),
            options=shell_line(options(study.scene, setting.scene, setting.precision, setting.arithmetic)),
            precision=setting.precision,
            arithmetic=setting.arithmetic,
            starts=setting.starts,
            seconds=self.stopped_after if self.failed else tuple(run.seconds for run in self.runs),
            steps=steps,
            sums=sums,
            rejections=rejections,
            errors=errors,
            failed=self.failed,
        )


class StudyRunner:
    """Measures the missing rows and truths of a study, and stores them in it.

    progress : called with the fraction that is done and a description of the current run.
    finished : called after each new row, and after the truths.
    """

    def __init__(self, study: Study, progress: Progress, finished: Callable[[], object]) -> None:
        self.study, self.progress, self.finished = study, progress, finished
        self.simulations, self.spent = SimulationCache(), 0.0
        self.done, self.planned, self.what = 0.0, 1.0, "the scene as it is"

    def run(self) -> None:
        """Run the scene unchanged, then the reference, then every setting without a row."""
        study = self.study
        where = runtime.current()
        runtime.init(where.device, "f64", where.threads)
        base = self._run([study.scene], 0.0)
        sweeps = self._methods(base)
        self.base = base.seconds
        must(
            bool(sweeps),
            "scene",
            "one with a setting that trades accuracy for time",
            study.scene.stepper.kind(),
        )
        rounds = max(len(method.settings) for method in sweeps)
        measured = {row.key for row in study.rows}
        plan = [
            [
                (m, k)
                for m in sweeps
                if k < len(m.settings) and (m.name, m.settings[k].description) not in measured
            ]
            for k in range(rounds)
        ]
        rest = sum(self._cost(m, k) for items in plan for m, k in items)
        self._truths(base, sweeps, rest)
        if study.require_reference:
            for quantity, truth in zip(study.quantities, study.truths, strict=True):
                require_known(quantity, truth)
        for precision, arithmetic in study.numbers:
            now = runtime.current()
            if (now.precision, now.arithmetic) != (precision, arithmetic):
                self.simulations.close()
                runtime.init(where.device, precision, where.threads, arithmetic)
            for items in plan:
                self._round([(m, k) for m, k in items if m.settings[k].numbers == (precision, arithmetic)])
        self._compare_laws(sweeps)
        measured = {row.key for row in study.rows}
        study.complete = all(
            (m.name, setting.description) in measured for m in sweeps for setting in m.settings
        )
        self.simulations.close()

    def _methods(self, base: Timed) -> list[SettingSweep]:
        study, result = self.study, base.results[0]
        ends = (result.start["position"], result.state["position"])
        extent = max(float(np.linalg.norm(r.max(axis=0) - r.min(axis=0))) for r in ends)
        dt = three_digits(study.scene.duration / max(base.work[0], 1.0))
        sweeps = methods(study.scene, dt, extent, study.levels, study.numbers, study.starts[-1])
        return [ensembles(study.scene, study.starts), *sweeps] if study.random else sweeps

    def _cost(self, method: SettingSweep, k: int) -> float:
        """Return an estimate of the seconds that all repeats of the k-th setting of a method take, based on
        another setting of the method if one was timed."""
        weights, repeats = method.weights, self.study.repeats
        most = repeats * self.study.limit
        guesses = dict(zip((setting.description for setting in method.settings), weights, strict=True))
        for row in self.study.line(method.name):
            if row.seconds and row.setting in guesses:
                return min(repeats * row.median * weights[k] / guesses[row.setting], most)
        weight = weights[k] if method.accuracy_parameter else 1.0
        return min(repeats * self.base * method.settings[k].starts * weight, most)

    def _largest(self) -> list[float]:
        """Return the largest size of each quantity during a run with steps short enough for all observations;
        0 if no quantity needs it."""
        largest = [0.0 for _ in self.study.quantities]

        def update_largest(result: Result) -> None:
            for k, q in enumerate(self.study.quantities):
                largest[k] = max(largest[k], q.size(result))

        if any(q.returns for q in self.study.quantities):
            self.what = "the size of the motion"
            often = in_steps_of_at_most(self.study.scene, self.study.scene.duration / OBSERVATIONS)
            self._run([often], self.base, on_result=update_largest)
        return largest

    def _truths(self, base: Timed, sweeps: Sequence[SettingSweep], rest: float) -> None:
        """Find the true values unless they are known. rest : planned seconds of all other runs."""
        study, self.planned = self.study, rest
        if study.truths:
            return
        runs, references = [], []
        if any(quantity.exact is None for quantity in study.quantities):
            references = reference_runs(sweeps, study.levels[-1])
            n = REFERENCE_STARTS * study.starts[-1] if study.random else 1
            costs = [n * self.base * 10.0 ** (-a.decades / a.method.base.stepper.order) for a in references]
            self.planned += sum(costs)
            if sum(costs) > self._left():
                reason = (
                    f"the reference takes about {sum(costs):.2g} s of running, more than the budget has left"
                )
                raise RunError(f"{reason}, {max(self._left(), 0.0):.2g} s")
            for attempt, cost in zip(references, costs, strict=True):
                self.what = f"{'reference' if attempt is references[0] else 'its check'}: {attempt.name}"
                try:
                    starts = self._starts(attempt.scene, n, REFERENCE_SEED_OFFSET)
                    runs.append(self._run(starts, cost, self._left()).results)
                except RunError as error:
                    raise RunError(f"the {self.what}: {error}") from None
                except OutOfTime:
                    raise RunError(f"the {self.what}: takes longer than the budget allows") from None
        largest = self._largest()
        study.truths = tuple(
            truth_by_reference(q, runs, references, most)
            if q.exact is None
            else truth_in_closed_form(q, base.results[0], most)
            for q, most in zip(study.quantities, largest, strict=True)
        )
        self.finished()

    def _starts(self, scene: Scene, n: int, first: int = 0) -> list[Scene]:
        seed = scene.seed + first
        return (
            [scene.model_copy(update={"seed": seed + k}) for k in range(n)] if self.study.random else [scene]
        )

    def _round(self, items: Sequence[tuple[SettingSweep, int]]) -> None:
        """Run the settings of one level with interleaved repeats; add the row of each after its last
        repeat."""
        repeats = self.study.repeats
        trials = [Trial(method, k, self._cost(method, k) / repeats) for method, k in items]
        try:
            for repeat in range(repeats):
                for trial in trials:
                    trial.left_out |= repeat == 0 and self._left() < trial.cost * repeats
                    self._repeat(trial)
                    if repeat == repeats - 1:
                        self._row(trial)
        finally:
            # If the round is stopped, the finished measurements are kept.
            for trial in trials:
                self._row(trial)

    def _repeat(self, trial: Trial) -> None:
        """Run a setting once more, unless it has failed or would exceed the budget."""
        self.what = f"{trial.method.name}, {trial.setting.description}"
        if trial.failed or trial.left_out:
            self.done += trial.cost
            return
        left, limit = self._left(), self.study.limit
        try:
            scenes = self._starts(trial.setting.scene, trial.setting.starts)
            trial.runs.append(self._run(scenes, trial.cost, min(left, limit)))
        except OutOfTime:
            self.done += trial.cost
            if limit <= left and not trial.runs:
                trial.failed, trial.stopped_after = f"over the limit of {limit:g} s", (limit,)
        except (RunError, InputError) as error:
            trial.failed = str(error)

    def _compare_laws(self, sweeps: Sequence[SettingSweep]) -> None:
        """Mark the rows of cheaper laws that have the same errors as the law they approximate."""
        rows = {row.key: row for row in self.study.rows}
        stands_for = {(m.name, s.description): m.exact for m in sweeps for s in m.settings if m.exact}
        self.study.rows[:] = [
            replace(row, same=row.same_errors(rows.get(stands_for.get(row.key, row.key), row)))
            for row in self.study.rows
        ]
        self.finished()

    def _left(self) -> float:
        """Return the remaining seconds of the budget, which does not include compiling."""
        return self.study.budget - self.spent

    def _run(
        self,
        scenes: Sequence[Scene],
        cost: float,
        limit: float = math.inf,
        on_result: ResultCallback | None = None,
    ) -> Timed:
        """Run and time scenes; ``cost`` is the planned time, s; OutOfTime after ``limit`` (s)."""
        done_before = self.done
        if limit <= 0.0:
            raise OutOfTime

        def report_progress(fraction: float) -> None:
            self.progress(min((done_before + cost * fraction) / self.planned, 1.0), self.what)

        report_progress(0.0)
        clock = Limit(limit, report_progress)
        try:
            timed = self.simulations.run(scenes, clock, on_result)
        finally:
            self.spent += clock.spent
        self.done = done_before + cost
        return timed

    def _row(self, trial: Trial) -> None:
        """Add the row of a setting that has been run, unless it was already added."""
        if not trial.in_rows and (trial.runs or trial.failed):
            trial.in_rows = True
            self.study.rows.append(trial.row(self.study))
            self.finished()
