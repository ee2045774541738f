"""A link, folder, fifo or socket at the path of an output file is not followed, written to or waited for."""

import json
import os
import re
import socket
import stat
import subprocess
import sys

import pytest

from tisim import InputError, RunError
from tisim.files import atomic, regular_file
from tisim.files.atomic import append_at, locked, replace_file, replacing

VICTIM = b"the user's own"


def lock(path):
    with locked(path, exclusive=True):
        pass


def lock_to_read(path):
    with locked(path, exclusive=False):
        pass


def replace_by_name(path):
    # "r+b" fails on a fifo; "wb" would block.
    with replacing(path.with_suffix(""), path), path.open("r+b") as file:
        file.write(b"new")


WAYS = {
    "lock": lock,
    "lock to read": lock_to_read,
    "append": lambda path: append_at(path, 0, b"new"),
    "replace": lambda path: replace_file(path.with_suffix(""), b"new"),
    "replace by name": replace_by_name,
    "read": regular_file.content,
    "look": regular_file.file_status,
}
"""Operations on the file "file.new"."""


def put_link(path, victim):
    path.symlink_to(victim)


def put_hard_link(path, victim):
    path.hardlink_to(victim)


def put_dangling_link(path, victim):
    path.symlink_to(victim.with_name("not there"))


def put_folder(path, victim):
    path.mkdir()


def put_fifo(path, victim):
    os.mkfifo(path)


def put_socket(path, victim):
    with socket.socket(socket.AF_UNIX) as socket_:
        socket_.bind(str(path))


