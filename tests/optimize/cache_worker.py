"""Script for kill tests: a process that writes, folds or searches until it is stopped."""

import os
import resource
import signal
import sys
import time
from pathlib import Path

from tests.optimize.fake_runs import FakeEvaluator, fake_problem, fake_record
from tisim import RunError
from tisim.optimize.storage.cache import Cache


def write(path, first):
    """Store records for ever and print the number of each after it is stored; fold often."""
    cache = Cache(path)
    number = int(first)
    while True:
        cache.put(fake_record(number, pad="x" * (number % 50)))
        sys.stdout.write(f"{number}\n")
        sys.stdout.flush()
        number += 1
        if number % 5 == 0:
            cache.put_table("log", {"n": list(range(number))})
            cache.fold()


def stepwise(folder):
    """With a fresh cache each time, be killed at the first, second, ... system call that changes a file."""
    calls = ("pwrite", "fsync", "ftruncate", "rename", "replace")
    for kill_at in range(1, 100):
        path = Path(folder) / f"{kill_at:02d}" / "cache.h5"
        with Cache(path) as cache:
            cache.put(fake_record(0))
        child = os.fork()
        if child == 0:
            remaining = kill_at

            def last_straw(call):
                def counted(*arguments, **options):
                    nonlocal remaining
                    remaining -= 1
                    if remaining == 0:
                        if call.__name__ == "pwrite":  # half of the data is written
                            call(arguments[0], bytes(arguments[1][: len(arguments[1]) // 2]), arguments[2])
                        os.kill(os.getpid(), signal.SIGKILL)
                    return call(*arguments, **options)

                return counted

            for name in calls:
                setattr(os, name, last_straw(getattr(os, name)))
            cache = Cache(path)
            for number in (1, 2):
                cache.put(fake_record(number))
                os.write(1, f"{kill_at} {number}\n".encode())
                cache.put_table("log", {"n": list(range(number))})
                os.write(1, f"{kill_at} {100 + number}\n".encode())
            cache.fold()
            os._exit(0)
        if os.waitpid(child, 0)[1] == 0:
            return


def limited(path, size):
    """Store records and fold, with a limit on the size (bytes) of any file."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(size), int(size)))
    cache = Cache(path)
    count = 0
    try:
        for number in range(1000, 2000):
            cache.put(fake_record(number))
            count += 1
    except RunError as error:
        print(count, "put", error)
    try:
        cache.fold()
    except RunError as error:
        print(len(cache), "fold", error)


def search(path):
    """A search that prints the key of each evaluation when it is stored."""
    from tisim.optimize.search import search as run
    from tisim.optimize.settings import Settings

    announce()
    with Cache(path) as cache:
        run(
            fake_problem(3),
            FakeEvaluator(),
            cache,
            Settings(seed=2, generations=4, ensemble={"min_starts": 8}),
        )


def shared(folder, method, *seed_and_more):
    """A search of shared_case that prints the key of each evaluation when it is stored."""
    from tests.optimize.shared_case import searched, skip_pictures

    skip_pictures(setattr)
    announce()
    seed, *warm = seed_and_more
    searched(folder, method, int(seed), warm_start=bool(warm))


def announce():
    """Print the key of each evaluation to standard output when it is stored; a slow reader delays the
    search."""
    put = Cache.put

    def put_and_say(cache, record):
        kept_record = put(cache, record)
        os.write(1, f"stored {record.key}\n".encode())
        return kept_record

    Cache.put = put_and_say


class Asleep:
    """A scene that takes a worker an hour to unpickle."""

    def __reduce__(self):
        return time.sleep, (3600.0,)


def asleep():
    """Two busy worker processes, and a parent that waits for them."""
    from tisim.optimize.evaluation.executors.processes import Processes
    from tisim.optimize.evaluation.executors.worker import WorkerSettings

    pool = Processes(2)
    futures = [pool.submit([Asleep()], WorkerSettings()) for _ in range(2)]
    while len(pool._crew) < 2:
        time.sleep(0.01)
    print("2 at work", flush=True)
    futures[0].result()


def tisim(*arguments):
    """The ``tisim`` command, which also prints the key of each evaluation."""
    from tests.optimize.drift_case import CASE
    from tisim.cases import case
    from tisim.cli.main import main

    every = case.every
    case.every = lambda: {**every(), CASE.name: CASE}
    announce()
    main(arguments)


if __name__ == "__main__":
    functions = (write, stepwise, limited, search, shared, asleep, tisim)
    {function.__name__: function for function in functions}[sys.argv[1]](*sys.argv[2:])
