"""Fitness of designs averaged over random starts until the running mean settles (Z04 Eq. 8.1).

All designs share one evaluator call per block of starts, and every evaluation goes through the cache.
"""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from pydantic import Field, model_validator

from optimize.cache import Cache
from optimize.estimate import Estimate, settled_after
from optimize.problem import Problem
from optimize.record import Record, canonical, evaluation_key
from tisim.errors import InputError, RunError, must
from tisim.spec import Checked

if TYPE_CHECKING:
    from tisim.result import Result
    from tisim.scene import Scene


class Evaluator(Protocol):
    """Runs scenes.

    settings : all about it that may change a fitness (precision, device kind); part of the cache key.
    """

    settings: dict[str, Any]

    def evaluate(
        self, scenes: Sequence[Scene], progress: Callable[[float], None] | None
    ) -> Iterator[tuple[int, Result]]:
        """Yield (index into scenes, Result) once for each scene, in any order, as soon as it is finished.

        progress, if given, is called now and then with the finished fraction of this call, 0..1.
        """
        ...


class EnsembleSettings(Checked):
    """How many random starts a fitness is averaged over.

    tolerance : TOL of Z04 Eq. 8.1. block : starts per evaluator call (the first block has min_starts if
    that is more). min_starts, max_starts : bounds of the number of starts. common_starts : start k is the
    same for every design, so that designs are compared on equal terms; False draws each design's own.
    confirm : fresh starts from which the best designs are run again once the search has ended (0: not).
    """

    tolerance: float = Field(5e-4, gt=0, lt=1)
    block: int = Field(6, ge=1)
    min_starts: int = Field(4, ge=1)
    max_starts: int = Field(48, ge=1)
    common_starts: bool = True
    confirm: int = Field(0, ge=0)

    @classmethod
    def kind(cls) -> str:
        """As in ``--set search.ensemble.block=2``."""
        return "search.ensemble"

    @model_validator(mode="after")
    def _ordered(self) -> EnsembleSettings:
        must(
            self.min_starts <= self.max_starts,
            "min_starts",
            f"<= max_starts = {self.max_starts}",
            self.min_starts,
        )
        return self


def start_seed(seed: int, start: int, design: Mapping[str, float] | None = None) -> int:
    """Seed (0 .. 2^31 - 1) of a start: a function of (seed, start), and of the design if one is given."""
    entropy = [seed, start]
    if design is not None:
        entropy.append(int.from_bytes(hashlib.sha256(canonical(dict(design))).digest()[:8], "little"))
    return int(np.random.SeedSequence(entropy).generate_state(1, np.uint32)[0] >> 1)


@dataclass
class _Sample:
    """The starts of one design so far."""

    design: Mapping[str, float]
    values: list[float] = field(default_factory=list)
    reason: str = ""
    open: bool = True


