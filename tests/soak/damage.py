"""Damaged files of every kind, from tisim and from other programs.

Each is read unchanged, refused with a message, or read in part with a remark. It is never read with other
numbers, and reading always ends.
"""

from __future__ import annotations

import multiprocessing
import traceback
import warnings
import zlib
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.soak.counts import Counts

FILES = 500
"""Number of damaged files of each kind."""
PATIENCE = 40.0
"""Time (s) after which a read counts as hung; reading an undamaged file takes a few hundredths of a
second."""
BLOCK = 4096
"""bytes, the largest stretch damaged at once: a system page"""


class Kind(NamedTuple):
    """A kind of file: ``make`` writes one into a folder and returns its path, and ``read`` returns its
    contents.

    The contents are in parts, each of which is complete or missing. Files of other programs (``ours`` is
    False) have no checksums: changed numbers in them are read unnoticed, but reading must end, possibly with
    a message.
    """

    make: Callable[[Path], Path]
    read: Callable[[Path], list[str]]
    ours: bool = True


def _grains():
    from tests.scenes import scene

    return scene([(0, 0, 0), (5e-3, 0, 0)], [(1, 0, 0), (0, 0, 0)], dt=1e-6, steps=5)


def _still():
    from tests.files.test_growing_hdf5 import STILL

    return STILL


def _trajectory(folder: Path) -> Path:
    from tests.files.test_growing_hdf5 import frame
    from tisim.io.trajectory import Trajectory

    with Trajectory(folder / "trajectory.h5", [_still()]) as trajectory:
        for k in range(40):
            trajectory.write(0, frame(k))
    return folder / "trajectory.h5"


def _result(folder: Path) -> Path:
    from tests.files.test_growing_hdf5 import frame
    from tisim import Result, Status
    from tisim.io.run_folder import write_result

    start, end = frame(0).arrays, frame(1).arrays
    result = Result(_still(), end, start, 1.0, {"steps": 3}, Status(True, "reached its end"), 0.1)
    write_result(result, folder / "result.h5")
    return folder / "result.h5"


def _frames(path: Path) -> list[str]:
    from tisim.io.reader import frames

    with frames(path) as sequence:
        return [
            sequence.scene.digest(),
            *(_digest(f.time, f.step, *sorted(f.arrays.items())) for f in sequence),
        ]


def _digest(*values: object) -> str:
    return " ".join(
        str(zlib.crc32(v[1].tobytes())) + v[0] if isinstance(v, tuple) else repr(v) for v in values
    )


_simulations: list = []


def _simulation():
    from tisim import Simulation

    if not _simulations:
        _simulations.append(Simulation(_grains()))
    _simulations[0].load([_grains()])
    return _simulations[0]


def _checkpoint(folder: Path) -> Path:
    from tisim.engine.checkpoint import save

    simulation = _simulation()
    simulation.run(steps=3)
    save(simulation, folder / "checkpoint.h5")
    return folder / "checkpoint.h5"


def _restore(path: Path) -> list[str]:
    from tisim.engine.checkpoint import restore

    simulation = _simulation()
    restore(simulation, path)
    result = simulation.results()[0]
    return [_digest(result.time, result.work, *sorted(result.state.items()))]


def _study():
    from tisim.accuracy import Study

    return Study(_grains())


def _cost(folder: Path) -> Path:
    from tisim.accuracy import Row, storage

    study = _study()
    for k in range(20):
        errors = tuple((1 / (k + 3), 1 / (k + 7)) for _ in study.quantities)
        study.rows.append(
            Row("Verlet", f"dt={k}", "Verlet()", "--set", "f64", 1, (0.1 * k,), k, k, 0.0, errors)
        )
    storage.write(study, folder)
    return folder / "cost.h5"


def _rows(path: Path) -> list[str]:
    from tisim.accuracy import storage

    study = _study()
    storage.resume(study, path.parent)
    return [repr(row) for row in study.rows]


def _record(k: int):
    from tisim.optimize.storage.record import Record

    values = {"fitness": 1 / (k + 3)}
    return Record(f"{k:064x}", "soak", values, True, "", k, {"x": k / 7}, {"steps": k}, 0.1, 1e9 + k, k)


