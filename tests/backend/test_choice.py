"""The choice of the kernel compiler, for every processor and set of installed packages; messages to
the user."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tisim import InputError
from tisim.backend import choice, processor
from tisim.backend.taichi import BACKEND
from tisim.describe.diagnostics import llvm_version

ROOT = Path(__file__).parents[2]
BOTH = ["taichi", "quadrants"]


def x86(vendor, family, model):
    """The entry of /proc/cpuinfo for a processor."""
    return {"vendor_id": vendor, "cpu family": str(family), "model": str(model)}


ZEN_4 = x86("AuthenticAMD", 25, 0x11)


@pytest.mark.parametrize(
    ("cpu", "taken"),
    [
        (x86("AuthenticAMD", 23, 0x71), "taichi"),  # Zen 2
        (x86("AuthenticAMD", 25, 0x01), "taichi"),  # Zen 3
        (x86("AuthenticAMD", 25, 0x50), "taichi"),  # Zen 3, mobile
        (ZEN_4, "quadrants"),
        (x86("AuthenticAMD", 25, 0x61), "quadrants"),  # Zen 4, desktop
        (x86("AuthenticAMD", 26, 0x02), "quadrants"),  # Zen 5
        (x86("AuthenticAMD", 27, 0x00), "quadrants"),  # newer than both
        (x86("GenuineIntel", 6, 85), "taichi"),  # Skylake, Cascade Lake
        (x86("GenuineIntel", 6, 143), "taichi"),  # Sapphire Rapids
        (x86("GenuineIntel", 6, 207), "quadrants"),  # Emerald Rapids
        (x86("GenuineIntel", 19, 1), "quadrants"),  # newer than the table
        (x86("SomebodyElse", 6, 1), "quadrants"),
        ({"model name": "arm"}, "quadrants"),
        ({}, "quadrants"),
    ],
)
def test_the_compiler_that_supports_the_cpu_is_chosen(cpu, taken):
    """The newest compiler if none is known to support the processor; the installed one if there is
    only one."""
    assert choice.automatic(BOTH, cpu) == taken
    for only in BOTH:
        assert choice.automatic([only], cpu) == only
    assert choice.automatic([], cpu) == "taichi"


def test_the_table_has_the_llvm_of_each_package():
    """One package is loaded in this process, the other in a separate process."""
    assert int(llvm_version().split(".")[0]) == choice.LLVM[BACKEND]
    (other,) = (name for name in BOTH if name != BACKEND)
    code = "from tisim.describe.diagnostics import llvm_version as v; print(v())"
    assert int(python(code, TISIM_BACKEND=other).stdout.split(".")[0]) == choice.LLVM[other]


def python(code, **environment):
    """A process that runs this code, with warnings as errors, and with TISIM_BACKEND only if it is given."""
    inherited = {name: value for name, value in os.environ.items() if name != choice.VARIABLE}
    command = [sys.executable, "-W", "error::RuntimeWarning", "-W", "error::UserWarning", "-c", code]
    environment = inherited | {name: str(value) for name, value in environment.items()}
    return subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=True)


PRINT = "from tisim.backend.taichi import BACKEND, ti; print(BACKEND, ti.__name__)"


def test_the_variable_wins_and_without_it_the_processor_decides():
    code = f"from tisim.backend import processor; processor.processor = lambda: {{}}; {PRINT}"
    for backend in BOTH:
        assert python(code, TISIM_BACKEND=backend).stdout.split() == [backend, backend]
    for unset in ({}, {"TISIM_BACKEND": ""}):
        assert python(code, **unset).stdout.split() == ["quadrants", "quadrants"]
    code = code.replace("{}", repr(x86("AuthenticAMD", 25, 0x01)))
    assert python(code).stdout.split() == ["taichi", "taichi"]


def test_a_wrong_name_and_a_package_that_is_absent_are_refused(monkeypatch):
    monkeypatch.setenv(choice.VARIABLE, "numba")
    with pytest.raises(InputError, match=r"^TISIM_BACKEND must be taichi or quadrants; received 'numba'$"):
        choice.check()
    monkeypatch.setenv(choice.VARIABLE, "quadrants")
    choice.check()
    choice.check("quadrants")
    with pytest.raises(
        InputError,
        match=r"^TISIM_BACKEND must be set before taichi has been imported; received 'quadrants'$",
    ):
        choice.check("taichi")
    monkeypatch.setattr(choice, "installed", lambda: ["taichi"])
    with pytest.raises(
        InputError,
        match=r"^TISIM_BACKEND must be installed \(python -m pip install 'quadrants\S+'\), or"
        r" TISIM_BACKEND left out; received 'quadrants'$",
    ):
        choice.check()
    # The installed package is imported nevertheless.
    assert choice.chosen() == "taichi"


def test_install_commands_equal_the_requirements():
    with (ROOT / "pyproject.toml").open("rb") as file:
        asked = tomllib.load(file)["project"]["dependencies"]
    for name, command in choice.INSTALL.items():
        (requirement,) = (line.split(";")[0] for line in asked if line.startswith(name))
        assert command == f"python -m pip install '{requirement}'"


FIRST_RUN = f"""
from tisim.backend import choice, processor
choice.installed = lambda: ["taichi"]
processor.processor = lambda: {ZEN_4}
from tisim.backend import runtime
runtime.init(threads=1)
print(runtime.backend())
"""


def test_the_first_run_prints_a_note_once_on_stderr(tmp_path):
    """Without Quadrants, on a processor that Taichi's LLVM does not know."""
    first, second = (python(FIRST_RUN, TI_OFFLINE_CACHE_FILE_PATH=tmp_path) for _ in range(2))
    (line,) = first.stderr.splitlines()
    assert line.startswith("tisim: quadrants is not installed, and the LLVM 15 of taichi does not know this ")
    assert line.endswith(choice.INSTALL["quadrants"])
    assert second.stderr == ""
    assert first.stdout == second.stdout
    assert first.stdout.startswith("taichi")


