import os
import re
import shutil

import h5py
import pytest

from tests.optimize.cache_files import hurt, journal_of, lock_of, of_format, payloads
from tests.optimize.fake_runs import fake_record
from tisim import InputError
from tisim.files.checksum import MAGIC, frame, scan
from tisim.optimize.storage.cache import Cache, existing
from tisim.optimize.storage.journal import Journal
from tisim.optimize.storage.maintenance import compact, verify


def test_torn_tail_at_every_byte(path):
    whole = b"".join(frame(fake_record(n).payload()) for n in range(2))
    last = frame(fake_record(2, pad="longer than what is appended after it" * 3).payload())
    for cut in range(len(last)):
        scanned = scan(whole + last[:cut])
        assert (len(scanned.payloads), scanned.end, scanned.torn, scanned.damaged) == (2, len(whole), cut, [])
    for cut in range(0, len(last), 7):
        journal_of(path).write_bytes(whole + last[:cut])
        lock_of(path).unlink(missing_ok=True)
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
        scanned = scan(frames[0] + bytes(hurt) + frames[2] + frames[3])
        assert len(scanned.payloads) == 3
        assert scanned.damaged == [len(frames[0])]
    journal_of(path).write_bytes(frames[0] + bytes(hurt) + frames[2] + frames[3])
    assert verify(path).damaged == [f"journal, byte {len(frames[0])}: not a whole record"]
    with pytest.warns(RuntimeWarning, match=r"1 damaged evaluation\(s\) are ignored"):
        assert len(Cache(path)) == 3


def test_a_record_in_file_and_journal_counts_once(path):
    with Cache(path) as cache:
        for number in range(5):
            cache.put(fake_record(number))
        journal = journal_of(path).read_bytes()
    journal_of(path).write_bytes(journal)  # as if killed between replacing the file and emptying the journal
    assert len(Cache(path)) == 5
    assert (verify(path).duplicates, verify(path).ok) == (5, True)
    assert compact(path) == 5
    assert (verify(path).duplicates, verify(path).rows) == (0, 5)


def test_verify_finds_conflicting_fitnesses(path):
    with Cache(path) as cache:
        cache.put(fake_record(1))
    Journal(journal_of(path)).append(0, fake_record(1, fitness=0.25).payload())
    assert verify(path).conflicts == [fake_record(1).key]
    assert [record.values for record in existing(path).records()] == [{"fitness": 1 / 7}]
    assert not verify(path).ok


@pytest.mark.parametrize(
    "column",
    ["key", "start", "seed", "ok", "reason", "wall_s", "created", "work", "crc", "genes/x", "values/fitness"],
)
def test_damaged_row_is_found_and_not_used(path, column):
    with Cache(path) as cache:
        for number in range(5):
            cache.put(fake_record(number, ok=number != 2))
        cache.put_table("log", {"gen": [1, 2, 3]})
    hurt(path, f"evaluations/bowl/{column}", 2)
    assert verify(path).damaged == ["bowl, row 2: its checksum does not fit"]
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
        cache.put_table("log/below", {"gen": [1, 2]})
    hurt(path, "log/gen", 1)
    assert verify(path).damaged == ["table log: its checksum does not fit"]
    with pytest.raises(InputError, match="table log must be whole"):
        Cache(path).table("log")
    assert Cache(path).attributes()["log"] == {"note": "a"}
    compact(path)
    assert verify(path).ok
    assert Cache(path).tables() == ["log/below"]
    assert Cache(path).table("log/below").columns == {"gen": [1, 2]}


@pytest.mark.parametrize("step", [29, pytest.param(5, marks=pytest.mark.slow)])
def test_every_flipped_bit_is_detected(path, step):
    with Cache(path) as cache:
        cache.put(fake_record(1))
        cache.put(fake_record(2))
        cache.put_table("a/log", {"v (m/s)": [1.0, 2.0], "word": ["x", "y"]}, {"note": "n"})
        table = cache.table("a/log")
    good = path.read_bytes()
    outcomes = set()
    for at in range(0, len(good), step):
        path.write_bytes(good[:at] + bytes([good[at] ^ (1 << at % 8)]) + good[at + 1 :])
        try:
            damaged = verify(path).damaged
        except InputError:
            outcomes.add("refused")
            continue
        outcomes.add("reported" if damaged else "harmless")
        if not damaged:
            assert payloads(existing(path).records()) == payloads([fake_record(1), fake_record(2)])
            assert Cache(path).table("a/log") == table
    assert {"refused", "reported"} <= outcomes


@pytest.mark.parametrize("content", ["cut", "text", "empty", "foreign"])
def test_foreign_files_are_refused_and_kept(path, content):
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


@pytest.mark.parametrize("kind", ["tisim evaluations 1", "tisim evaluations 3", "tisim run 1"])
def test_files_of_another_format_are_refused_and_kept(path, kind):
    """Undamaged files of an earlier or a later format, or of another command."""
    path.write_bytes(of_format(kind))
    before = path.read_bytes()
    told = f"{path} must be a file of the format 'tisim evaluations 2'; received one of the format '{kind}'"
    for function in (Cache, verify, existing, compact):
        with pytest.raises(InputError) as error:
            function(path)
        assert str(error.value) == told
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir() if not file.name.endswith(".lock")] == [path.name]


