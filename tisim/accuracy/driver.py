"""The driver of a study.

Every method of the scene is run from its coarsest setting to its finest, all methods at one level before the
next and repeats in turns, so that a machine that drifts, a budget that ends and Ctrl-C treat all alike.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tisim import runtime
from tisim.accuracy import reference
from tisim.accuracy.bench import Bench, Limit, OutOfTime, Timed
from tisim.accuracy.methods import Method, Setting, ensembles, methods
from tisim.accuracy.quantity import estimate
from tisim.accuracy.row import Row
from tisim.accuracy.words import expression, options, pasted
from tisim.errors import InputError, RunError, must
from tisim.scene import Scene

if TYPE_CHECKING:
    from tisim.accuracy.study import Study

Progress = Callable[[float, str], None]
"""Called with the fraction of the study that is done, 0..1, and what is being run."""
OTHERS = 1_000_000
"""Between the seeds of a random quantity's reference and those of its rows: they share no start."""
REFERENCES = 4
"""Starts of the reference for each of the largest number that is tried: half as wide an interval."""


class Run:
    """One go at a study."""

    def __init__(self, study: Study, progress: Progress, finished: Callable[[], object]) -> None:
        self.study, self.progress, self.finished = study, progress, finished
        self.bench, self.began = Bench(), time.monotonic()
        self.done, self.planned, self.what = 0.0, 1.0, "the scene as it is"

    def all(self) -> None:
        study = self.study
        where = runtime.current()
        runtime.start(where.device, "f64", where.threads)
        base = self._run([study.scene], 0.0)
        found = self._methods(base)
        self.base = base.seconds
        must(bool(found), "scene", "one that has something to turn", study.scene.stepper.kind())
        rounds = max(len(method.settings) for method in found)
        known = {row.key for row in study.rows}
        plan = [
            [(m, k) for m in found if k < len(m.settings) and (m.name, m.settings[k].words) not in known]
            for k in range(rounds)
        ]
        self._truths(base, found, sum(self._cost(m, k) for items in plan for m, k in items))
        for precision in study.precisions:
            if runtime.current().precision != precision:
                self.bench.close()
                runtime.start(where.device, precision, where.threads)
            for items in plan:
                self._round([(m, k) for m, k in items if m.settings[k].precision == precision])
        known = {row.key for row in study.rows}
        study.complete = all((m.name, setting.words) in known for m in found for setting in m.settings)
        self.bench.close()

    def _methods(self, base: Timed) -> list[Method]:
        study, result = self.study, base.results[0]
        ends = (result.start["position"], result.state["position"])
        extent = max(float(np.linalg.norm(r.max(axis=0) - r.min(axis=0))) for r in ends)
        dt = float(f"{study.scene.duration / max(base.work[0], 1.0):.3g}")
        found = methods(study.scene, dt, extent, study.levels, study.precisions, study.starts[-1])
        return [ensembles(study.scene, study.starts), *found] if study.random else found

    def _cost(self, method: Method, k: int) -> float:
        """Guess of the seconds that a setting takes, all repeats, from another of its method if known."""
        weights, repeats = method.weights, self.study.repeats
        guesses = dict(zip((setting.words for setting in method.settings), weights, strict=True))
        for row in self.study.line(method.name):
            if row.seconds and row.setting in guesses:
                return repeats * row.median * weights[k] / guesses[row.setting]
        return repeats * self.base * method.settings[k].starts * (weights[k] if method.knob else 1.0)

    def _truths(self, base: Timed, found: Sequence[Method], rest: float) -> None:
        """The true values, where they are not known yet; ``rest``: seconds planned for all that follows."""
        study, self.planned = self.study, rest
        if study.truths:
            return
        runs, made = [], []
        if any(quantity.exact is None for quantity in study.quantities):
            made = reference.attempts(found, study.levels[-1])
            n = REFERENCES * study.starts[-1] if study.random else 1
            costs = [n * self.base * 10.0 ** (-a.decades / a.method.base.stepper.order) for a in made]
            self.planned += sum(costs)
            if sum(costs) > self._left():
                raise RunError(f"the reference takes about {sum(costs):.0f} s, which is more than the budget")
            for attempt, cost in zip(made, costs, strict=True):
                self.what = f"{'reference' if attempt is made[0] else 'its check'}: {attempt.name}"
                runs.append(self._run(self._starts(attempt.scene, n, OTHERS), cost).results)
        truths = []
        for q in study.quantities:
            if q.exact is None:
                truths.append(reference.compared(q, runs, made))
            else:
                truths.append(reference.closed_form(q, base.results[0]))
            must(bool(np.any(truths[-1].estimate.value)), q.name, "other than zero at the end", 0.0)
        study.truths = tuple(truths)
        self.finished()

    def _starts(self, scene: Scene, n: int, first: int = 0) -> list[Scene]:
        seed = scene.seed + first
        return (
            [scene.model_copy(update={"seed": seed + k}) for k in range(n)] if self.study.random else [scene]
        )

    def _round(self, items: Sequence[tuple[Method, int]]) -> None:
        """Settings of one level, repeats in turns; then their rows."""
        runs: dict[int, list[Timed]] = {at: [] for at in range(len(items))}
        failed: dict[int, str] = {}
        costs = [self._cost(method, k) for method, k in items]
        try:
            for repeat in range(self.study.repeats):
                for at, (method, k) in enumerate(items):
                    cost, setting = costs[at] / self.study.repeats, method.settings[k]
                    self.what = f"{method.name}, {setting.words}"
                    if at in failed or (repeat == 0 and self._left() < costs[at]):
                        self.done += cost
                        continue
                    try:
                        scenes = self._starts(setting.scene, setting.starts)
                        runs[at].append(self._run(scenes, cost, self._left()))
                    except OutOfTime:
                        self.done += cost
                    except (RunError, InputError) as error:
                        failed[at] = str(error)
        finally:
            # Also when it is stopped half-way: what is measured stays.
            for at, (method, k) in enumerate(items):
                if runs[at] or at in failed:
                    self._row(method, k, runs[at], failed.get(at, ""))

    def _left(self) -> float:
        return self.study.budget - (time.monotonic() - self.began)

    def _run(self, scenes: Sequence[Scene], cost: float, limit: float = math.inf) -> Timed:
        """Run and time; ``cost`` is what was planned for it, s; OutOfTime after ``limit`` (s)."""
        begun = self.done
        if limit <= 0.0:
            raise OutOfTime

        def watch(fraction: float) -> None:
            self.progress(min((begun + cost * fraction) / self.planned, 1.0), self.what)

        watch(0.0)
        timed = self.bench.run(scenes, Limit(limit, watch))
        self.done = begun + cost
        return timed

    def _row(self, method: Method, k: int, runs: Sequence[Timed], failed: str) -> None:
        study, setting = self.study, method.settings[k]
        row = Row(
            method.name, setting.words, self._python(setting),
            pasted(options(study.scene, setting.scene, setting.precision)),
            setting.precision, setting.starts, failed=failed,
        )  # fmt: skip
        if not failed:
            steps, sums, rejections = runs[0].work
            errors = tuple(
                estimate(q, runs[0].results).error(truth.estimate)
                for q, truth in zip(study.quantities, study.truths, strict=True)
            )
            row = replace(
                row, seconds=tuple(run.seconds for run in runs), steps=steps, sums=sums,
                rejections=rejections, errors=errors,
            )  # fmt: skip
        study.rows.append(row)
        self.finished()

    def _python(self, setting: Setting) -> str:
        laws = [e for e in setting.scene.effects if e not in self.study.scene.effects]
        return "; ".join(expression(part) for part in (setting.scene.stepper, *laws))
