"""What a worker does: it starts Taichi once, and then runs the scenes that it is sent."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from optimize.evaluator import Evaluator
from tisim import runtime
from tisim.errors import InputError
from tisim.result import Result
from tisim.scene import Scene


@dataclass(frozen=True)
class Wanted:
    """How a worker is to run: see tisim.runtime; threads 0 for its share of the cores.

    backend : the kernel compiler of the searching process. Another one would give other last bits, and the
    cache would take them for the same.
    """

    device: str = "cpu"
    precision: str = "f64"
    threads: int = 0
    backend: str = runtime.backend()

    def __post_init__(self) -> None:
        runtime.Runtime(self.device, self.precision, self.threads)

    @property
    def settings(self) -> dict[str, str]:
        """As of the in-process evaluator: what a cached result depends on."""
        return {"precision": self.precision, "device": self.device, "backend": self.backend}


_taichi = ThreadPoolExecutor(1)
"""Taichi belongs to the thread that has started it; whoever calls, all of it happens in this one."""
_evaluator: list[Evaluator] = []


def run(scenes: Sequence[Scene], wanted: Wanted, share: int) -> list[Result]:
    """The results of scenes, in order, from a worker whose share of the cores that is.

    InputError when this machine has another compiler or lacks the device; what else goes wrong as in-process.
    """
    return _taichi.submit(_run, scenes, wanted, share).result()


def _run(scenes: Sequence[Scene], wanted: Wanted, share: int) -> list[Result]:
    if wanted.backend != runtime.backend():
        raise InputError(f"compiler of a worker must be {wanted.backend}; received {runtime.backend()!r}")
    before = runtime.generation()
    runtime.start(wanted.device, wanted.precision, wanted.threads or share)
    if not _evaluator or runtime.generation() != before:
        _evaluator[:] = [Evaluator()]
    results = dict(_evaluator[0].evaluate(scenes))
    return [results[index] for index in range(len(scenes))]
