import errno
import os
import threading

import h5py
import pytest

from tests.optimize.cache_files import journal_of, payloads
from tests.optimize.fake_runs import fake_record
from tisim import RunError
from tisim.files import atomic
from tisim.files.atomic import replace_file
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.hdf5_store import build_image
from tisim.optimize.storage.maintenance import verify
from tisim.optimize.storage.runs_table import tabulated


@pytest.mark.parametrize("space_left", [0, 1, 40])
def test_disk_full_while_appending(path, monkeypatch, space_left):
    cache = Cache(path)
    cache.put(fake_record(0))
    cache.fold()
    cache.put(fake_record(1))
    write = os.pwrite
    end = journal_of(path).stat().st_size

    def full(handle, data, offset):
        """A disk with space for ``space_left`` more bytes."""
        space = end + space_left - offset
        if space <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(handle, bytes(data[:space]), offset)

    with monkeypatch.context() as patch:
        patch.setattr(atomic.os, "pwrite", full)
        with pytest.raises(
            RunError, match=r"cache\.h5\.journal could not be written: No space left on device; every"
        ):
            cache.put(fake_record(2))
    assert cache.get(fake_record(2).key) is None
    assert payloads(Cache(path).records()) == payloads([fake_record(0), fake_record(1)])
    assert verify(path).torn == 0
    cache.put(fake_record(2))
    assert len(Cache(path)) == 3


def test_disk_full_while_folding(path, monkeypatch):
    cache = Cache(path)
    cache.put(fake_record(0))
    cache.fold()
    cache.put(fake_record(1))
    cache.put_table("log", {"gen": [1]})
    before = path.read_bytes()

    def full(handle, data, offset):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(atomic.os, "pwrite", full)
        with pytest.raises(RunError, match=r"cache\.h5 could not be written: No space left"):
            cache.fold()
    assert path.read_bytes() == before
    assert sorted(p.name for p in path.parent.iterdir()) == ["cache.h5", "cache.h5.journal", "cache.h5.lock"]
    assert len(Cache(path)) == 2
    cache.fold()
    assert Cache(path).tables() == ["log"]


def test_killed_fold_leaves_no_trace(path):
    with Cache(path) as cache:
        cache.put(fake_record(0))
    path.with_name("cache.h5.new").write_bytes(b"half a file")
    with Cache(path) as cache:
        cache.put(fake_record(1))
    assert verify(path).rows == 2
    assert not path.with_name("cache.h5.new").exists()


def test_replace_file_is_all_or_nothing(tmp_path):
    target = tmp_path / "file"
    replace_file(target, b"old")
    replace_file(target, build_image(tabulated([], [fake_record(1)]), {}))
    with h5py.File(target) as file:
        assert len(file["evaluations/bowl/key"]) == 1


def test_writers_without_a_lock_of_their_own_take_turns(tmp_path):
    """Writers with large and small contents use one path; the file is always one complete content."""
    target = tmp_path / "file"
    contents = [bytes([65 + k]) * (1 + 300_000 * (k % 2)) for k in range(4)]
    replace_file(target, contents[0])
    failures = []

    def write(content):
        try:
            for _ in range(40):
                replace_file(target, content)
        except BaseException as failure:
            failures.append(failure)

    threads = [threading.Thread(target=write, args=(content,)) for content in contents]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        assert target.read_bytes() in contents
    assert failures == []
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
