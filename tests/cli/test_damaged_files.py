"""Damaged files of every kind that commands read: one line, exit code 2, and no other effect."""

import os
import shutil

import h5py
import numpy as np
import pytest

from tests.accuracy.scenes import only, oscillator
from tests.soak import damage
from tisim import Simulation
from tisim.files import checksum, output_folder
from tisim.files.output_folder import MARKER
from tisim.interrupt import Interrupt
from tisim.plotting.style import empty


def replaced(make):
    def put(path):
        path.unlink()
        make(path)

    return put


def another_program(path):
    with h5py.File(path, "w") as file:
        file["x"] = range(9)


def another_of_ours(path):
    with checksum.create_file(path) as file:
        file.attrs["format"] = "tisim something else"


def zeroed(first, size):
    def put(path):
        content = bytearray(path.read_bytes())
        content[first : first + size] = bytes(size)
        path.write_bytes(content)

    return put


DAMAGE = {
    "empty": lambda path: path.write_bytes(b""),
    "cut": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "signature": zeroed(0, 8),
    "superblock": zeroed(9, 30),
    "structure": zeroed(60, 500),
    "zeros": lambda path: path.write_bytes(bytes(path.stat().st_size)),
    "text": lambda path: path.write_text("particles = 3\n" * 100),
    "another program's": another_program,
    "another of ours": another_of_ours,
    "folder": replaced(lambda path: path.mkdir()),
    "fifo": replaced(os.mkfifo),
    "device": replaced(lambda path: path.symlink_to("/dev/zero")),
    "link to nothing": replaced(lambda path: path.symlink_to("nowhere")),
}
RANDOM = 12
"""Further files with random damage, which may still be readable."""


def damages(path, whole):
    """Damage the file in one way after another: yields the name of the damage, and whether it must be
    reported."""
    rng = np.random.default_rng(3)
    random = {f"random {k}": lambda p: p.write_bytes(damage.with_mishap(whole, rng)) for k in range(RANDOM)}
    for name, hurt in (DAMAGE | random).items():
        if path.is_dir() and not path.is_symlink():
            path.rmdir()
        path.unlink(missing_ok=True)
        path.write_bytes(whole)
        hurt(path)
        yield name, name in DAMAGE


def is_refusal(answer, must, what):
    """Whether a command has refused; the refusal must be one line, after the progress bar."""
    code, out, err = answer
    assert code == 2 if must else code in (0, 2), (what, answer)
    if code:
        lines = [line for line in err.strip().splitlines() if "% elapsed 0:00" not in line]
        assert len(lines) == 1, (what, err)
        assert "must be" in lines[0], (what, err)
        assert out == "", what
    return bool(code)


@pytest.fixture(scope="module")
def simulations():
    """The simulation that all runs of this process share, once there is one."""
    return []


@pytest.fixture
def compiled_once(monkeypatch, simulations):
    def simulation(scene):
        simulations[:] = simulations or [Simulation(scene)]
        return simulations[0]

    monkeypatch.setattr("tisim.cli.run.Simulation", simulation)


@pytest.mark.long
@pytest.mark.parametrize("name", ["checkpoint.h5", "trajectory.h5"])
def test_resume(tisim, toml, tmp_path, monkeypatch, press_ctrl_c, compiled_once, name):
    command = ("run", toml, "--every", "2e-4", "--out", "cut")
    with monkeypatch.context() as patch:
        press_ctrl_c(patch, after=4)
        assert tisim(*command)[0] == 130
    folder, backup = tmp_path / "cut", tmp_path / "kept"
    whole = (folder / name).read_bytes()
    shutil.copytree(folder, backup)
    gone_on = 0
    for mishap, must_be_reported in damages(folder / name, whole):
        other = [path.name for path in backup.iterdir() if path.name != name]
        if is_refusal(tisim(*command, "--resume"), must_be_reported, mishap):
            names = {path.name for path in folder.iterdir()}
            assert names == {path.name for path in backup.iterdir()}, mishap
            assert all((folder / one).read_bytes() == (backup / one).read_bytes() for one in other), mishap
        else:
            gone_on += 1
            shutil.rmtree(folder)
            shutil.copytree(backup, folder)
    assert gone_on < RANDOM
    shutil.rmtree(folder)
    shutil.copytree(backup, folder)
    assert tisim(*command, "--resume")[0] == 0


def test_cost(tisim, tmp_path, monkeypatch):
    only(monkeypatch)
    monkeypatch.setattr(Interrupt, "check", lambda self: pytest.fail("nothing is to be measured"))
    (tmp_path / "swing.toml").write_text(oscillator().to_toml())
    path = tmp_path / "c" / "cost.h5"
    path.parent.mkdir()
    whole = damage._cost(path.parent).read_bytes()
    (path.parent / MARKER).write_text("cost.h5\ncost.csv\n")
    for mishap, _ in damages(path, whole):
        is_refusal(tisim("cost", "swing.toml", "--out", "c"), must=True, what=mishap)
        assert {one.name for one in path.parent.iterdir()} == {
            MARKER,
            output_folder.LOCK,
            "cost.h5",
            "cost.csv",
        }


@pytest.mark.parametrize("name", ["result.h5", "trajectory.h5"])
@pytest.mark.parametrize(
    "command",
    [
        ("plot", "FILE"),
        pytest.param(("movie", "FILE"), marks=pytest.mark.slow),
        ("export", "FILE", "--format", "xyz"),
        pytest.param(("export", "FILE", "--format", "vtk"), marks=pytest.mark.slow),
        pytest.param(("export", "FILE", "--format", "h5md"), marks=pytest.mark.slow),
    ],
    ids=" ".join,
)
def test_drawing_and_copying_commands(tisim, tmp_path, monkeypatch, command, name):
    # Drawing is slow and is replaced; the files are still read.
    monkeypatch.setattr("tisim.plotting.movie.PillowWriter.grab_frame", lambda self, **more: None)
    monkeypatch.setattr("tisim.plotting.movie.PillowWriter.finish", lambda self: None)
    monkeypatch.setattr("tisim.plotting.time_series.start_and_end", lambda *arguments: empty(2.0, 2.0))
    path = damage.KINDS[name].make(tmp_path)
    whole = path.read_bytes()
    for mishap, must_be_reported in damages(path, whole):
        words = [str(path) if word == "FILE" else word for word in command]
        if is_refusal(
            tisim(*words, "--" + ("to" if command[0] == "movie" else "out"), "m/x.gif"),
            must_be_reported,
            mishap,
        ):
            assert list(tmp_path.rglob("*.new*")) == [], mishap


@pytest.mark.parametrize("name", [MARKER, output_folder.LOCK])
def test_obstacles_in_place_of_tisims_files(tisim, impacts, tmp_path, name):
    folder = tmp_path / "out"
    folder.mkdir()
    for make in (os.mkfifo, os.mkdir, lambda path: path.symlink_to("/dev/zero")):
        make(folder / name)
        is_refusal(tisim("run", impacts, "--out", "out"), must=True, what=make)
        assert [path.name for path in folder.iterdir()] == [name]
        (folder / name).rmdir() if make is os.mkdir else (folder / name).unlink()
