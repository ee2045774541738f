"""Executors run a search's scenes in this process, in other processes of this machine, or on a Dask
cluster."""

from __future__ import annotations

from tisim.backend import runtime
from tisim.errors import must
from tisim.optimize.evaluation.evaluator import BatchEvaluator
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.evaluation.runs import Evaluator
from tisim.optimize.problem.problem import Problem

RULE = "batch, processes:N or dask://HOST:PORT"
"""The valid names of executors, for error messages."""


def evaluator_for(
    problem: Problem, name: str, device: str = "cpu", precision: str = "f64", threads: int = 0,
    arithmetic: str = "strict",
) -> Evaluator:  # fmt: skip
    """Return the named evaluator for the problem's scenes, or calls of a plain function.

    The other arguments are the same as in ``evaluator_named``.
    """
    if problem.function is None:
        return evaluator_named(name, device, precision, threads, arithmetic)
    if name == "batch":
        return FunctionEvaluator()
    evaluator = evaluator_named(name, device, precision, threads, arithmetic)
    evaluator.settings = FunctionEvaluator().settings
    return evaluator


def evaluator_named(
    name: str, device: str = "cpu", precision: str = "f64", threads: int = 0, arithmetic: str = "strict"
) -> Evaluator:
    """Return the named evaluator. InputError for an unknown name, or if it cannot be reached.

    "batch": this process, many worlds side by side. "processes:4": four worker processes, which this one
    starts. "dask://host:port": the workers of that Dask scheduler (needs the extra ``dask``), or
    "dask://tls://host:port" for a protocol other than TCP.
    threads : CPU threads of this process, or of each worker; 0 for all cores, or a worker's share of them.
    """
    kind, _, rest = name.partition(":")
    must(kind in ("batch", "processes", "dask"), "executor", RULE, name)
    if kind == "batch":
        must(name == "batch", "executor", RULE, name)
        runtime.init(device, precision, threads, arithmetic)
        return BatchEvaluator()
    # Imported late: the executors do not need each other, and Dask may not be installed.
    from tisim.optimize.evaluation.executors.remote import Remote
    from tisim.optimize.evaluation.executors.worker import WorkerSettings

    worker_settings = WorkerSettings(device, precision, threads, arithmetic)
    if kind == "processes":
        from tisim.optimize.evaluation.executors.processes import Processes

        able = rest.isdecimal() and len(rest) < 5 and int(rest) >= 1
        must(able, "executor", "processes:N with N >= 1 and of at most 4 digits", name)
        return Remote(Processes(int(rest)), worker_settings)
    from tisim.optimize.evaluation.executors.dask_cluster import DaskCluster

    must(rest.startswith("//") and len(rest) > 2, "executor", RULE, name)
    return Remote(DaskCluster(rest[2:]), worker_settings)