def _journal(folder: Path) -> Path:
    from tisim.optimize.storage.cache import Cache

    cache = Cache(folder / "search.h5")
    for k in range(20):
        cache.put(_record(k))
    return folder / "search.h5.journal"


def _search(folder: Path) -> Path:
    from tisim.optimize.storage.cache import Cache

    with Cache(folder / "search.h5") as cache:
        for k in range(20):
            cache.put(_record(k))
        cache.put_table("log", {"generation": list(range(9)), "best": [1 / (k + 1) for k in range(9)]})
    return folder / "search.h5"


def _records(path: Path) -> list[str]:
    from tisim.optimize.storage.cache import existing

    cache = existing(path.parent / "search.h5")
    tables = [repr(cache.table(name)) for name in cache.tables()]
    return [*(repr(record.payload()) for record in cache.records()), *tables]


def _ball():
    """Corners of the triangles of a rough ball (m), shape (triangles, 3, 3)."""
    from scipy.spatial import ConvexHull

    places = np.random.default_rng(1).normal(size=(60, 3))
    places *= 1e-2 / np.linalg.norm(places, axis=1)[:, None]
    return places[ConvexHull(places).simplices]


def _text_stl(folder: Path) -> Path:
    facets = (
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in corners)
        + "endloop\nendfacet\n"
        for corners in _ball()
    )
    (folder / "ball.stl").write_text(f"solid ball\n{''.join(facets)}endsolid ball\n")
    return folder / "ball.stl"


def _binary_stl(folder: Path) -> Path:
    corners = _ball()
    facets = np.zeros(len(corners), [("numbers", "<f4", (4, 3)), ("attribute", "<u2")])
    facets["numbers"][:, 1:] = corners
    content = bytes(80) + np.uint32(len(corners)).tobytes() + facets.tobytes()
    (folder / "ball.stl").write_bytes(content)
    return folder / "ball.stl"


