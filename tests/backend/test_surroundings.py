"""The environment of a process: compiler variables, cache folders, limits, the working folder."""

import os
import sys
import tempfile
from pathlib import Path

import pytest

from tisim.backend import kernel_cache, surroundings


@pytest.fixture
def environment(monkeypatch):
    """An environment with only these variables, after it has been prepared for tisim."""

    def prepared(**variables):
        monkeypatch.setattr(os, "environ", dict(variables))
        surroundings.prepare()
        return os.environ

    return prepared


@pytest.mark.parametrize("compiler", ["TI", "QD"])
def test_options_of_the_compilers_are_removed(environment, compiler):
    """All but the kernel cache folder and compile-time limits are removed; these two stay if their values are
    valid."""
    removed = {
        f"{compiler}_{option}": value
        for option, value in {
            "ARCH": "cuda", "DEBUG": "maybe", "DEFAULT_FP": "32", "CPU_MAX_NUM_THREADS": "1",
            "FAST_MATH": "1", "RANDOM_SEED": "x", "ENABLE_PYBUF": "x", "PRINT_IR": "1", "LIB_DIR": "/nowhere",
            "VISIBLE_DEVICE": "x", "OFFLINE_CACHE": "maybe", "ADVANCED_OPTIMIZATION": "x",
        }.items()
    }  # fmt: skip
    kept = {f"{compiler}_OFFLINE_CACHE_FILE_PATH": "/kernels", "TISIM_BACKEND": "taichi", "TITLE": "mine"}
    after = environment(
        HOME="/home/me", QUADRANTS_LOAD_PTX="1", **removed, **kept, **{f"{compiler}_LOG_LEVEL": "x"}
    )
    assert not removed.keys() & after.keys()
    assert "QUADRANTS_LOAD_PTX" not in after
    assert kept.items() <= after.items()
    assert after[f"{compiler}_LOG_LEVEL"] == "warn"
    assert environment(TI_ADVANCED_OPTIMIZATION="0")["TI_ADVANCED_OPTIMIZATION"] == "0"
    # Quadrants without its passes compiles some kernels to nothing, without an error.
    assert "QD_ADVANCED_OPTIMIZATION" not in environment(QD_ADVANCED_OPTIMIZATION="0")


def test_the_cache_folder_is_set_without_home(environment):
    home = Path("~").expanduser() if "HOME" in os.environ else surroundings._home()
    assert "XDG_CACHE_HOME" not in environment(HOME=str(home))
    assert environment(HOME="/home/me", XDG_CACHE_HOME="/caches")["XDG_CACHE_HOME"] == "/caches"
    assert "XDG_CACHE_HOME" not in environment(HOME="/home/me", XDG_CACHE_HOME="")
    for variables in ({}, {"HOME": ""}, {"HOME": "relative"}, {"XDG_CACHE_HOME": "relative"}):
        assert environment(**variables)["XDG_CACHE_HOME"] == str(surroundings._home() / ".cache")


def test_a_user_without_a_home_gets_no_folder(monkeypatch):
    monkeypatch.setattr("pwd.getpwuid", lambda number: {}[number])
    with pytest.raises(OSError, match="Not a directory"):
        surroundings._home().mkdir(parents=True)


def test_a_locale_that_python_does_not_know_is_replaced(environment):
    assert environment(LC_ALL="xx_YY")["LC_ALL"] == "C.UTF-8"
    assert environment(LC_ALL="de_DE.UTF-8")["LC_ALL"] == "de_DE.UTF-8"


def test_a_machine_without_a_folder_for_temporary_files(monkeypatch):
    """The name of this folder is requested on import; only code that makes a file there fails."""

    def none():
        raise FileNotFoundError("No usable temporary directory found")

    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(tempfile, "_get_default_tempdir", none)
    surroundings.prepare()
    assert tempfile.gettempdir() == os.devnull
    with pytest.raises(NotADirectoryError):
        tempfile.mkdtemp()


def test_an_unwritable_cache_is_replaced_or_turned_off(monkeypatch, capsys):
    variable = kernel_cache.LOCKS[kernel_cache.BACKEND][0]
    monkeypatch.setenv(variable, "/dev/null/kernels")
    for cached in (kernel_cache._without, kernel_cache._temporary):
        monkeypatch.setattr(kernel_cache, cached.__name__, cached.__wrapped__)
    folder = kernel_cache._temporary()
    monkeypatch.setattr(kernel_cache, "_temporary", lambda: folder)
    assert kernel_cache.options() == {"offline_cache_file_path": folder.name}
    assert variable not in os.environ, "the compiler warns of a variable beside an option"
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("compiled kernels are not kept for the next process: /dev/null/kernels")
    monkeypatch.setenv(variable, "/dev/null/kernels")

    def none():
        raise FileNotFoundError("no usable temporary directory found")

    monkeypatch.setattr(kernel_cache, "_temporary", none)
    assert kernel_cache.options() == {"offline_cache": False}
    folder.cleanup()


def test_limits_of_memory(monkeypatch, tmp_path):
    """Limits of the process, and of the control groups that contain it, of both versions."""
    path = Path.read_text
    groups = {1: "4:memory,cpu:/batch/job\n0::/", 2: "0::/batch/job\n", 0: "4:cpu:/\n"}
    monkeypatch.setattr(surroundings, "CONTROL_GROUPS", tmp_path)
    monkeypatch.setattr(surroundings.resource, "getrlimit", lambda what: limit)
    for version, (folder, name) in {
        1: ("memory/batch/job", "memory.limit_in_bytes"),
        2: ("batch/job", "memory.max"),
    }.items():
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / name).write_text("max\n" if version == 2 else f"{2**63 - 4096}\n")
        (tmp_path / folder).parent.joinpath(name).write_text(f"{version}000000\n")
    for version, group_limit in ((1, 1_000_000), (2, 2_000_000), (0, sys.maxsize)):
        monkeypatch.setattr(
            Path,
            "read_text",
            lambda file, text=groups[version], **how: (
                text if str(file) == "/proc/self/cgroup" else path(file, **how)
            ),
        )
        limit = (-1, -1)
        assert surroundings.memory_limit() == group_limit
        limit = (500_000, -1)
        assert surroundings.memory_limit() == 500_000


def test_a_removed_working_folder_is_tolerated(tmp_path):
    before = Path.cwd()
    with surroundings.existing_folder():
        assert Path.cwd() == before
    removed = tmp_path / "removed"
    removed.mkdir()
    os.chdir(removed)
    try:
        removed.rmdir()
        with surroundings.existing_folder():
            assert Path.cwd() == Path("/")
        with pytest.raises(FileNotFoundError):
            Path.cwd()
    finally:
        os.chdir(before)
