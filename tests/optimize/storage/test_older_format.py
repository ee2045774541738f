"""A file of the previous format is read, and rewritten at the first fold."""

import io
import json
import math
import zlib

import h5py
import numpy as np
import pytest

from tests.optimize.cache_files import hurt, journal_of
from tests.optimize.fake_runs import FakeEvaluator, fake_problem
from tisim.files.checksum import frame, with_checksum
from tisim.optimize.search import search
from tisim.optimize.search_records import searches
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.maintenance import compact, verify
from tisim.optimize.storage.record import canonical

IDENTITY = {"problem": "old", "gene_order": ["z", "a"], "objective_order": ["gain", "price"]}
ROWS = [
    {
        "key": f"{k:064x}", "problem": "old", "fitness": None if k == 2 else k / 7, "ok": k != 2,
        "reason": "broke" if k == 2 else "", "seed": 10 + k, "design": {"a": k / 3, "z": 1.0},
        "work": {"steps": k}, "wall_s": 0.5, "created": 1e9 + k, "others": [None if k == 2 else -1.0],
    }
    for k in range(6)
]  # fmt: skip
TEXT = ("key", "problem", "reason", "design", "work", "others")


def old_table(file, name, columns, attrs):
    group = file.require_group(name)
    for heading, column in columns.items():
        group[heading] = np.asarray(column)
    group.attrs.update(attrs)
    group.attrs["columns"] = json.dumps(list(columns))
    group.attrs["crc32"] = zlib.crc32(canonical([list(columns), columns, attrs]))


def old_file(path, rows, identity=IDENTITY):
    """Write rows in the previous format: fixed-length text columns, designs as JSON, unnamed objectives."""
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        file.attrs["format"] = "tisim evaluations 1"
        group = file.create_group("evaluations")
        for name in TEXT:
            cells = [row.get(name, []) for row in rows]
            texts = [cell.encode() if isinstance(cell, str) else canonical(cell) for cell in cells]
            kind = h5py.string_dtype("utf-8", max(1, *map(len, texts)))
            if name != "others" or any(cells):
                group[name] = np.array(texts, dtype=kind)
        fitness = [math.nan if row["fitness"] is None else row["fitness"] for row in rows]
        numbers = {"fitness": fitness, "ok": np.array([row["ok"] for row in rows], np.uint8)}
        for name in ("seed", "wall_s", "created"):
            numbers[name] = [row[name] for row in rows]
        for name, column in numbers.items():
            group[name] = column
        group["crc"] = np.array([zlib.crc32(canonical(row)) for row in rows], dtype=np.uint32)
        if identity is not None:
            attrs = {"identity": canonical(identity).decode(), "stopped": "target"}
            old_table(file, "searches/old-1", {}, attrs)
            old_table(file, "searches/old-1/logbook", {"gen": [0, 1], "best": [0.5, 0.25]}, {})
        file.flush()
        found = []
        file.visititems(lambda _, item: found.append(item) if isinstance(item, h5py.Dataset) else None)
        data = [(one.id.get_offset() or 0, one.id.get_storage_size()) for one in found]
    path.write_bytes(with_checksum(image.getvalue(), data))


def check(records):
    assert [record.key for record in records] == [row["key"] for row in ROWS]
    for record, row in zip(records, ROWS, strict=True):
        assert list(record.design.items()) == [("z", 1.0), ("a", row["design"]["a"])]
        assert list(record.values) == ["gain", "price"]
        if record.ok:
            assert record.values == {"gain": row["fitness"], "price": -1.0}
        else:
            assert np.isnan(list(record.values.values())).all()
        for name in ("ok", "reason", "seed", "work", "wall_s", "created"):
            assert getattr(record, name) == row[name]
        assert record.start == -1


def test_runs_and_tables_are_taken_over(path):
    old_file(path, ROWS[:4])
    journal_of(path).write_bytes(b"".join(frame(canonical(row)) for row in ROWS[4:]))
    before = path.read_bytes()
    assert (verify(path).ok, verify(path).rows, verify(path).journal) == (True, 4, 2)
    cache = Cache(path)
    check(cache.records())
    assert path.read_bytes() == before, "reading changes nothing"
    cache.close()
    with h5py.File(path) as file:
        assert file.attrs["format"] == "tisim evaluations 2"
        assert list(file["evaluations/old/genes/z"]) == [1.0] * 6
    assert verify(path).ok
    cache = Cache(path)
    check(cache.records())
    assert cache.table("searches/old-1/logbook").columns == {"gen": [0, 1], "best": [0.5, 0.25]}
    assert searches(cache)["searches/old-1"]["stopped"] == "target"


def test_runs_of_one_objective(path):
    rows = [{name: value for name, value in row.items() if name != "others"} for row in ROWS]
    old_file(path, rows, {"problem": "old", "objective_order": ["Pi"]})
    assert compact(path) == 6
    assert [list(record.values) for record in Cache(path).records()] == [["Pi"]] * 6


@pytest.mark.parametrize("column", ["key", "fitness", "design", "others", "crc"])
def test_damage_loses_one_row(path, column):
    old_file(path, ROWS)
    hurt(path, f"evaluations/{column}", 1)
    assert verify(path).damaged == ["row 1: its checksum does not fit"]
    with pytest.warns(RuntimeWarning, match="1 damaged"):
        assert len(Cache(path)) == 5


def test_a_completely_damaged_file_is_salvaged(path):
    old_file(path, ROWS)
    path.write_bytes(path.read_bytes()[:-5])
    assert compact(path) == 6
    check(Cache(path).records())


@pytest.mark.parametrize("identity", [None, {**IDENTITY, "objective_order": ["one"]}])
def test_runs_with_unnamed_objectives_are_reported_and_repeated(path, identity):
    old_file(path, ROWS, identity)
    told = "no search in the file names its objectives"
    assert verify(path).damaged == [f"row {k}: {told}" for k in range(6)]
    with pytest.warns(RuntimeWarning, match=r"6 damaged evaluation\(s\) are ignored and will be run again"):
        assert len(Cache(path)) == 0


def test_a_search_of_the_previous_version_continues(path):
    """An unfinished search of the previous version continues, and none of its runs is repeated."""
    settings, problem = Settings(seed=3, generations=3), fake_problem(2)
    with Cache(path) as cache:
        whole = search(problem, FakeEvaluator(), cache, settings)
        identity = dict(whole.identity)
        rows = [
            {
                **{name: value for name, value in vars(record).items() if name not in ("values", "start")},
                "fitness": record.values["fitness"],
            }
            for record in cache.records()
        ]
    for file in (path, journal_of(path)):
        file.unlink()
    old_file(path, rows[:100], identity)
    evaluator = FakeEvaluator()
    with Cache(path) as cache:
        again = search(problem, evaluator, cache, settings)
    assert again.designs == whole.designs
    assert len(evaluator.digests) == whole.evaluations - 100
    assert verify(path).ok
    with h5py.File(path) as file:
        assert len(file["evaluations/bowl/key"]) == whole.evaluations
