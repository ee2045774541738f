"""A search.h5 file explains itself to plain h5py, and each write costs only the new data."""

import json
import math
import os
import time

import h5py
import numpy as np
import pytest

from tests.optimize.cache_files import journal_of, lock_of, payloads
from tests.optimize.fake_runs import FakeEvaluator, fake_problem, fake_record
from tisim import InputError
from tisim.files import atomic
from tisim.files.checksum import frame
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.problem.genome import Gene, Genome
from tisim.optimize.problem.objective import Objective
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage import hdf5_store
from tisim.optimize.storage.cache import FOLD_BYTES, FOLD_SHARE, Cache, existing
from tisim.optimize.storage.maintenance import compact, verify
from tisim.optimize.storage.record import Record
from tisim.optimize.storage.runs_table import RunsTable, tabulated

GENOME = Genome((Gene("z speed", "m/s", 1.0, 9.0), Gene("a/b", "", 1e-3, 1.0, "log")))
TWO = (
    Objective("gain", lambda result: result.value[0], "1/s", maximise=True),
    Objective("price", lambda result: result.value[1]),
)
STARTS = EnsembleSettings(min_starts=2, select=0, confirm=0)


def two(design, seed):
    speed, ratio = design.values()
    return "too fast" if speed > 8 else (speed - ratio, speed * ratio + seed % 7)


def searched(path, **settings):
    problem = fake_problem(genome=GENOME, objective=TWO, meanings={"gain": "what is won"})
    with Cache(path) as cache:
        return search(
            problem,
            FakeEvaluator(two),
            cache,
            Settings(**{"seed": 1, "generations": 2, "method": "nsga2", "ensemble": STARTS, **settings}),
        )


def text(dataset):
    return [cell.decode() for cell in dataset[...]]


def test_h5py_shows_the_meaning_of_every_column(path):
    outcome = searched(path)
    records = Cache(path).records()
    with h5py.File(path) as file:
        assert set(file) == {"evaluations", "searches"}
        assert all(part in file.attrs["README"] for part in ("/evaluations/", "/searches/", "journal"))
        runs = file["evaluations/bowl"]
        for name in (*runs["genes"], *runs["values"], *(name for name in runs if name not in "genes values")):
            assert name in file.attrs["README"] or name in ("z speed", "a\u2215b", "gain", "price")
        assert json.loads(runs.attrs["genes"]) == ["z speed", "a/b"]
        speed, ratio = runs["genes/z speed"], runs["genes/a\u2215b"]
        declared = {"unit": "m/s", "low": 1.0, "high": 9.0, "scale": "linear"}
        assert declared.items() <= dict(speed.attrs).items()
        assert {"low": 1e-3, "high": 1.0, "scale": "log"}.items() <= dict(ratio.attrs).items()
        assert "unit" not in ratio.attrs
        gain, price = runs["values/gain"], runs["values/price"]
        told = {"unit": "1/s", "direction": "largest", "statistic": "mean", "description": "what is won"}
        assert dict(gain.attrs) == told
        assert dict(price.attrs) == {"direction": "smallest", "statistic": "mean"}
        assert runs["wall_s"].attrs["unit"] == "s"
        ok = runs["ok"][...] == 1
        assert 0 < np.count_nonzero(ok) < len(ok)
        assert np.array_equal(gain[ok], (speed[...] - ratio[...])[ok])
        assert np.isnan(price[~ok]).all()
        assert set(text(runs["reason"])) == {"", "too fast"}
        assert sorted(set(runs["start"][...])) == [0, 1]
        assert text(runs["key"]) == [record.key for record in records]
        found = file[outcome.name]
        assert found.attrs["problem"] == "bowl"
        assert found.attrs["stopped"] == "generations"
        assert text(found["genes/name"]) == ["z speed", "a/b"]
        assert text(found["objectives/direction"]) == ["largest", "smallest"]
        hall = found["hall_of_fame"]
        assert hall["z speed (m\u2215s)"].attrs["unit"] == "m/s"
        assert hall["gain (1\u2215s)"].attrs["unit"] == "1/s"
        assert list(hall["front"]) == list(range(1, len(outcome.hall) + 1))
        assert found["logbook/best gain (1\u2215s)"].attrs["unit"] == "1/s"
        assert list(found["logbook/gen"]) == [0, 1, 2]


