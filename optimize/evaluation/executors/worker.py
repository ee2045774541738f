"""A worker: it starts Taichi once, and then runs the scenes that it receives."""

from __future__ import annotations

import concurrent.futures as cf
import os
import pickle
import platform
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

from tisim import InputError, RunError, Scene
from tisim.backend import runtime
from tisim.files import python_file
from tisim.files.python_file import PythonFile
from tisim.optimize.evaluation.evaluator import BatchEvaluator
from tisim.optimize.evaluation.executors import handshake
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.problem.function import FunctionCall


@dataclass(frozen=True)
class WorkerSettings:
    """The settings of a worker's runs, see tisim.backend.runtime; threads 0 for its share of the cores.

    files : the user's Python files that define parts of scenes; by default the ones loaded in this process.
    """

    device: str = "cpu"
    precision: str = "f64"
    threads: int = 0
    arithmetic: str = "strict"
    files: tuple[PythonFile, ...] = field(default_factory=python_file.loaded_files)

    def __post_init__(self) -> None:
        _ = self.runtime

    @property
    def runtime(self) -> runtime.Runtime:
        """The requested runtime; InputError if a setting is invalid."""
        return runtime.Runtime(self.device, self.precision, self.threads, self.arithmetic)

    @property
    def settings(self) -> dict[str, str]:
        """Settings that a cached result depends on, the same as in the in-process evaluator."""
        return {**self.runtime.settings, "backend": runtime.backend()}

    @property
    def made_by(self) -> dict[str, str]:
        """The description that an answer must carry. With another one, its last bits could differ, and the
        cache would mix both."""
        return {**handshake.program(), **self.runtime.settings}


def _name() -> str:
    return f"worker (process {os.getpid()} of {platform.node()})"


@dataclass(frozen=True)
class Answer:
    """The results of the scenes, in order, or an error; the description of the program; and the worker's
    name."""

    made_by: dict[str, str]
    results: list[Any]
    error: BaseException | None = None
    worker: str = field(default_factory=_name)


_work = cf.ThreadPoolExecutor(1)
"""The thread that runs units of work, one at a time, while other threads receive."""
_evaluator: list[BatchEvaluator] = []


def pack_scenes(scenes: Sequence[Scene]) -> bytes:
    """Return scenes in pickled form; a worker first imports the files that define their parts, then reads
    them."""
    try:
        return pickle.dumps(scenes)
    except (pickle.PicklingError, AttributeError) as error:
        called = isinstance(scenes[0], FunctionCall)
        rule = "function must be one" if called else "scene must be made of classes"
        raise InputError(f"{rule} that a worker can import; received {error}") from None


def run(scenes: bytes, worker_settings: WorkerSettings, share: int) -> Answer:
    """Return the answer of a worker; share : its number of cores."""
    return _answered(_work.submit(_run, scenes, worker_settings, share))


def serve(connection: Connection, share: int) -> None:
    """Answer pickled (packed scenes, settings) until the other end is closed; this is the process's whole
    life.

    This thread only receives. If the searching process ends for any reason, the system closes its end of the
    connection, and this process exits at once, even during a run.
    """
    answer_sent: cf.Future[None] | None = None
    while True:
        try:
            question = connection.recv_bytes()
        except (EOFError, OSError):
            break
        future = _work.submit(_run_pickled, question, share)
        answer_sent = _work.submit(_send, connection, future)
        answer_sent.add_done_callback(_end_unless_sent)
    if answer_sent is not None and not answer_sent.done():
        os._exit(1)


def _run_pickled(question: bytes, share: int) -> Answer:
    scenes, worker_settings = pickle.loads(question)
    return _run(scenes, worker_settings, share)


def _run(pickled: bytes, worker_settings: WorkerSettings, share: int) -> Answer:
    scenes = _unpack_scenes(pickled, worker_settings)
    ask = worker_settings
    if scenes and isinstance(scenes[0], FunctionCall):
        return Answer(ask.made_by, [result for _, result in FunctionEvaluator().evaluate(scenes)])
    before = runtime.generation()
    runtime.init(ask.device, ask.precision, ask.threads or share, ask.arithmetic)
    if not _evaluator or runtime.generation() != before:
        _evaluator[:] = [BatchEvaluator()]
    results = dict(_evaluator[0].evaluate(scenes))
    made_by = {**handshake.program(), **runtime.current().settings}
    return Answer(made_by, [results[index] for index in range(len(scenes))])


def _unpack_scenes(pickled: bytes, worker_settings: WorkerSettings) -> Sequence[Any]:
    """Return the scenes. InputError, in one line, if their parts cannot be imported here."""
    try:
        for file in worker_settings.files:
            python_file.install(file)
        scenes: Sequence[Any] = pickle.loads(pickled)
    except InputError as error:
        raise InputError(f"{_name()}: {error}") from None
    except (ImportError, AttributeError) as error:
        rule = "able to import the parts of the scenes (give your own files with --plugin)"
        raise InputError(f"{_name()} must be {rule}; received {error}") from None
    return scenes


def _answered(future: cf.Future[Answer]) -> Answer:
    error = future.exception()
    return Answer(handshake.program(), [], _portable(error)) if error else future.result()


def _send(connection: Connection, future: cf.Future[Answer]) -> None:
    connection.send(_answered(future))


def _end_unless_sent(answer_sent: cf.Future[None]) -> None:
    """End the process if an answer could not be sent; the receiver notices this, and would otherwise wait for
    ever."""
    if answer_sent.exception():
        os._exit(1)


def _portable(error: BaseException) -> BaseException:
    """Return the error in a form that can be sent. An internal error includes its traceback in the worker."""
    if isinstance(error, (InputError, RunError)):
        return error
    trace = "".join(traceback.format_exception(error))
    try:
        error = pickle.loads(pickle.dumps(error))
    except (pickle.PickleError, TypeError, AttributeError):
        error = RuntimeError(repr(error))
    error.add_note(f"in a worker:\n{trace}")
    return error
