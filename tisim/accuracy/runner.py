"""The runs of a study, in their order, with timing.

Every method is run from its coarsest setting to its finest. All methods are run at one level before the next
level, and repeats are interleaved. Drifting machine speed, an exhausted budget and Ctrl-C therefore affect
all methods alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tisim.accuracy import reference
from tisim.accuracy.scene_parts import in_steps_of_at_most
from tisim.accuracy.sweep import SettingSweep, ensembles, methods
from tisim.accuracy.timing import OBSERVATIONS, Limit, OutOfTime, ResultCallback, SimulationCache, Timed
from tisim.accuracy.trial import Trial
from tisim.backend import runtime
from tisim.components.accuracy_parameter import three_digits
from tisim.engine.result import Result
from tisim.errors import InputError, RunError, must
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from tisim.accuracy.cost_study import Study

Progress = Callable[[float, str], None]
"""Called with the fraction of the study that is done, 0..1, and a description of the current run."""
REFERENCE_SEED_OFFSET = 1_000_000
"""Offset between the seeds of a random quantity's reference and of its rows, so that no start is shared."""
REFERENCE_STARTS = 4
"""The reference of a random quantity has this many times the largest number of starts; its confidence
interval is half as wide."""


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
        must(bool(sweeps), "scene", "one with a setting to vary", study.scene.stepper.kind())
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
        self._check_truths()
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
            references = reference.attempts(sweeps, study.levels[-1])
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
                    raise RunError(f"the {self.what}: takes more running than the budget has") from None
        largest = self._largest()
        study.truths = tuple(
            reference.compared(q, runs, references, most)
            if q.exact is None
            else reference.closed_form(q, base.results[0], most)
            for q, most in zip(study.quantities, largest, strict=True)
        )
        self.finished()

    def _check_truths(self) -> None:
        """Raise RunError if ``require_reference`` is set and the truth of a quantity cannot tell settings
        apart."""
        for quantity, truth in zip(self.study.quantities, self.study.truths, strict=True):
            if self.study.require_reference and not reference.tells_apart(quantity, truth):
                rule = f"known by the reference to {reference.LARGEST_REFERENCE_ERROR:g} of the motion"
                raise RunError(
                    f"{quantity.name} must be {rule}; received {truth.error:.1g}: {reference.ADVICE}. "
                    "To go on: --anyway, or a Study with require_reference=False"
                )

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