def test_the_file_exists_from_the_start_and_is_updated(path, monkeypatch):
    monkeypatch.setattr("tisim.optimize.storage.cache.FOLD_BYTES", 3000)
    seen = []

    class Watched(FakeEvaluator):
        def evaluate(self, scenes, progress):
            with h5py.File(path) as file:
                part = file["evaluations"].get("bowl")
                seen.append((0 if part is None else len(part["key"]), list(file["searches"])))
            return super().evaluate(scenes, progress)

    with Cache(path) as cache:
        outcome = search(fake_problem(2), Watched(), cache, Settings(seed=1, generations=6))
    name = outcome.name.removeprefix("searches/")
    assert all(searches == [name] for _, searches in seen)
    counts = [count for count, _ in seen]
    assert counts[0] == 0 < counts[-1] == max(counts)


KINDS = {"n": 3, "shape": "ö/wide", "hollow": True, "x": 0.1}


def run_of(number, problem="mixed", values=None, ok=True, **design):
    return Record(
        key=f"{problem} {number}",
        problem=problem,
        values={"mass": 1.5 * number, "spread": math.inf} if values is None else values,
        ok=ok,
        reason="" if ok else "ü broke",
        seed=number,
        design={**KINDS, **design},
        work={"steps": number},
        wall_s=0.5,
        created=1e9,
        start=number,
    )


def test_integers_texts_and_flags_are_genes(path):
    records = [run_of(0), run_of(1, n=-(2**62), shape=""), run_of(2, hollow=False, values={}, ok=False)]
    with Cache(path) as cache:
        for record in records[:2]:
            cache.put(record)
        cache.fold()
        cache.put(records[2])
        assert Cache(path).records() == records
    for found in (existing(path).records(), Cache(path).records()):
        assert found[:2] == records[:2]
        assert [list(record.design) for record in found] == [list(KINDS)] * 3
        assert [type(value) for value in found[2].design.values()] == [int, str, bool, float]
        assert list(found[2].values) == ["mass", "spread"], "what a failed run does not have is NaN"
        assert np.isnan(list(found[2].values.values())).all()
    assert verify(path).ok
    with h5py.File(path) as file:
        assert [file["evaluations/mixed/genes"][name].dtype.kind for name in KINDS] == ["i", "S", "b", "f"]
    for bad, rule in (({"n": 2**63}, "an integer of 64 bits"), ({"shape": "a\0b"}, "a text without a NUL")):
        with pytest.raises(InputError, match=rule):
            run_of(0, **bad)


def test_whole_numbers_beside_reals_are_stored_as_reals(path):
    with Cache(path) as cache:
        cache.put(run_of(0, n=3))
        cache.fold()
        cache.put(run_of(1, n=2.5))
        cache.put(run_of(2, n=7))
    assert [record.design["n"] for record in Cache(path).records()] == [3.0, 2.5, 7.0]
    with h5py.File(path) as file:
        assert list(file["evaluations"]) == ["mixed"]
    assert verify(path).ok


def test_later_quantities_are_columns_of_the_same_table(path):
    with Cache(path) as cache:
        cache.put(run_of(0, values={"mass": 1.0}))
        cache.fold()
        cache.put(run_of(1, values={"speed": 2.0, "mass": 3.0}))
    with h5py.File(path) as file:
        values = file["evaluations/mixed/values"]
        assert list(values["mass"]) == [1.0, 3.0]
        assert np.array_equal(values["speed"], [np.nan, 2.0], equal_nan=True)
    again = Cache(path)
    again.put(run_of(0, values={"mass": 1.0}))
    assert verify(path).ok


def test_problems_and_designs_of_other_genes_have_groups_of_their_own(path):
    other = Record(**{**vars(run_of(1)), "key": "other", "design": {"x": 1.0}})
    records = [run_of(0), other, run_of(0, problem="second"), run_of(2)]
    with Cache(path) as cache:
        for record in records:
            cache.put(record)
    with h5py.File(path) as file:
        lengths = {name: len(group["key"]) for name, group in file["evaluations"].items()}
    assert lengths == {"mixed": 2, "mixed (2)": 1, "second": 1}
    assert payloads(Cache(path).records()) == payloads(records)
    assert compact(path) == 4


