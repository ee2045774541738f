import multiprocessing

import pytest

from tests.optimize.cache_files import journal_of, payloads
from tests.optimize.fake_runs import fake_record
from tisim import InputError
from tisim.optimize.storage import cache as cache_module
from tisim.optimize.storage.cache import Cache, existing
from tisim.optimize.storage.maintenance import compact, verify


def test_round_trip_through_journal_and_hdf5(path):
    records = [fake_record(n, ok=n != 3, fitness=float("nan") if n == 3 else 1 / (n + 1)) for n in range(10)]
    cache = Cache(path)
    for record in records[:6]:
        cache.put(record)
    assert not path.exists()
    assert payloads(Cache(path).records()) == payloads(records[:6])
    cache.fold()
    for record in records[6:]:
        cache.put(record)
    assert payloads(Cache(path).records()) == payloads(records)
    assert payloads(existing(path).records()) == payloads(records)
    assert Cache(path).get(records[8].key) == records[8]
    report = verify(path)
    assert (report.rows, report.journal, report.ok, report.duplicates, report.torn) == (6, 4, True, 0, 0)
    assert compact(path) == 10
    assert (verify(path).rows, verify(path).journal) == (10, 0)


def test_first_record_of_a_key_counts(path):
    with Cache(path) as cache:
        assert cache.put(fake_record(1)).values == {"fitness": 1 / 7}
        assert cache.put(fake_record(1, fitness=9.0)).values == {"fitness": 1 / 7}
    assert [record.values for record in existing(path).records()] == [{"fitness": 1 / 7}]


def test_other_process_records_appear(path):
    one, two = Cache(path), Cache(path)
    for round_ in range(6):
        one.put(fake_record(round_))
        if round_ % 2:
            one.fold()
        assert two.get(fake_record(round_).key) is None
        two.refresh()
        assert two.get(fake_record(round_).key) == fake_record(round_)
    two.put(fake_record(99))
    two.fold()
    one.refresh()
    assert len(one) == 7


def test_tables_survive_other_writers_and_folds(path):
    one, two = Cache(path), Cache(path)
    one.put_table("searches/a", {}, {"settings": '{"seed": 1}', "n": 3})
    one.put_table(
        "searches/a/log",
        {"gen": [0, 1], "best": [0.5, float("nan")], "word": ["é", ""], "box": [True, False]},
    )
    one.fold()
    two.put_table("searches/b/log", {"gen": [7], "v (m/s)": [2.5]})
    two.put(fake_record(1))
    two.fold()
    one.put_table("searches/a", {}, {"settings": '{"seed": 2}'})
    one.fold()
    new = Cache(path)
    assert new.tables() == ["searches/a", "searches/a/log", "searches/b/log"]
    assert new.table("searches/a").attrs == {"settings": '{"seed": 2}'}
    log = new.table("searches/a/log").columns
    assert repr(log) == repr(
        {"gen": [0, 1], "best": [0.5, float("nan")], "word": ["é", ""], "box": [True, False]}
    )
    assert new.table("searches/b/log").columns == {"gen": [7], "v (m/s)": [2.5]}
    assert verify(path).ok
    with pytest.raises(InputError, match="table name must be one of"):
        new.table("searches/c")
    with pytest.raises(InputError, match="all of one length"):
        new.put_table("bad", {"a": [1], "b": [1, 2]})
    with pytest.raises(InputError, match="not below 'evaluations'"):
        new.put_table("evaluations/x", {"a": [1]})


def test_journal_folds_itself_when_large(path, monkeypatch):
    monkeypatch.setattr(cache_module, "FOLD_BYTES", 2000)
    monkeypatch.setattr(cache_module, "FOLD_SHARE", 0.0)
    cache = Cache(path)
    for number in range(20):
        cache.put(fake_record(number))
        assert journal_of(path).stat().st_size <= 2000
    assert verify(path).rows > 10
    assert len(Cache(path)) == 20


def _append(path, worker, count):
    with Cache(path) as cache:
        for number in range(count):
            shared = number % 3 == 0
            cache.put(fake_record(number if shared else 1000 * worker + number))
            if number % 7 == 0:
                cache.put_table(f"worker{worker}", {"n": [number]})
                cache.fold()


def test_processes_sharing_a_file_lose_nothing_and_double_nothing(path):
    count, workers = 45, (1, 2)
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=_append, args=(path, worker, count)) for worker in workers]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
        assert process.exitcode == 0
    expected = {fake_record(n).key for n in range(0, count, 3)}
    expected |= {fake_record(1000 * w + n).key for w in workers for n in range(count) if n % 3}
    report = verify(path)
    assert (report.rows, report.duplicates, report.damaged, report.conflicts) == (len(expected), 0, [], [])
    cache = Cache(path)
    assert {record.key for record in cache.records()} == expected
    assert cache.tables() == ["worker1", "worker2"]
    assert cache.table("worker2").columns == {"n": [42]}
