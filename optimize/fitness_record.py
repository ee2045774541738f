"""A record of the objectives of some designs, so that a test can detect changes."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import tisim
from tisim.backend import runtime
from tisim.errors import InputError, RunError, must
from tisim.files import regular_file
from tisim.files.atomic import replace_file
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.problem.problem import Problem
from tisim.scene.scene import PHYSICS_VERSION

RECORD_FORMAT = "tisim fitness record 1"
ROUNDING_SHIFT = 1e-5
"""Relative shift of all values that single precision may cause, even if no trajectory changes."""

Values = dict[str, dict[str, list[float]]]


@dataclass(frozen=True)
class FitnessRecord:
    """The objectives of some designs of a problem, from random starts 0, 1, 2, ... each.

    problem : its name.
    designs : genes in physical units, by the name of the design.
    values : for each design and objective, in the unit of the objective, one value for each start.
    settings, platform : of the computation; they determine the last bits of the values.
    physics : the version of the physical laws.
    """

    problem: str
    designs: Mapping[str, Mapping[str, float]]
    values: Values
    settings: Mapping[str, Any]
    platform: str
    physics: int = PHYSICS_VERSION

    @classmethod
    def measure(
        cls, problem: Problem, designs: Mapping[str, Mapping[str, float]], starts: int = 8
    ) -> FitnessRecord:
        """Run every design from this number of starts, in batches, with the settings of ``tisim.init``.

        InputError for no designs, a design that the problem refuses, or fewer than 1 start; RunError naming
        the design if a run does not end well.
        """
        must(bool(designs), "designs", "at least one", dict(designs))
        must(starts >= 1, "starts", "at least 1", starts)
        whole = {
            name: problem.genome.complete(design, f"design {name!r}") for name, design in designs.items()
        }
        results = _results(
            problem, [problem.scene(d, seed) for d in whole.values() for seed in range(starts)]
        )
        values: Values = {name: {one.name: [] for one in problem.objectives} for name in designs}
        for name in designs:
            for seed in range(starts):
                result = next(results)
                if not result.status.ok:
                    raise RunError(f"design {name!r}, start {seed}: {result.status.reason}")
                for objective in problem.objectives:
                    values[name][objective.name].append(float(objective.of(result)))
        plain = {name: dict(design) for name, design in designs.items()}
        settings = {} if problem.function else runtime.current().settings
        return cls(problem.name, plain, values, settings, _platform())

    def again(self, problem: Problem) -> FitnessRecord:
        """Return a new record of the same designs and starts, computed now; InputError for another
        problem."""
        must(problem.name == self.problem, "problem", f"the one recorded, {self.problem!r}", problem.name)
        return self.measure(problem, self.designs, self.starts)

    @property
    def starts(self) -> int:
        """The number of random starts of each design."""
        return len(next(iter(next(iter(self.values.values())).values())))

    def same_arithmetic(self, other: FitnessRecord) -> bool:
        """Return whether both were computed with the same settings on the same platform: the same laws then
        give the same values to the last bit."""
        return (self.settings, self.platform) == (other.settings, other.platform)

    def deviations(self, other: FitnessRecord) -> dict[str, float]:
        """Return for each design the deviation of the other record's means, in standard errors of the
        difference; the largest over its objectives, 0 if all bits are the same.

        Different rounding changes the course of single starts, because collisions are chaotic, but not the
        mean. The difference is computed start by start: most starts are the same in both records, so its
        error is small.
        """
        return {
            name: max(_deviation(values, other.values[name][what]) for what, values in objectives.items())
            for name, objectives in self.values.items()
        }

    def save(self, path: str | Path) -> None:
        """Write the record as JSON, replacing an earlier file; RunError if the disk is full."""
        data = {"format": RECORD_FORMAT, **asdict(self)}
        replace_file(Path(path), (json.dumps(data, indent=1) + "\n").encode())

    @classmethod
    def load(cls, path: str | Path) -> FitnessRecord:
        """Read a record; InputError if the file is missing or invalid."""
        text = regular_file.content(Path(path))
        must(text is not None, "fitness record", "an existing file", str(path))
        try:
            data = json.loads(text or b"")
            must(data.pop("format") == RECORD_FORMAT, "fitness record", RECORD_FORMAT, str(path))
            return cls(**data)
        except (ValueError, KeyError, TypeError, AttributeError):
            raise InputError(f"fitness record must be a file of one; received {str(path)!r}") from None


def _results(problem: Problem, scenes: Sequence[Any]) -> Iterator[Any]:
    """Return the results of scenes, or of calls of a plain function, in order."""
    if problem.function is not None:
        return (result for _, result in FunctionEvaluator().evaluate(scenes))
    return iter(tisim.run(scenes))


def _deviation(recorded: list[float], now: list[float]) -> float:
    """Return the change of the mean in its standard errors; infinite if a value is no longer a number."""
    if recorded == now:
        return 0.0
    if not (np.isfinite(recorded).all() and np.isfinite(now).all()):
        return float("inf")
    change = np.subtract(now, recorded)
    error = np.std(change, ddof=1) / np.sqrt(len(change)) if len(change) > 1 else 0.0
    scale = np.hypot(error, ROUNDING_SHIFT * np.abs(recorded).mean())
    return float(abs(np.mean(change)) / scale) if scale > 0 else float("inf")


def _platform() -> str:
    """Return the properties of the machine that affect the last bits of exp and pow, and so a chaotic
    trajectory."""
    return " ".join((platform.system(), platform.machine(), *platform.libc_ver()))