def test_no_note_without_a_loss_or_after_a_choice(tmp_path, monkeypatch, capsys):
    assert choice.lost(BOTH, ZEN_4) == choice.lost(["quadrants"], ZEN_4) == ""
    assert choice.lost(["taichi"], x86("AuthenticAMD", 25, 0x01)) == ""
    assert "may not know" in choice.lost(["taichi"], {})
    monkeypatch.setattr(choice, "installed", lambda: ["taichi"])
    monkeypatch.setattr(processor, "processor", lambda: ZEN_4)
    monkeypatch.setenv(choice.VARIABLE, "taichi")
    choice.advise(tmp_path)
    monkeypatch.delenv(choice.VARIABLE)
    # The note is not printed if there is no folder to record it in; it would reappear in every run.
    choice.advise(tmp_path / "absent")
    assert capsys.readouterr() == ("", "")
    closed = (tmp_path / "closed").open("w")
    closed.close()
    monkeypatch.setattr(sys, "stderr", closed)
    choice.advise(tmp_path)


def test_the_first_processor_is_read(tmp_path, monkeypatch):
    """Only the first processor of the file is read. Without the file, the result has a model name."""
    info = tmp_path / "cpuinfo"
    info.write_text(
        "vendor_id\t: AuthenticAMD\ncpu family\t: 26\nmodel\t\t: 2\nflags\t\t: a:b\n\nmodel : 3\n"
    )
    monkeypatch.setattr(processor, "Path", lambda _: info)
    found = processor.processor()
    assert found == {**x86("AuthenticAMD", 26, 2), "flags": "a:b"}
    assert processor.first_llvm(found) == ("znver5", 19)
    assert processor.support(15, found) == "znver5 is known from LLVM 19 on, not to LLVM 15"
    assert processor.support(22, found) == "known to LLVM 22 as znver5"
    info.unlink()
    assert processor.processor().keys() == {"model name"}
