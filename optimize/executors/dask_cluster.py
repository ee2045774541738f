"""Workers of a Dask cluster, on whatever machines they are."""

from __future__ import annotations

import concurrent.futures as cf
from collections.abc import Sequence

from optimize.executors import worker
from optimize.executors.worker import Wanted
from tisim.errors import InputError, RunError, must
from tisim.result import Result
from tisim.scene import Scene

CONNECT_S = 10.0
"""Time that a scheduler has to answer, seconds."""


class DaskCluster:
    """The workers of the scheduler at address (host:port).

    Every worker must have this package, the same compiler and Python. Taichi gets as many threads as the
    worker was given (``dask worker --nthreads``). A unit of work whose worker is lost is given to another one
    by the scheduler, a few times at most. InputError when there is no scheduler, or it has no workers.
    """

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client
        except ImportError as missing:
            rule = "one that is installed (pip install 'tisim[dask]')"
            raise InputError(f"executor must be {rule}; received 'dask' ({missing})") from None
        try:
            self._client = Client(f"tcp://{address}", timeout=CONNECT_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as failure:
            raise InputError(
                f"executor must be the address of a running Dask scheduler; received {address!r} ({failure})"
            ) from None
        if not self.workers:
            self._client.close()
            must(False, "Dask cluster", "one with workers", address)
        self._executor = self._client.get_executor(pure=False)

    @property
    def workers(self) -> int:
        return len(self._client.nthreads())

    def submit(self, scenes: Sequence[Scene], wanted: Wanted) -> cf.Future[list[Result]]:
        return self._executor.submit(_run, scenes, wanted)

    def outcome(self, future: cf.Future[list[Result]]) -> list[Result]:
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as killed:
            raise RunError(f"worker of the Dask cluster was lost again and again ({killed})") from killed
        except cf.CancelledError as cancelled:
            raise RunError("Dask scheduler was lost; what had finished is in the cache") from cancelled

    def stop(self, at_once: bool) -> None:
        """Cancel what is waiting; what a worker is at, it finishes for nothing."""
        self._executor.shutdown(wait=False)
        self._client.close()


def _run(scenes: Sequence[Scene], wanted: Wanted) -> list[Result]:
    from distributed import get_worker

    return worker.run(scenes, wanted, get_worker().state.nthreads)
