import h5py
import numpy as np
import pytest
from cache_files import journal_of, payloads
from fake_runs import fake_record

from optimize.cache import Cache, compact, existing, verify
from optimize.journal import Journal, frame, scan
from tisim.errors import InputError


def test_torn_tail_at_every_byte(path):
    whole = b"".join(frame(fake_record(n).payload()) for n in range(2))
    last = frame(fake_record(2, pad="longer than what is appended after it" * 3).payload())
    for cut in range(len(last)):
        found = scan(whole + last[:cut])
        assert (len(found.payloads), found.end, found.torn, found.damaged) == (2, len(whole), cut, [])
    for cut in range(0, len(last), 7):
        journal_of(path).write_bytes(whole + last[:cut])
        assert verify(path).torn == cut
        cache = Cache(path)
        assert len(cache) == 2
        cache.put(fake_record(3))
        assert payloads(Cache(path).records()) == payloads(fake_record(n) for n in (0, 1, 3))
        assert (verify(path).torn, verify(path).damaged) == (0, [])


def test_damage_inside_the_journal_loses_only_the_damaged(path):
    frames = [frame(fake_record(n).payload()) for n in range(4)]
    for at in range(len(frames[1])):
        hurt = bytearray(frames[1])
        hurt[at] ^= 0x41
        found = scan(frames[0] + bytes(hurt) + frames[2] + frames[3])
        assert len(found.payloads) == 3
        assert found.damaged == [len(frames[0])]
    journal_of(path).write_bytes(frames[0] + bytes(hurt) + frames[2] + frames[3])
    assert verify(path).damaged == [f"journal, byte {len(frames[0])}: not a whole record"]
    with pytest.warns(RuntimeWarning, match=r"1 damaged evaluation\(s\) are ignored"):
        assert len(Cache(path)) == 3


def test_in_both_hdf5_and_journal_counts_once(path):
    with Cache(path) as cache:
        for number in range(5):
            cache.put(fake_record(number))
        left = journal_of(path).read_bytes()
    journal_of(path).write_bytes(left)  # as if killed between replacing the one and emptying the other
    assert len(Cache(path)) == 5
    assert (verify(path).duplicates, verify(path).ok) == (5, True)
    assert compact(path) == 5
    assert (verify(path).duplicates, verify(path).rows) == (0, 5)


def test_verify_finds_conflicting_fitnesses(path):
    with Cache(path) as cache:
        cache.put(fake_record(1))
    Journal(journal_of(path)).append(0, fake_record(1, fitness=0.25).payload())
    assert verify(path).conflicts == [fake_record(1).key]
    assert [record.fitness for record in existing(path).records()] == [1 / 7]
    assert not verify(path).ok


@pytest.mark.parametrize(
    "column", ["key", "problem", "fitness", "ok", "reason", "seed", "design", "work", "wall_s", "crc"]
)
def test_damaged_row_is_found_and_not_used(path, column):
    with Cache(path) as cache:
        for number in range(5):
            cache.put(fake_record(number, ok=number != 2))
        cache.put_table("log", {"gen": [1, 2, 3]})
    with h5py.File(path, "r+") as file:
        values = file["evaluations"][column][...]
        raw = values.view(np.uint8).reshape(len(values), -1)
        raw[2, 0] ^= 1
        file["evaluations"][column][...] = values
    assert verify(path).damaged == ["row 2: its checksum does not fit"]
    assert verify(path).rows == 4
    with pytest.warns(RuntimeWarning, match="1 damaged"):
        cache = Cache(path)
    assert cache.get(fake_record(2).key) is None
    assert len(cache) == 4
    cache.put(fake_record(2))
    cache.close()
    assert verify(path).ok
    assert len(Cache(path)) == 5


def test_damaged_table_is_found(path):
    with Cache(path) as cache:
        cache.put_table("log", {"gen": [1, 2, 3]}, {"note": "a"})
    with h5py.File(path, "r+") as file:
        file["log/gen"][1] = 5
    assert verify(path).damaged == ["table log: its checksum does not fit"]


def test_no_flipped_bit_anywhere_goes_unnoticed(path):
    with Cache(path) as cache:
        cache.put(fake_record(1))
        cache.put(fake_record(2))
        cache.put_table("a/log", {"v (m/s)": [1.0, 2.0], "word": ["x", "y"]}, {"note": "n"})
        table = cache.table("a/log")
    good = path.read_bytes()
    outcomes = set()
    for at in range(0, len(good), 5):
        path.write_bytes(good[:at] + bytes([good[at] ^ (1 << at % 8)]) + good[at + 1 :])
        try:
            found = verify(path).damaged
        except InputError:
            outcomes.add("refused")
            continue
        outcomes.add("reported" if found else "harmless")
        if not found:
            assert payloads(existing(path).records()) == payloads([fake_record(1), fake_record(2)])
            assert Cache(path).table("a/log") == table
    assert {"refused", "reported"} <= outcomes


@pytest.mark.parametrize("content", ["cut", "text", "empty", "foreign"])
def test_file_that_is_none_of_ours_is_refused_and_kept(path, content):
    with Cache(path) as cache:
        for number in range(20):
            cache.put(fake_record(number))
    whole = path.read_bytes()
    if content == "foreign":
        with h5py.File(path, "w") as file:
            file["x"] = 1.0
    else:
        path.write_bytes({"cut": whole[: len(whole) // 2], "text": b"not hdf5 at all", "empty": b""}[content])
    before = path.read_bytes()
    for function in (Cache, verify, existing, compact):
        with pytest.raises(
            InputError, match=r"cache\.h5 must be a whole HDF5 file written by a cache; received"
        ):
            function(path)
    assert path.read_bytes() == before


def test_missing_file_is_refused(path):
    for function in (verify, existing, compact):
        with pytest.raises(InputError, match="cache file must be an existing file; received"):
            function(path)
    assert list(path.parent.iterdir()) == []