THINGS = {
    put_link: "a symbolic link", put_dangling_link: "a symbolic link", put_folder: "a folder",
    put_fifo: "a fifo", put_socket: "a socket", put_hard_link: r"one with 2 names \(hard links\)",
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("put", THINGS, ids=lambda put: put.__name__)
def test_a_path_without_a_regular_file_is_refused_and_left_alone(tmp_path, way, put):
    victim, path = tmp_path / "victim", tmp_path / "file.new"
    victim.write_bytes(VICTIM)
    put(path, victim)
    before = path.lstat().st_mode, sorted(p.name for p in tmp_path.iterdir())
    if put is put_hard_link and way == "replace by name":
        WAYS[way](path)
        assert victim.read_bytes() == VICTIM  # the other name of the hard link
        return
    if put is put_hard_link and way in ("lock to read", "read", "look"):
        WAYS[way](path)  # nothing is written to it
    else:
        with pytest.raises(InputError, match=f"file.new must be a regular file .*; received {THINGS[put]}"):
            WAYS[way](path)
    assert victim.read_bytes() == VICTIM
    assert (path.lstat().st_mode, sorted(p.name for p in tmp_path.iterdir())) == before


def test_a_link_in_the_place_of_a_result_is_replaced_and_not_followed(tmp_path):
    victim, path = tmp_path / "victim", tmp_path / "file"
    victim.write_bytes(VICTIM)
    path.symlink_to(victim)
    replace_file(path, b"new")
    assert (path.read_bytes(), victim.read_bytes(), path.is_symlink()) == (b"new", VICTIM, False)


def test_a_device_is_refused():
    with pytest.raises(InputError, match=r"/dev/null must be a regular file .*; received a device"):
        regular_file.content(regular_file.Path("/dev/null"))


def test_a_lock_that_is_never_given_back_is_reported(tmp_path, monkeypatch):
    path = tmp_path / "lock"
    monkeypatch.setattr(atomic, "LOCK_TIMEOUT", 0.05)
    with locked(path, exclusive=False):
        lock_to_read(path)
        with pytest.raises(RunError, match=r"lock has been locked by another process for 0\.05 s"):
            lock(path)
    lock(path)


OTHER_USER = """
import os, pathlib, sys
from tisim.files import regular_file
from tisim.files.atomic import append_at, locked, replace_file
from tisim import InputError, RunError
if os.geteuid() == 0:  # whom no mode stops
    os.setgroups([]); os.setgid(65534); os.setuid(65534)
folder = pathlib.Path(sys.argv[1])
for number, what in enumerate((
    lambda: locked(folder / "lock", exclusive=False).__enter__() and "got",
    lambda: locked(folder / "none", exclusive=False).__enter__() and "got",
    lambda: locked(folder / "lock", exclusive=True).__enter__(),
    lambda: locked(folder / "secret", exclusive=False).__enter__(),
    lambda: regular_file.content(folder / "secret"),
    lambda: append_at(folder / "lock", 0, b"new"),
    lambda: replace_file(folder / "lock", b"new"),
    lambda: regular_file.file_status(folder / "closed" / "file"),
)):
    try:
        print(number, what())
    except (InputError, RunError) as error:
        print(number, type(error).__name__, error)
"""


@pytest.fixture
def theirs(tmp_path):
    """A folder whose files a user other than root can read only in part and cannot write."""
    folder = tmp_path / "theirs"
    folder.mkdir()
    for above in folder.parents[:4]:
        above.chmod(above.stat().st_mode | stat.S_IROTH | stat.S_IXOTH)
    (folder / "lock").touch(0o444)
    (folder / "secret").touch(0o000)
    (folder / "closed").mkdir(0o000)
    folder.chmod(0o555)
    yield folder
    folder.chmod(0o755)


def test_files_of_another_user_are_read_or_refused(theirs):
    """Reading uses the lock file of another user; in a folder that is not writable it does without a lock."""
    command = [sys.executable, "-c", OTHER_USER, str(theirs)]
    completed = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert completed.stderr == ""
    lines = completed.stdout.splitlines()
    assert [line.split()[:2] for line in lines] == [
        ["0", "got"], ["1", "got"], *([str(k), "InputError"] for k in range(2, 8)),
    ]  # fmt: skip
    assert all(line.endswith("received one without permission") for line in lines[2:])
    assert sorted(path.name for path in theirs.iterdir()) == ["closed", "lock", "secret"]


COMMANDS = [
    ["plot", "closed/run"], ["movie", "closed/run"], ["export", "closed/run"],
    ["run", "concentration", "--out", "closed/run"],
    ["run", "concentration", "--out", "closed/run", "--resume"],
    ["figures", "concentration", "--out", "closed/run"],
    ["cache", "closed/search.h5", "--verify"],
]  # fmt: skip
AS_ANOTHER = """
import contextlib, ctypes, io, json, os, sys
import tisim.cli.main
if os.geteuid() == 0:  # whom no mode stops: give up CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH
    header, sets = (ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)()
    libc = ctypes.CDLL(None)
    assert libc.capget(header, sets) == 0
    sets[0], sets[1] = sets[0] & ~6, sets[1] & ~6
    assert libc.capset(header, sets) == 0
os.chdir(sys.argv[1])
ends = []
for command in COMMANDS:
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            tisim.cli.main.main(command)
    except SystemExit as ended:
        ends.append((ended.code, said.getvalue()))
print(json.dumps(ends))
"""


def test_commands_on_an_inaccessible_folder_are_refused(theirs):
    code = f"COMMANDS = {COMMANDS}\n{AS_ANOTHER}"
    # The folder of compiled kernels, by default in the home folder, may not be entered either.
    elsewhere = {name: value for name, value in os.environ.items() if "OFFLINE_CACHE" not in name}
    command = [sys.executable, "-c", code, str(theirs)]
    home = {**elsewhere, "HOME": str(theirs / "closed"), "MPLCONFIGDIR": str(theirs.parent)}
    completed = subprocess.run(command, capture_output=True, text=True, timeout=300, env=home)
    assert completed.returncode == 0, completed.stderr
    ends = json.loads(completed.stdout.splitlines()[-1])
    assert [code for code, _ in ends] == [2] * len(COMMANDS)
    rule = r"(in a folder that may be entered|a regular file that can be opened); received "
    for _, output in ends:
        *kernels, line = output.splitlines()
        assert re.fullmatch(rf"closed/\S+ must be {rule}.*(denied|without permission)", line)
        assert all(other.startswith("compiled kernels are not kept") for other in kernels)
