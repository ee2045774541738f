import random
import time

import pytest

from tests.optimize.cache_files import worker
from tests.optimize.fake_runs import fake_record
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.maintenance import verify


@pytest.mark.slow
def test_sigkill_at_random_moments_loses_no_announced_evaluation(path):
    rng = random.Random(8)
    announced = 0
    leftovers = set()
    for round_ in range(20):
        with worker("write", path, announced) as process:
            lines = "".join(process.stdout.readline() for _ in range(rng.randint(1, 12)))
            time.sleep(rng.uniform(0.0, 0.02))
            process.kill()
            lines += process.stdout.read()
        whole = [int(line) for line in lines.splitlines(keepends=True) if line.endswith("\n")]
        assert whole[0] == announced, round_
        announced = whole[-1] + 1
        report = verify(path)
        leftovers |= {name for name in ("torn", "duplicates", "journal") if getattr(report, name)}
        assert report.ok, report
        cache = Cache(path)
        for number in range(announced):
            assert cache.get(fake_record(number).key) is not None, (round_, number)
        assert len(cache) in (announced, announced + 1)  # killed between the write and the print
        announced = len(cache)
    assert announced > 60
    assert "journal" in leftovers


def test_sigkill_at_every_system_call_leaves_a_whole_cache(tmp_path):
    with worker("stepwise", tmp_path) as process:
        lines = process.stdout.read().splitlines()
    assert process.returncode == 0
    announced = {tuple(map(int, line.split())) for line in lines}
    folders = sorted(tmp_path.iterdir())
    assert len(folders) > 8, "two appends, one file written, put in place, journal emptied"
    for folder in folders:
        all_numbers = {number for kill_at, number in announced if kill_at == int(folder.name)}
        numbers = {number for number in all_numbers if number < 100}
        rows = max((number - 100 for number in all_numbers - numbers), default=0)
        report = verify(folder / "cache.h5")
        assert report.ok, folder.name
        assert report.rows >= 1
        seeds = {record.seed for record in Cache(folder / "cache.h5").records()}
        assert {0} | numbers <= seeds <= {0, 1, 2}
        cache = Cache(folder / "cache.h5")
        log = cache.table("log").columns["n"] if cache.tables() else []
        assert log in ([0, 1][:rows], [0, 1][: rows + 1]), "killed between storing and announcing"
        with Cache(folder / "cache.h5") as cache:
            for number in (1, 2, 3):
                cache.put(fake_record(number))
        after = verify(folder / "cache.h5")
        assert (after.rows, after.journal, after.duplicates, after.torn, after.ok) == (4, 0, 0, 0, True)


def test_file_size_limit_is_a_clear_error_and_keeps_what_was_stored(path):
    with Cache(path) as cache:
        for number in range(30):
            cache.put(fake_record(number))
    size = path.stat().st_size
    with worker("limited", path, size + 10) as process:
        put_line, fold_line = process.stdout.read().splitlines()
    count = int(put_line.split()[0])
    assert 0 < count < 1000
    assert (
        "cache.h5.journal could not be written: File too large; everything stored before is intact"
        in put_line
    )
    assert f"{30 + count} fold" in fold_line
    assert "cache.h5 could not be written: File too large" in fold_line
    assert verify(path).ok
    assert verify(path).torn == 0
    assert len(Cache(path)) == 30 + count