def _indexed(folder: Path, name: str, head: str, vertex: str, face: str, first: int) -> Path:
    """A mesh as a list of vertices and a list of faces, with indices that start at ``first``."""
    corners = _ball()
    vertices = "".join(f"{vertex}{x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in corners.reshape(-1, 3))
    places = np.arange(corners.shape[0] * 3).reshape(-1, 3) + first
    faces = "".join(f"{face}{a} {b} {c}\n" for a, b, c in places)
    (folder / name).write_text(head.format(vertices=3 * len(corners), faces=len(corners)) + vertices + faces)
    return folder / name


PLY = (
    "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
)


def _surface(path: Path) -> list[str]:
    from tisim.geometry import TriangulatedSurface

    surface = TriangulatedSurface.read(path)
    return [_digest(*sorted(surface.lookups().items()))]


def _measurements(folder: Path) -> Path:
    lines = ("quantity,value,uncertainty", "angle_of_repose,24.5,1.0", "discharge_rate,0.15,0.005")
    (folder / "mine.csv").write_text("\n".join((*lines, "sliding_angle,22,1", "")))
    return folder / "mine.csv"


def _calibration(path: Path) -> list[str]:
    from tisim.cases.granular_bench.problem import read

    return [repr(sorted(read(path).items()))]


KINDS = {
    "result.h5": Kind(_result, _frames),
    "trajectory.h5": Kind(_trajectory, _frames),
    "checkpoint.h5": Kind(_checkpoint, _restore),
    "cost.h5": Kind(_cost, _rows),
    "search.h5": Kind(_search, _records),
    "journal of a search": Kind(_journal, _records),
    "STL, text": Kind(_text_stl, _surface, ours=False),
    "STL, binary": Kind(_binary_stl, _surface, ours=False),
    "OBJ": Kind(lambda folder: _indexed(folder, "ball.obj", "", "v ", "f ", 1), _surface, ours=False),
    "PLY": Kind(lambda folder: _indexed(folder, "ball.ply", PLY, "", "3 ", 0), _surface, ours=False),
    "measurements": Kind(_measurements, _calibration, ours=False),
}


def with_mishap(content: bytes, rng: np.random.Generator) -> bytes:
    """The bytes after one mishap: flipped bits, a zeroed or overwritten stretch, truncation, or two swapped
    stretches."""
    hurt, size = bytearray(content), len(content)
    at, other = (int(x) for x in rng.integers(size, size=2))
    length = int(min(rng.choice([1, 16, 512, BLOCK]), size - max(at, other)))
    mishap = int(rng.integers(6))
    if mishap == 0:
        hurt[at] ^= 1 << int(rng.integers(8))
    elif mishap == 1:
        for place in rng.integers(size, size=3):
            hurt[place] ^= 1 << int(rng.integers(8))
    elif mishap == 2:
        hurt[at : at + length] = bytes(length)
    elif mishap == 3:
        hurt[at : at + length] = rng.bytes(length)
    elif mishap == 4:
        del hurt[at:]
    else:
        one, two = bytes(hurt[at : at + length]), bytes(hurt[other : other + length])
        hurt[at : at + length], hurt[other : other + length] = two, one
    return bytes(hurt) if bytes(hurt) != content else with_mishap(content, rng)


def verdict(kind: Kind, path: Path, whole: list[str] | None) -> tuple[str, object]:
    """Outcome of reading a file: the name of a column of Counts or "", and the contents."""
    from tisim import InputError

    with warnings.catch_warnings(record=True) as messages:
        warnings.simplefilter("always")
        try:
            content = kind.read(path)
        except InputError as error:
            return ("", str(error)) if "\n" not in str(error) else ("tracebacks", str(error))
        except BaseException:
            return "tracebacks", traceback.format_exc()
    if whole is None or content == whole or not kind.ours:
        return "", content
    if set(content) <= set(whole) and len(set(content)) == len(content):
        return ("" if messages else "lost"), content
    return "wrong", content


def _reader(pipe: Connection) -> None:
    """Makes and reads files on request, in a separate process."""
    from tisim.backend import runtime

    runtime.init(threads=1)
    while True:
        name, action, path, whole = pipe.recv()
        if action == "make":
            pipe.send(KINDS[name].make(path))
        else:
            pipe.send(verdict(KINDS[name], path, whole))


class Reader:
    """A process that reads files and is replaced if it hangs or crashes."""

    def __init__(self) -> None:
        self.process: multiprocessing.process.BaseProcess | None = None

    def __call__(self, name: str, action: str, path: Path, whole: object = None, patience: float = PATIENCE):
        """The answer of the process, or "hung" or "tracebacks" with the reason."""
        if self.process is None:
            context = multiprocessing.get_context("spawn")
            self.pipe, end = context.Pipe()
            self.process = context.Process(target=_reader, args=(end,), daemon=True)
            self.process.start()
            end.close()
        self.pipe.send((name, action, path, whole))
        try:
            if self.pipe.poll(patience):
                return self.pipe.recv()
            answer = "hung", f"no answer within {patience:g} s"
        except EOFError:
            self.process.join()
            answer = "tracebacks", f"ended with exit code {self.process.exitcode}"
        self.end()
        return answer

    def end(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.pipe.close()
            self.process = None


def soak(seed: int, share: float, folder: Path) -> Iterator[Counts]:
    """Counts of damaged files, one for each kind; failures are printed above them."""
    reader = Reader()
    try:
        for k, name in enumerate(KINDS):
            yield _count(name, np.random.default_rng([seed, k]), round(FILES * share), folder / name, reader)
    finally:
        reader.end()


def _count(name: str, rng: np.random.Generator, number: int, folder: Path, reader: Reader) -> Counts:
    counts = Counts(f"damaged {name}")
    folder.mkdir(parents=True)
    path = reader(name, "make", folder, patience=600.0)
    content = path.read_bytes()
    _, whole = reader(name, "read", path, patience=600.0)
    # Otherwise all later reads would be refused, as they should be, and no error would be found.
    assert isinstance(whole, list), f"the undamaged {name} is not read: {whole}"
    for _ in range(number):
        path.write_bytes(with_mishap(content, rng))
        counts.trials += 1
        column, why = reader(name, "read", path, whole)
        if column:
            setattr(counts, column, getattr(counts, column) + 1)
            print(f"{name}: {column}: {str(why)[-1500:]}", flush=True)
    return counts
