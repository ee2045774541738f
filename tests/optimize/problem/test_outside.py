"""Whatever a function reads while it runs is noticed, so that no stored value is used for another target."""

import _thread
import contextlib
import mmap
import multiprocessing
import os
import pathlib
import platform
import socket
import sqlite3
import subprocess
import sys
import threading
import urllib.request

import h5py
import numpy as np
import pytest

from tisim import InputError, optimize
from tisim.optimize import Gene, Problem
from tisim.optimize.problem.outside import noticed

ONE = (Gene("x", "", 0.0, 1.0),)


@pytest.fixture
def target(tmp_path):
    path = tmp_path / "target.txt"
    path.write_text("0.5\n")
    return path


def by_sqlite(path):
    sqlite3.connect(path).close()


def by_sqlite_address(path):
    sqlite3.connect(f"file:{path}?mode=ro", uri=True).close()


def by_hdf5(path):
    with h5py.File(path.with_suffix(".h5")):
        pass


def by_low_hdf5(path):
    h5py.h5f.open(os.fsencode(path.with_suffix(".h5"))).close()


def by_thread(path):
    thread = threading.Thread(target=path.read_text)
    thread.start()
    thread.join()


def by_map(path):
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        data.read()


def by_number(path):
    os.close(os.open(path, os.O_RDONLY))


def by_pandas(path):
    pytest.importorskip("pandas").read_csv(path)


def by_appending(path):
    with path.open("a+") as file:
        file.seek(0)
        file.read()


def after_appending(path):
    with path.open("a") as file:
        file.write(" ")
    path.read_text()


def by_link(path):
    link = path.with_name("link")
    link.symlink_to(path)
    link.read_text()
    link.unlink()


def within_another_function(path):
    with noticed():
        pass
    path.read_text()


READERS = (
    by_sqlite, by_sqlite_address, by_hdf5, by_low_hdf5, by_thread, by_map, by_number, by_pandas, np.loadtxt,
    pathlib.Path.read_text, by_appending, after_appending, by_link, within_another_function,
    lambda path: urllib.request.urlopen(path.as_uri()).close(), lambda path: np.memmap(path, "u1", "r"),
)  # fmt: skip


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.__name__)
def test_a_file_that_is_read_is_noticed(target, reader):
    with h5py.File(target.with_suffix(".h5"), "w") as file:
        file["a"] = 1.0
    with noticed() as found:
        reader(target)
    assert {path.stem for path in found.files} == {"target"}


def test_a_source_that_is_read_as_data_is_noticed_but_not_its_import(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    source = tmp_path / "own_source_of_data.py"
    source.write_text("T = 1.0\n")
    with noticed() as found:
        __import__("own_source_of_data")
    assert not found.files
    with noticed() as found:
        source.read_text()
    assert found.files == {source}


def test_own_files_and_threads_of_others_do_not_count(target):
    made = target.with_suffix(".h5")

    def function():
        with h5py.File(made, "w") as file:
            file["a"] = 1.0
        by_hdf5(target)
        with sqlite3.connect(target.with_suffix(".db")) as base:
            base.execute("create table t(a)")
        base.close()
        by_sqlite(target.with_suffix(".db"))

    begin, done = threading.Event(), threading.Event()

    def other():
        begin.wait()
        target.read_text()
        done.set()

    thread = threading.Thread(target=other)
    thread.start()
    with noticed() as found:
        function()
        begin.set()
        done.wait()
    thread.join()
    assert (found.files, found.sources) == (set(), [])


def connect():
    with socket.socket() as one:
        one.settimeout(0.1)
        one.connect(("127.0.0.1", 9))


def spawn():
    process = multiprocessing.get_context("spawn").Process(target=print)
    process.start()
    process.join()


def low_thread():
    lock = _thread.allocate_lock()
    lock.acquire()
    _thread.start_new_thread(lock.release, ())
    lock.acquire()


SOURCES = {
    "the program true": lambda: subprocess.run(["true"], check=False),
    "the program exit 0": lambda: os.system("exit 0"),
    "the program /bin/true": lambda: os.waitpid(os.posix_spawn("/bin/true", ["true"], {}), 0),
    "the connection ('127.0.0.1', 9)": connect,
    "a process": spawn,
    "a thread of the module _thread": low_thread,
}


@pytest.mark.skipif(sys.platform == "win32", reason="programs of Linux")
@pytest.mark.parametrize("name", SOURCES)
def test_other_sources_are_refused_unless_their_files_or_a_code_are_given(target, name):
    def function(design):
        with contextlib.suppress(OSError):
            SOURCES[name]()
        return design["x"]

    settings = {"method": "random", "generations": 0, "options": {"population": 2}}
    with pytest.raises(InputError) as refused:
        optimize.run(Problem.of_function(function, ONE), **settings)
    assert str(refused.value) == (
        "objective value must start no program and open no connection, as its values are used again; "
        f"received {name}. Or list the files that it reads in Problem(files=[...]), or give "
        "Problem(code=...), a text that you change with its answers"
    )
    if name == "the program true":
        for more in ({"files": [target]}, {"code": "1"}):
            assert optimize.run(Problem.of_function(function, ONE, **more), **settings).best is not None


def test_files_read_before_a_refusal_count(target):
    def function(design):
        if design["x"] < float(target.read_text()):
            raise InputError("x must be large; received little")
        return design["x"]

    problem = Problem.of_function(function, [Gene("x", "", 0.0, 0.4)])
    with pytest.raises(InputError, match=r"^function function must read no file but those in Problem\(files"):
        optimize.run(problem, generations=0)


def test_machine_inquiries_of_python_are_no_programs():
    with noticed() as found:
        platform._Processor.from_subprocess()
    assert found.sources == []


def test_nothing_is_recorded_outside_of_a_call(target):
    with noticed() as found:
        pass
    target.read_text()
    assert not found.files