@pytest.mark.parametrize("name", [".", "a/b", "a\u2215b", "ä", "x" * 300, "a\0b"])
def test_genes_and_values_may_have_any_name(path, name):
    genes = {name: 0.5, "a\u2215b'": 1.0, "a/b'": 2.0}
    record = Record(**{**vars(run_of(0)), "design": genes, "values": {name: 2.0}})
    with Cache(path) as cache:
        cache.put(record)
        cache.put_table("t", {name: [1.0], "b": [2.0]}, about={name: {"unit": "m"}})
        table = cache.table("t")
    assert Cache(path).records() == [record]
    assert Cache(path).table("t") == table
    assert verify(path).ok


def test_opening_a_file_reads_no_records(path, monkeypatch):
    records = [fake_record(number) for number in range(500)]
    path.write_bytes(hdf5_store.build_image(tabulated([], records), {}))
    made = []
    record = RunsTable.record
    monkeypatch.setattr(RunsTable, "record", lambda self, row: made.append(row) or record(self, row))
    with Cache(path) as cache:
        assert len(cache) == 500
        cache.put_table("log", {"gen": [1]})
        cache.fold()
        assert made == []
        assert cache.get(records[77].key) == records[77]
        assert made == [77]
    assert verify(path).rows == 500


@pytest.fixture
def written(monkeypatch):
    """Bytes written to each file since it was last emptied, by name."""
    sizes = {}
    write = atomic.write_at

    def counted(handle, data, offset):
        name = os.path.basename(os.readlink(f"/proc/self/fd/{handle}"))  # noqa: PTH115, PTH119
        sizes[name] = sizes.get(name, 0) + len(data)
        write(handle, data, offset)

    monkeypatch.setattr(atomic, "write_at", counted)
    return sizes


def generation(cache, number, log, size=20):
    for k in range(size):
        cache.put(fake_record(1000 * number + k))
    log["gen"].append(number)
    log["best"].append(1 / (number + 1))
    cache.put_table("searches/a", {}, {"settings": "x" * 500})
    cache.put_table("searches/a/logbook", log, about={"best": {"unit": "m"}})


def test_a_generation_writes_only_new_data(path, written):
    """Bytes written by a generation of 20 runs, after 300 other runs and after 20000 and a long logbook."""
    costs = {}
    for runs, generations in ((300, 3), (20000, 2000)):
        file = path.with_name(f"{runs}.h5")
        log = {"gen": list(range(generations)), "best": [1 / (k + 1) for k in range(generations)]}
        with Cache(file) as cache:
            records = [fake_record(10**9 + number) for number in range(runs)]
            file.write_bytes(hdf5_store.build_image(tabulated([], records), {}))
            cache.put_table("searches/a", {}, {"settings": "x" * 500})
            cache.put_table("searches/a/logbook", log, about={"best": {"unit": "m"}})
            cache.fold()
            written.clear()
            generation(cache, generations, log)
            costs[runs] = sum(written.values())
            assert list(written) == [f"{runs}.h5.journal"]
            assert len(Cache(file).table("searches/a/logbook")) == generations + 1
    assert costs[20000] < 1.05 * costs[300] < 10_000


@pytest.mark.slow
def test_a_hundred_thousand_runs_are_opened_in_less_than_a_second(path):
    """Ten genes, with a journal that is almost due for folding."""
    rng = np.random.default_rng(1)
    genes = [f"gene {number}" for number in range(10)]
    records = [
        Record(
            **{**vars(fake_record(number)), "design": dict(zip(genes, rng.random(10).tolist(), strict=True))}
        )
        for number in range(108_000)
    ]
    path.write_bytes(hdf5_store.build_image(tabulated([], records[:100_000]), {}))
    frames = b"".join(frame(record.payload()) for record in records[100_000:])
    for journal in (b"", frames):
        assert len(journal) < FOLD_SHARE * path.stat().st_size
        journal_of(path).write_bytes(journal)
        began = time.perf_counter()
        cache = Cache(path)
        seconds = time.perf_counter() - began
        assert cache.get(records[77].key) == records[77]
        print(f"{len(cache)} runs are opened in {seconds:.2f} s")
        assert seconds < 1


