"""Workers of a Dask cluster, on any machines."""

from __future__ import annotations

import concurrent.futures as cf
import logging
import time
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tisim import InputError, RunError, Scene
from tisim.errors import must
from tisim.optimize.evaluation.executors import handshake, worker
from tisim.optimize.evaluation.executors.worker import Answer, WorkerSettings

if TYPE_CHECKING:
    from distributed import Client

CONNECT_S = 10.0
"""Time limit for the scheduler's answer, s."""
SILENCE_S = 60.0
"""A search gives up after this time without any worker, s, since a cluster may start new ones."""
ENCRYPTED = ("tls", "wss")
SCHEMES = ("tcp", "ws", *ENCRYPTED)
"""The address schemes supported for a scheduler."""
WORKER_CHECK_S = 1.0
"""Shortest interval between checks for workers, s."""


class DaskCluster:
    """The workers of the scheduler at address: host:port, or scheme://host:port with one of SCHEMES.

    Every worker must have this package, and the same compiler and Python. Taichi gets the number of threads
    of the worker (``dask worker --nthreads``). If a worker is lost, the scheduler gives its unit of work to
    another one, a few times at most. Certificates for encrypted connections are taken from Dask's own
    configuration, ``distributed.comm.tls``. InputError if they are missing, if there is no scheduler, and if
    it has no workers or one with another version of the program.
    """

    def __init__(self, address: str) -> None:
        self._client = _client(address)
        # A lost scheduler is reported below; Dask would report it too, with many stack traces.
        for logger in ("distributed", "distributed.client"):
            logging.getLogger(logger).setLevel(logging.CRITICAL)
        try:
            must(self.workers > 0, "Dask cluster", "one with workers", address)
            for where, theirs in self._client.run(handshake.program, on_error="return").items():
                who = f"worker {where} of the Dask cluster"
                if isinstance(theirs, dict):
                    handshake.agree(handshake.program(), theirs, who)
                elif not isinstance(theirs, OSError):  # or it has just disconnected
                    raise handshake.stranger(theirs, who)
        except InputError:
            self._client.close()
            raise
        self._executor = self._client.get_executor(pure=False)
        self._checked = self._answered = time.monotonic()
        self._warned = False

    @property
    def workers(self) -> int:
        """The number of workers; also 0 if the scheduler does not answer."""
        try:
            return len(self._client.sync(self._client.scheduler.ncores, callback_timeout=CONNECT_S))
        except (OSError, TimeoutError):
            return 0

    def submit(self, scenes: Sequence[Scene], worker_settings: WorkerSettings) -> cf.Future[Answer]:
        self._check()
        self._answered = time.monotonic()
        return self._executor.submit(_run, worker.pack_scenes(scenes), worker_settings)

    def outcome(self, future: cf.Future[Answer]) -> Answer:
        from distributed import KilledWorker

        try:
            answer = future.exception() or future.result()
        except cf.CancelledError:
            raise _scheduler_lost() from None
        if isinstance(answer, (KilledWorker, OSError)):
            raise RunError(f"workers of the Dask cluster were lost again and again ({answer})") from answer
        if isinstance(answer, Answer):
            return answer
        # The worker could not read its input, or its version of the program is too old for this format.
        raise handshake.stranger(answer, "worker of the Dask cluster")

    def check_workers(self) -> None:
        """Warn if there is no worker; RunError after SILENCE_S without one, or without a scheduler."""
        self._check()
        now = time.monotonic()
        if now - self._checked < WORKER_CHECK_S:
            return
        self._checked = now
        if self.workers:
            self._answered, self._warned = now, False
        elif now - self._answered > SILENCE_S:
            raise RunError(
                f"no worker of the Dask cluster has answered for {SILENCE_S:g} s; finished runs are kept"
            )
        elif not self._warned:
            self._warned = True
            waiting = f"no worker of the Dask cluster answers; waiting for {SILENCE_S:g} s"
            warnings.warn(waiting, RuntimeWarning, stacklevel=2)

    def _check(self) -> None:
        if self._client.status != "running":
            raise _scheduler_lost()

    def stop(self) -> None:
        """Cancel waiting work; a worker finishes its current unit, but the result is discarded."""
        self._executor.shutdown(wait=False)
        self._client.close()


def _client(address: str) -> Client:
    """Return the client of the scheduler at the address. An invalid address is refused before Dask starts
    anything that it could not stop."""
    try:
        from distributed import Client, Security
        from distributed.comm import parse_host_port
    except ImportError as missing:
        rule = "one that is installed (pip install 'tisim[dask]')"
        raise InputError(f"executor must be {rule}; received 'dask' ({missing})") from None
    scheme, _, place = address.rpartition("://")
    scheme = scheme or "tcp"
    must(scheme in SCHEMES, "scheme of the Dask scheduler's address", f"one of {', '.join(SCHEMES)}", scheme)
    try:
        parse_host_port(place)
        security = Security() if scheme in ENCRYPTED else None
        if security is None or security.get_connection_args("client")["ssl_context"] is not None:
            full = f"{scheme}://{place}"
            return Client(full, security=security, timeout=CONNECT_S, set_as_default=False)
        failure = "there are no certificates in Dask's configuration, distributed.comm.tls"
    except (OSError, TimeoutError, ValueError) as error:
        failure = str(error)
    raise InputError(
        f"executor must be the address of a running Dask scheduler; received {address!r} ({failure})"
    )


def _scheduler_lost() -> RunError:
    return RunError("Dask scheduler was lost; finished runs are kept")


def _run(scenes: bytes, worker_settings: WorkerSettings) -> Answer:
    from distributed import get_worker

    return worker.run(scenes, worker_settings, get_worker().state.nthreads)