def test_a_damaged_file_of_another_format_is_not_salvaged(path):
    path.write_bytes(of_format("tisim evaluations 1")[:-5])
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"cache\.h5 must be a whole HDF5 file written by a cache; received"):
        compact(path)
    assert path.read_bytes() == before


def test_a_journal_entry_of_another_format_is_reported(path):
    entry = frame(b'{"created":1e9,"design":{"x":0.5},"fitness":0.5,"key":"1","problem":"bowl"}')
    journal_of(path).write_bytes(frame(fake_record(0).payload()) + entry)
    assert verify(path).damaged == ["journal, frame 1: no evaluation"]
    with pytest.warns(RuntimeWarning, match=r"1 damaged evaluation\(s\) are ignored and will be run again"):
        assert len(Cache(path)) == 1


def test_missing_file_is_refused(path):
    for function in (verify, existing, compact):
        with pytest.raises(InputError, match="cache file must be an existing file; received"):
            function(path)
    assert list(path.parent.iterdir()) == []


def test_a_damaged_checksum_does_not_admit_a_damaged_structure(path):
    """HDF5 may hang on such a file, so it only ever receives intact structures."""
    with Cache(path) as cache:
        for number in range(5):
            cache.put(fake_record(number))
        cache.put_table("log", {"gen": [1, 2, 3]})
    good = path.read_bytes()
    end = good.rfind(MAGIC)
    for at in range(end, len(good), 3):
        hit = bytearray(good)
        hit[at] ^= 0x10
        hit[at * 7919 % end] ^= 1
        path.write_bytes(hit)
        with pytest.raises(InputError, match=r"; received .* damaged"):
            Cache(path)
        with pytest.raises(InputError, match=r"; received .* damaged"):
            verify(path)
    path.write_bytes(good[:end])
    with pytest.raises(InputError, match=r"; received .* damaged"):
        Cache(path)


NO_RECORDS = {
    "text": b"hello", "not utf-8": b"\xff\xfe", "number": b"3", "list": b"[]", "null": b"null", "empty": b"",
    "deep": b"[" * 40_000, "long": b"9" * 5000, "no fields": b"{}", "another's": b'{"key": "x"}',
    "too much": fake_record(7).payload()[:-1] + b',"more":1}',
    "seed": fake_record(7).payload().replace(b'"seed":7', b'"seed":"7"'),
    "large seed": fake_record(7).payload().replace(b'"seed":7', b'"seed":' + b"9" * 30),
    "design": fake_record(7).payload().replace(b'"design":{', b'"design":[{').replace(b'},"w', b'}],"w'),
    "key": fake_record(7).payload().replace(b'"key":"', b'"key":1,"k":"'),
}  # fmt: skip


@pytest.mark.parametrize("payload", NO_RECORDS.values(), ids=NO_RECORDS)
def test_an_intact_frame_without_a_record_is_reported_and_left_out(path, payload):
    assert payload != fake_record(7).payload()
    journal_of(path).write_bytes(
        b"".join(map(frame, (fake_record(0).payload(), payload, fake_record(1).payload())))
    )
    report = verify(path)
    assert (report.journal, report.damaged) == (2, ["journal, frame 1: no evaluation"])
    with pytest.warns(RuntimeWarning, match=r"1 damaged evaluation\(s\) are ignored and will be run again"):
        cache = Cache(path)
    assert len(cache) == 2
    cache.put(fake_record(7))
    with pytest.warns(RuntimeWarning, match="1 damaged"):
        assert compact(path) == 3
    assert verify(path).ok


@pytest.mark.parametrize("folded", [0, 2])
def test_a_truncated_journal_reports_the_loss(path, folded):
    cache = Cache(path)
    for number in range(folded):
        cache.put(fake_record(number))
    cache.fold()
    size = [0]
    for number in range(folded, folded + 4):
        cache.put(fake_record(number))
        size.append(journal_of(path).stat().st_size)
    assert verify(path).ok
    whole = journal_of(path).read_bytes()
    for end, intact in ((size[4] - 1, 3), (size[3], 3), (size[2] + 5, 2), (0, 0)):
        journal_of(path).write_bytes(whole[:end])
        lost_bytes = size[4] - size[intact]
        text = f"journal, byte {size[intact]}: {4 - intact} evaluation(s) cut off, {lost_bytes} bytes"
        assert verify(path).damaged == [text] if folded or end else True
        with pytest.warns(RuntimeWarning, match=re.escape(text)):
            assert len(Cache(path)) == folded + intact
    journal_of(path).write_bytes(whole[: size[2]])
    with pytest.warns(RuntimeWarning, match=r"2 evaluation\(s\) cut off"):
        cache = Cache(path)
    cache.put(fake_record(9))
    assert verify(path).ok, "what was lost has been told"
    assert len(Cache(path)) == folded + 3


