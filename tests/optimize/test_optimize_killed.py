"""A real search with compiled kernels, killed repeatedly: nothing is lost and no result changes."""

import random
import subprocess
import time

import pytest

from tests.optimize.cache_files import PIPE, worker
from tisim import InputError
from tisim.files import output_folder
from tisim.optimize.storage.cache import Cache, existing
from tisim.optimize.storage.maintenance import verify

QUICK = ("drift", "--generations", "5")
REAL = ("agglomeration", "--size", "small", "--generations", "5")
FILTER = ("packed_filter", "--size", "small", "--generations", "1")


def begin(case, folder):
    """Start the search in a process that prints the key of each stored evaluation."""
    return worker(
        "tisim", "optimize", *case, "--seed", "3", "--out", folder, stderr=subprocess.DEVNULL, pipesize=PIPE
    )


def kill(search, folder, rng):
    """SIGKILL at a random moment, mostly while evaluations are stored; returns the keys reported as
    stored."""
    reported = ""
    moment = rng.choice(["starts", "reads and compiles", "stores", "stores", "stores", "stores"])
    if moment == "reads and compiles":
        while search.poll() is None and not at_work(folder):
            time.sleep(0.01)
    elif moment == "stores":
        for _ in range(rng.randint(1, 40)):
            reported += search.stdout.readline()
    time.sleep(rng.uniform(0.0, 0.02))
    search.kill()
    reported += search.stdout.read()
    return {line.split()[1] for line in reported.splitlines(keepends=True) if line.endswith("\n")}


def at_work(folder):
    """Whether a search holds the lock of its folder, which it creates itself."""
    if not (folder / output_folder.LOCK).exists():
        return False
    try:
        with output_folder.lock(folder, timeout=0.0):
            return False
    except InputError:
        return True


def contents_of(folder):
    """The results of a search: the contents of its file, and its best designs."""
    cache = Cache(folder / "search.h5")
    tables = {name: cache.table(name).columns for name in cache.tables()}
    files = [(folder / name).read_bytes() for name in ("best.csv", "best_scene.toml")]
    values = {record.key: (record.values, record.design) for record in cache.records()}
    return repr(tables), files, values


@pytest.mark.slow
@pytest.mark.parametrize(("case", "kills"), [(QUICK, 3), (REAL, 20), (FILTER, 3)])
def test_a_killed_search_ends_as_if_undisturbed(tmp_path, case, kills):
    with begin(case, tmp_path / "whole") as search:
        search.communicate()
    assert search.returncode == 0
    whole = contents_of(tmp_path / "whole")
    folder = tmp_path / "cut"
    file = folder / "search.h5"
    rng = random.Random(kills)
    records_before, leftovers = {}, set()
    for number in range(kills):
        if 2 * len(records_before) > len(whole[2]):
            break  # leave the rest for the final run, however fast the machine is
        with begin(case, folder) as search:
            keys = kill(search, folder, rng)
        if not (file.exists() or keys):
            continue  # killed before the file was made
        report = verify(file)
        assert report.ok, report
        leftovers |= {name for name in ("journal", "torn", "duplicates") if getattr(report, name)}
        records = {record.key: record.payload() for record in existing(file).records()}
        assert keys <= set(records), number
        assert {key: records.get(key) for key in records_before} == records_before, number
        records_before = records
    assert "journal" in leftovers, "killed within a generation"
    with begin(case, folder) as search:
        again = search.communicate()[0].count("stored ")
    assert search.returncode == 0
    assert again == len(whole[2]) - len(records_before) > 0, "nothing is run twice"
    assert contents_of(folder) == whole
    assert verify(file).ok
