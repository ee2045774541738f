"""Every command reports a damaged folder of a search or comparison in one line and changes nothing."""

import os

import h5py
import pytest

from tests.optimize.cache_files import journal_of, of_format
from tests.optimize.fake_runs import FakeEvaluator, fake_problem, fake_record
from tisim.cases import case as catalogue
from tisim.cases.case import Case, Size
from tisim.cli.main import main
from tisim.files.checksum import MAGIC, frame
from tisim.files.output_folder import LOCK, MARKER
from tisim.optimize.storage.cache import Cache

BOWL = Case(
    "bowl", "A bowl", "none",
    {"default": Size("", {}, {"method": "zohdi", "options": {"population": 8, "parents": 2}})},
    scene=lambda size, seed: None, check=lambda: iter(()), problem=lambda size, variant: fake_problem(2),
    variants=("only",),
)  # fmt: skip
COMMANDS = {
    "optimize": ["optimize", "bowl", "--out", "s", "--generations", "1"],
    "compare": [
        "compare",
        "bowl",
        "--out",
        "s",
        "--evaluations",
        "9",
        "--repeats",
        "1",
        "--methods",
        "random",
    ],
    "list": ["cache", "s/FILE"],
    "verify": ["cache", "s/FILE", "--verify"],
    "compact": ["cache", "s/FILE", "--compact"],
}


@pytest.fixture
def command(tmp_path, monkeypatch, capsys):
    """Runs a command: (exit code, standard error)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(catalogue, "every", lambda: {BOWL.name: BOWL})
    monkeypatch.setattr("tisim.optimize.evaluation.executors.BatchEvaluator", FakeEvaluator)

    def run(words):
        with pytest.raises(SystemExit) as exit_:
            main(words)
        return exit_.value.code, capsys.readouterr().err

    return run


def flip(path, at):
    content = bytearray(path.read_bytes())
    content[at] ^= 4
    path.write_bytes(content)


def another_program(path):
    with h5py.File(path, "w") as file:
        file["evaluations/key"] = h5py.ExternalLink("fifo", "/x")
        file.attrs["format"] = ["tisim", "evaluations"]


def replaced(make):
    def put(path):
        path.unlink()
        make(path)

    return put


DAMAGE = {
    "structure": lambda path: flip(path, 100),
    "signature": lambda path: flip(path, 3),
    "checksum": lambda path: flip(path, path.read_bytes().rfind(MAGIC) + 1),
    "end": lambda path: flip(path, -1),
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-700]),
    "empty": lambda path: path.write_bytes(b""),
    "text": lambda path: path.write_text("not HDF5 at all"),
    "zeros": lambda path: path.write_bytes(bytes(5000)),
    "a journal": lambda path: path.write_bytes(frame(fake_record(1).payload())),
    "another's": another_program,
    "another format": lambda path: path.write_bytes(of_format("tisim evaluations 1")),
    "fifo": replaced(os.mkfifo),
    "folder": replaced(lambda path: path.mkdir()),
    "link": replaced(lambda path: path.symlink_to("/dev/zero")),
}


def looked_at(folder):
    """The contents of the folder, without opening unreadable files."""
    return {
        path.name: path.read_bytes() if path.is_file() else path.lstat().st_mode for path in folder.iterdir()
    }


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_file_is_reported_in_one_line_and_left_as_it_is(command, tmp_path, damage, words):
    name = "compare.h5" if words[0] == "compare" else "search.h5"
    path = tmp_path / "s" / name
    with Cache(path) as cache:
        for number in range(30):
            cache.put(fake_record(number))
        cache.put_table("log", {"gen": [1, 2, 3]})
    (path.parent / MARKER).write_text(f"{name}\n{name}.journal\n{name}.lock\n")
    damage(path)
    before = looked_at(path.parent)
    code, err = command([word.replace("FILE", name) for word in words])
    if code == 0 and words[-1] == "--compact":
        assert len(Cache(path)) == 30
        assert path.with_name("search.h5.damaged").read_bytes() == before["search.h5"]
        return
    assert code == 2
    assert len(err.strip().splitlines()) == 1
    assert f"s/{name} must be " in err
    ours = {MARKER: b"", LOCK: b""}
    assert {**looked_at(path.parent), **ours} == {**before, **ours}


@pytest.mark.parametrize("words", [COMMANDS["optimize"], COMMANDS["compare"]], ids=["optimize", "compare"])
def test_a_search_continues_with_a_damaged_journal_and_reports_it(command, tmp_path, words):
    name = "compare.h5" if words[0] == "compare" else "search.h5"
    assert command(words)[0] == 0
    journal = journal_of(tmp_path / "s" / name)
    journal.write_bytes(frame(b'{"no": "record"}') + frame(fake_record(1).payload())[:-9])
    with pytest.warns(RuntimeWarning, match=r"1 damaged evaluation\(s\) are ignored and will be run again"):
        assert command(words)[0] == 0
    assert command(["cache", f"s/{name}", "--verify"])[0] == 0


@pytest.mark.parametrize(
    "words", [COMMANDS[k] for k in ("list", "verify", "compact")], ids=lambda words: words[-1]
)
def test_a_read_only_search_can_be_read(command, tmp_path, monkeypatch, words):
    """As on a read-only disk: there is no lock file and none can be made."""
    path = tmp_path / "s" / "search.h5"
    with Cache(path) as cache:
        cache.put(fake_record(1))
    (path.parent / "search.h5.lock").unlink()
    make = os.open

    def refuse(name, flags, *mode, **options):
        if flags & (os.O_CREAT | os.O_RDWR | os.O_WRONLY):
            raise PermissionError(13, "Permission denied", str(name))
        return make(name, flags, *mode, **options)

    monkeypatch.setattr(os, "open", refuse)
    code, err = command([word.replace("FILE", "search.h5") for word in words])
    if words[-1] == "--compact":
        assert (code, err.strip()) == (
            2,
            "s/search.h5.lock must be a regular file that can be opened; received one without permission",
        )
    else:
        assert (code, err) == (0, "")
    assert [p.name for p in path.parent.iterdir() if p.name.endswith("lock")] == []
