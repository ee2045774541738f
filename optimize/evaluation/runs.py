"""Runs of designs from random starts: each is run once, and all of them are cached."""

from __future__ import annotations

import hashlib
import math
import time
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from tisim import InputError, RunError
from tisim.optimize.problem.calls import check_refusal, constraint_value, make_scene, values_of
from tisim.optimize.problem.faults import FaultyProblem
from tisim.optimize.problem.problem import Problem
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.record import Record, canonical, evaluation_key

if TYPE_CHECKING:
    from tisim import Result, Scene


END = "end"
"""The key, among the counts of a run, of the checksum of its final state."""


class Evaluator(Protocol):
    """Runs scenes, or calls functions (FunctionCall to FunctionResult).

    settings : everything that may change a fitness (precision, device kind); part of the cache key.
    """

    settings: dict[str, Any]

    def evaluate(
        self, scenes: Sequence[Any], progress: Callable[[float], None] | None = None, /
    ) -> Iterator[tuple[int, Any]]:
        """Yield (index into scenes, Result) once for each scene, in any order, as soon as it is finished.

        progress : called from time to time with the finished fraction of this call, 0..1.
        """
        ...

    def close(self) -> None:
        """Release its resources; it is not used any more."""
        ...


def start_seed(seed: int, start: int, design: Mapping[str, float] | None = None) -> int:
    """Return the seed (0 .. 2^31 - 1) of a start: a function of (seed, start), and of the design if one is
    given."""
    entropy = [seed, start]
    if design is not None:
        entropy.append(int.from_bytes(hashlib.sha256(canonical(dict(design))).digest()[:8], "little"))
    return int(np.random.SeedSequence(entropy).generate_state(1, np.uint32)[0] >> 1)


def work_of(result: Any) -> dict[str, Any]:
    """Return the counts of a run and, under END, a checksum of its final state, if it has one."""
    work, state = dict(result.work), getattr(result, "state", None)
    if result.status.ok and state:
        end = zlib.crc32(repr(sorted(work.items())).encode())
        for name in sorted(state):
            end = zlib.crc32(np.ascontiguousarray(state[name]).tobytes(), end)
        work[END] = end
    return work


def _widen(seen: list[float], value: float) -> None:
    """Add a value to the list of seen ones: the least, the largest and one other."""
    if value not in seen:
        seen.append(value)
        if len(seen) > 3:
            seen[:] = [min(seen), sorted(seen)[1], max(seen)]


@dataclass(eq=False)
class Sample:
    """The starts of one design so far.

    values : for each start the quantities of the problem's objectives.
    limited : for each start the values of the constraints of the result.
    ends : for each start the counts and final state that distinguish its run (see ``work_of``).
    used : number of the first starts that its estimate is computed from.
    converged : see FitnessEstimate.
    reason : "" or why the design failed.
    open : whether more starts follow.
    own : whether its starts are its own even if other designs have common ones.
    """

    design: Mapping[str, float]
    own: bool = False
    values: list[tuple[float, ...]] = field(default_factory=list)
    limited: list[tuple[float, ...]] = field(default_factory=list)
    ends: list[int | None] = field(default_factory=list)
    used: int = 0
    converged: bool = False
    reason: str = ""
    open: bool = True


class Runs:
    """Makes the requested runs that are not in the cache.

    evaluations, hits : numbers of runs made, and of runs found in the cache. Their sum is the number of
        different runs requested, and is the same for a resumed search.
    requested : number of all requests, repeated ones included.
    seen : for each quantity the least and the largest value so far, and one other.
    common : whether start k is the same for every design.
    """

    def __init__(
        self, problem: Problem, evaluator: Evaluator, cache: Cache, seed: int, common: bool = True
    ) -> None:
        self.problem, self.evaluator, self.cache = problem, evaluator, cache
        self.seed, self.common, self.code = seed, common, problem.objective_identity
        self.evaluations = 0
        self.hits = 0
        self.requested = 0
        self.seen: list[list[float]] = [[] for _ in problem.quantities]
        self._requested: set[str] = set()

    def add(
        self,
        additions: Iterable[tuple[Sample, range]],
        report: Callable[[float], None] = lambda fraction: None,
    ) -> None:
        """Add the values of these starts to each sample; all runs that are not cached are made in one call.

        report : called with the finished fraction. Errors of the evaluator and KeyboardInterrupt are passed
            on; runs finished before are in the cache.
        """
        self.cache.refresh()
        requested: list[tuple[Sample, int, int, str]] = []
        missing: dict[str, tuple[Scene, Sample, int, int]] = {}
        for sample, starts in additions:
            for start in starts:
                common = self.common and not sample.own
                seed = start_seed(self.seed, start, None if common else sample.design)
                try:
                    scene = make_scene(self.problem, sample.design, seed)
                except FaultyProblem:
                    raise
                except InputError as error:
                    sample.reason = sample.reason or f"infeasible: {error}"
                    break
                objective = self.problem.name, self.problem.version, self.code
                key = evaluation_key(scene.digest(), self.evaluator.settings, *objective)
                requested.append((sample, start, seed, key))
                if self.cache.get(key) is None:
                    missing.setdefault(key, (scene, sample, start, seed))
                elif key not in self._requested:
                    self.hits += 1
                self._requested.add(key)
        self.requested += len(requested)
        self._run(missing, report)
        for sample, start, seed, key in requested:
            record = self.cache.get(key)
            if record is None:
                raise RunError(
                    f"evaluator must yield every scene; received none for start {start}, seed {seed}"
                )
            if not record.ok and not sample.reason:
                sample.reason = f"start {start} (seed {seed}): {record.reason}"
            if record.ok:
                values = tuple(record.values[name] for name in self.problem.quantities)
                sample.values.append(values)
                limited = self.problem.result_constraints
                sample.limited.append(tuple(record.values[one.name] for one in limited))
                sample.ends.append(record.work.get(END))
                for seen, value in zip(self.seen, values, strict=True):
                    _widen(seen, value)

    def _run(
        self, missing: Mapping[str, tuple[Scene, Sample, int, int]], report: Callable[[float], None]
    ) -> None:
        if not missing:
            return
        keys = list(missing)
        results = self.evaluator.evaluate([missing[key][0] for key in keys], report)
        for finished, (index, result) in enumerate(results, start=1):
            _, sample, start, seed = missing[keys[index]]
            self.cache.put(self._record(keys[index], sample, start, seed, result))
            self.evaluations += 1
            report(finished / len(keys))

    def _record(self, key: str, sample: Sample, start: int, seed: int, result: Result) -> Record:
        problem = self.problem
        ok, reason = result.status.ok, result.status.reason or "failed without a reason"
        names = [*problem.quantities, *(one.name for one in problem.result_constraints)]
        values = dict.fromkeys(names, math.nan)
        if not ok:
            check_refusal(result, problem)
        else:
            for objective in problem.objectives:
                values |= values_of(objective, result, problem)
            values |= {one.name: constraint_value(one, result, problem) for one in problem.result_constraints}
            bare = len(names) == 1
            for name, value in values.items():
                if ok and not math.isfinite(value):
                    ok, reason = False, f"{'objective' if bare else name} is {value}"
        return Record(
            key=key,
            problem=self.problem.name,
            values=values if ok else dict.fromkeys(values, math.nan),
            ok=ok,
            reason="" if ok else reason,
            seed=seed,
            design=dict(sample.design),
            work=work_of(result),
            wall_s=float(result.wall_s),
            created=time.time(),
            start=start,
        )
