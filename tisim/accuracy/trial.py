"""A setting during its runs, and the row made from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tisim.accuracy.formatting import expression, options, shell_line
from tisim.accuracy.quantity import estimate
from tisim.accuracy.row import Row
from tisim.accuracy.sweep import Setting, SettingSweep
from tisim.accuracy.timing import Timed

if TYPE_CHECKING:
    from tisim.accuracy.cost_study import Study


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