class Ensemble:
    """Estimates fitnesses. evaluations, hits : how many were run, and found in the cache instead."""

    def __init__(
        self, problem: Problem, evaluator: Evaluator, cache: Cache, settings: EnsembleSettings, seed: int
    ) -> None:
        self.problem, self.evaluator, self.cache = problem, evaluator, cache
        self.settings, self.seed = settings, seed
        self.evaluations = 0
        self.hits = 0

    def estimate(
        self, designs: Sequence[Mapping[str, float]], progress: Callable[[float], None] | None = None
    ) -> list[Estimate]:
        """Fitness of each design, in order. progress is called with the finished fraction, never decreasing.

        A design with any failed start has fitness +inf. Errors of the evaluator itself and KeyboardInterrupt
        pass through; what was finished by then is in the cache.
        """
        samples = [_Sample(design) for design in designs]
        size = max(self.settings.block, self.settings.min_starts)
        first, shown = 0, 0.0
        while running := [sample for sample in samples if sample.open]:
            last = min(first + size, self.settings.max_starts)
            done = sum(1.0 if not sample.open else first / self.settings.max_starts for sample in samples)
            share = len(running) * (last - first) / self.settings.max_starts

            def report(fraction: float, done: float = done, share: float = share) -> None:
                nonlocal shown
                shown = max(shown, (done + share * fraction) / len(samples))
                if progress is not None:
                    progress(shown)

            self._run(running, range(first, last), report)
            for sample in running:
                settled = settled_after(sample.values, self.settings.tolerance, self.settings.min_starts)
                sample.open = not sample.reason and settled is None and last < self.settings.max_starts
            first, size = last, self.settings.block
        if progress is not None:
            progress(1.0)
        return [self._summary(sample) for sample in samples]

    def confirm(
        self, designs: Sequence[Mapping[str, float]], progress: Callable[[float], None] | None = None
    ) -> list[Estimate]:
        """Fitness of each design from `confirm` starts that no estimate has used.

        A winner has won by being good and by being lucky in its starts; this is without the luck.
        """
        samples = [_Sample(design) for design in designs]
        first = self.settings.max_starts
        self._run(samples, range(first, first + self.settings.confirm), progress or (lambda fraction: None))
        return [
            self._summary(sample) if sample.reason else Estimate.of(sample.values, True) for sample in samples
        ]

    def _run(self, running: Sequence[_Sample], starts: range, report: Callable[[float], None]) -> None:
        """Add the fitness of each start to each running sample; all that is not in the cache in one call."""
        self.cache.refresh()
        wanted: list[tuple[_Sample, int, int, str]] = []
        missing: dict[str, tuple[Scene, _Sample, int]] = {}
        for sample in running:
            for start in starts:
                seed = start_seed(self.seed, start, None if self.settings.common_starts else sample.design)
                try:
                    scene = self.problem.scene(sample.design, seed)
                except InputError as error:
                    sample.reason = sample.reason or f"infeasible: {error}"
                    break
                key = evaluation_key(
                    scene.digest(), self.evaluator.settings, self.problem.name, self.problem.version
                )
                wanted.append((sample, start, seed, key))
                if self.cache.get(key) is None and key not in missing:
                    missing[key] = (scene, sample, seed)
                else:
                    self.hits += 1
        self._evaluate(missing, report)
        for sample, start, seed, key in wanted:
            record = self.cache.get(key)
            if record is None:
                raise RunError(
                    f"evaluator must yield every scene; received none for start {start}, seed {seed}"
                )
            sample.values.append(record.fitness)
            if not record.ok and not sample.reason:
                sample.reason = f"start {start} (seed {seed}): {record.reason}"

    def _evaluate(
        self, missing: Mapping[str, tuple[Scene, _Sample, int]], report: Callable[[float], None]
    ) -> None:
        if not missing:
            return
        keys = list(missing)
        results = self.evaluator.evaluate([missing[key][0] for key in keys], report)
        for finished, (index, result) in enumerate(results, start=1):
            _, sample, seed = missing[keys[index]]
            ok, reason, fitness = result.status.ok, result.status.reason, math.nan
            if ok:
                fitness = float(self.problem.objective(result))
                if not math.isfinite(fitness):
                    ok, reason, fitness = False, f"objective is {fitness}", math.nan
            self.cache.put(
                Record(
                    key=keys[index],
                    problem=self.problem.name,
                    fitness=fitness,
                    ok=ok,
                    reason="" if ok else reason or "failed without a reason",
                    seed=seed,
                    design=dict(sample.design),
                    work=dict(result.work),
                    wall_s=float(result.wall_s),
                    created=time.time(),
                )
            )
            self.evaluations += 1
            report(finished / len(keys))

    def _summary(self, sample: _Sample) -> Estimate:
        if sample.reason:
            return Estimate(math.inf, math.nan, math.nan, len(sample.values), False, sample.reason)
        settled = settled_after(sample.values, self.settings.tolerance, self.settings.min_starts)
        return Estimate.of(sample.values[:settled], settled is not None)