def test_writing_amounts_to_a_few_times_the_stored_data(path, written, monkeypatch):
    monkeypatch.setattr("tisim.optimize.storage.cache.FOLD_BYTES", 3000)
    log, totals = {"gen": [], "best": []}, []
    cache = Cache(path)
    for number in range(120):
        generation(cache, number, log)
        totals.append((sum(written.values()), written["cache.h5.journal"]))
    (half, half_stored), (total, stored) = totals[59], totals[-1]
    assert total < 6 * stored
    assert (total - half) / (stored - half_stored) < 1.5 * half / half_stored, "does not grow with the file"
    with h5py.File(path) as file:
        on_disk = len(file["evaluations/bowl/key"])
    assert on_disk > 0.75 * len(cache) > 1000, "and the file is not far behind"
    assert FOLD_SHARE == 0.25
    assert FOLD_BYTES < 1e5


def test_folded_rows_that_are_also_in_the_journal_count_once(path):
    """As after a kill between the replacement of the file and the emptying of the journal, for any state of
    the table."""
    nan = float("nan")
    steps = [{"g": [0, 1], "v": [nan, 2.0]}, {"g": [0, 1, 2], "v": [nan, 2.0, 3.0]}, {"g": [5], "v": [0.5]},
             {"g": [5, 6], "v": [0.5, nan]}]  # fmt: skip
    for count in range(1, len(steps) + 1):
        for folded in range(count + 1):
            with Cache(path) as cache:
                for number, table in enumerate(steps[:count]):
                    if number == folded:
                        cache.fold()
                    cache.put_table("log", table)
                    assert repr(Cache(path).table("log").columns) == repr(table)
                before = journal_of(path).read_bytes()
            journal_of(path).write_bytes(before)
            assert repr(Cache(path).table("log").columns) == repr(steps[count - 1]), (count, folded)
            assert verify(path).ok
            for file in (path, journal_of(path), lock_of(path)):
                file.unlink()


def test_rows_of_a_table_that_are_cut_off_or_damaged_are_reported(path):
    cache = Cache(path)
    log = {"g": [0, 1]}
    cache.put_table("log", log)
    size = journal_of(path).stat().st_size
    log["g"].append(2)
    cache.put_table("log", log)
    whole = journal_of(path).read_bytes()
    journal_of(path).write_bytes(whole[:-1])
    cut = f"journal, byte {size}: rows of a table cut off, {len(whole) - size} bytes"
    assert verify(path).damaged == [cut]
    hit = bytearray(whole)
    hit[size // 2] ^= 1
    journal_of(path).write_bytes(hit)
    assert verify(path).damaged == ["journal, byte 0: not a whole record"]
    with pytest.warns(RuntimeWarning, match="1 damaged"):
        cache = Cache(path)
    assert cache.tables() == []
    cache.put_table("log", log)
    assert cache.table("log").columns == log


def test_rows_after_lost_rows_are_left_out(path):
    cache, log, ends = Cache(path), {"g": []}, []
    for number in range(5):
        log["g"].append(number)
        cache.put_table("log", log)
        ends.append(journal_of(path).stat().st_size)
    hit = bytearray(journal_of(path).read_bytes())
    hit[ends[2] - 1] ^= 1
    journal_of(path).write_bytes(hit)
    with pytest.warns(RuntimeWarning, match="1 damaged"):
        cache = Cache(path)
    assert cache.table("log").columns == {"g": [0, 1]}
    cache.put_table("log", log)
    assert cache.table("log").columns == log


def test_a_repeated_run_counts_once(path):
    records = [run_of(0), run_of(1), run_of(0, values={"mass": 9.0}), run_of(2)]
    path.write_bytes(hdf5_store.build_image(tabulated([], records), {}))
    report = verify(path)
    assert (report.rows, report.duplicates, report.conflicts) == (4, 1, ["mixed 0"])
    assert Cache(path).get("mixed 0").values["mass"] == 0.0
    assert compact(path) == 3
    assert [record.seed for record in Cache(path).records()] == [0, 1, 2]
    assert verify(path).ok