@pytest.mark.parametrize("folded", [0, 2])
def test_a_truncated_journal_in_a_copied_folder_is_reported_too(path, folded):
    with Cache(path) as cache:
        for number in range(folded):
            cache.put(fake_record(number))
        cache.fold()
        for number in range(folded, folded + 3):
            cache.put(fake_record(number))
        copied = path.parent.with_name(f"copied-{folded}")
        shutil.copytree(path.parent, copied)
    journal = journal_of(copied / path.name)
    journal.write_bytes(journal.read_bytes()[:-1])
    assert "1 evaluation(s) cut off" in verify(copied / path.name).damaged[0]
    with pytest.warns(RuntimeWarning, match=r"1 evaluation\(s\) cut off"):
        assert len(Cache(copied / path.name)) == folded + 2


@pytest.mark.parametrize("mark", [b"", b"the user's own", frame(b"{}"), frame(b"[1,2,3]"), frame(b"[[1],2]")])
def test_a_lock_file_without_a_mark_gives_no_alarm(path, mark):
    Cache(path).put(fake_record(1))
    lock_of(path).write_bytes(mark)
    assert verify(path).ok
    assert len(Cache(path)) == 1


def test_a_folded_or_killed_writer_leaves_no_alarm(path):
    """The mark belongs to one state of the HDF5 file; a journal folded into another state is not
    truncated."""
    with Cache(path) as cache:
        for number in range(3):
            cache.put(fake_record(number))
    assert len(lock_of(path).read_bytes()) > 0
    assert verify(path).ok
    assert len(Cache(path)) == 3
    cache = Cache(path)
    cache.put(fake_record(5))
    Journal(journal_of(path)).append(
        journal_of(path).stat().st_size, fake_record(6).payload()
    )  # killed, no mark
    assert verify(path).ok
    assert len(Cache(path)) == 5


IN_PLACE = {
    "link": lambda path: path.symlink_to("elsewhere"),
    "fifo": os.mkfifo,
    "folder": lambda path: path.mkdir(),
    "device": lambda path: path.symlink_to("/dev/zero"),
}


@pytest.mark.parametrize("place", IN_PLACE.values(), ids=IN_PLACE)
@pytest.mark.parametrize("name", ["cache.h5", "cache.h5.journal", "cache.h5.lock"])
def test_irregular_files_are_refused(path, place, name):
    with Cache(path) as cache:
        cache.put(fake_record(1))
    path.with_name(name).unlink()
    place(path.with_name(name))
    for function in (Cache, verify, existing, compact):
        with pytest.raises(InputError, match=rf"{name} must be a regular file that"):
            function(path)


def test_paths_that_name_no_file(path):
    for function in (Cache, verify, existing, compact):
        for name in ("/", ".", ""):
            with pytest.raises(InputError, match="cache file must be a file; received"):
                function(name)
    path.write_text("a file")
    with pytest.raises(InputError, match="output folder must be writable"):
        Cache(path / "below")


SPOILT = {
    "a flipped bit in the checksum": lambda content: (
        content[:-20] + bytes([content[-20] ^ 1]) + content[-19:]
    ),
    "without the checksum": lambda content: content[: content.rfind(MAGIC)],
    "garbage after it": lambda content: content + MAGIC + b"garbage",
}


@pytest.mark.parametrize("spoil", SPOILT.values(), ids=SPOILT)
def test_compact_keeps_the_readable_part_of_a_damaged_file(path, spoil):
    with Cache(path) as cache:
        for number in range(5):
            cache.put(fake_record(number))
        cache.put_table("log", {"gen": [1, 2, 3]}, {"note": "a"})
        cache.put_table("lost", {"gen": [1, 2, 3]})
    cache.put(fake_record(8))
    hurt(path, "evaluations/bowl/values/fitness", 2)
    hurt(path, "lost/gen", 1)
    path.write_bytes(spoil(path.read_bytes()))
    damaged = path.read_bytes()
    assert compact(path) == 5
    assert path.with_name("cache.h5.damaged").read_bytes() == damaged
    assert verify(path).ok
    cache = Cache(path)
    assert payloads(cache.records()) == payloads(fake_record(n) for n in (0, 1, 3, 4, 8))
    assert cache.tables() == ["log"]
    assert cache.table("log").attrs == {"note": "a"}
    path.write_bytes(damaged)
    with pytest.raises(
        InputError, match=r"place for the damaged file must be free; received .*cache\.h5\.damaged"
    ):
        compact(path)
    assert path.read_bytes() == damaged


def test_reading_a_damaged_file_always_ends(path, monkeypatch):
    """The read ends even if HDF5 never returns, and the file is unchanged."""
    with Cache(path) as cache:
        cache.put(fake_record(1))
    before = SPOILT["without the checksum"](path.read_bytes())
    path.write_bytes(before)
    with monkeypatch.context() as patch:
        patch.setattr("tisim.optimize.storage.salvage.TIME_LIMIT", 1e-3)
        with pytest.raises(InputError, match=r"cache\.h5 must be a whole HDF5 file written by a cache"):
            compact(path)
    assert path.read_bytes() == before
    assert not path.with_name("cache.h5.damaged").exists()
    assert compact(path) == 1
