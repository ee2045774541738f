"""Ownership of files in an output folder, recorded in its marker file."""

import multiprocessing

import h5py
import pytest

from tisim import InputError
from tisim.files.output_folder import MARKER, check, check_all, claim


def write_file(folder, name, text="theirs"):
    (folder / name).write_text(text)


def test_only_claimed_files_may_be_replaced(tmp_path):
    folder = tmp_path / "new" / "below"
    check(folder, ["a", "b"])
    assert not folder.exists()
    claim(folder, ["a", "b"])
    write_file(folder, "a")
    write_file(folder, "a.new")
    write_file(folder, "c")
    claim(folder, ["a", "b"])
    for names, foreign in ((["a", "c"], "c"), (["c", "d"], "c")):
        with pytest.raises(
            InputError, match=rf"\(or give --overwrite\); received '.*/below' with {foreign}$"
        ):
            claim(folder, names)
    claim(folder, ["c"], overwrite=True)
    claim(folder, ["c"])
    assert (folder / MARKER).read_text() == "a\nb\nc\n"


def test_many_files_are_not_all_spelled_out(tmp_path):
    names = [f"f{k}" for k in range(9)]
    for name in names:
        write_file(tmp_path, name)
    with pytest.raises(InputError, match=r"with f0, f1, f2, f3, f4 and 4 more$"):
        check(tmp_path, names)


@pytest.mark.parametrize("overwrite", [False, True])
def test_links_and_folders_are_refused_even_with_overwrite(tmp_path, overwrite):
    claim(tmp_path, ["a", "b"])
    (tmp_path / "a").symlink_to("elsewhere")
    (tmp_path / "b.new").mkdir()
    for name, kind in (("a", "a symbolic link"), ("b", "a folder")):
        with pytest.raises(InputError, match=rf"must be a regular file .* received {kind}"):
            claim(tmp_path, [name], overwrite)


def test_all_files_must_be_claimed_if_their_names_are_not_known(tmp_path):
    check_all(tmp_path / "none")
    check_all(tmp_path)
    claim(tmp_path, ["a"])
    write_file(tmp_path, "a")
    write_file(tmp_path, "a.new")
    check_all(tmp_path)
    (tmp_path / "theirs").mkdir()
    with pytest.raises(InputError, match=r"has not written and might replace .* with theirs"):
        check_all(tmp_path)
    check_all(tmp_path, overwrite=True)


def test_a_name_that_a_killed_process_has_not_finished_is_ignored(tmp_path):
    claim(tmp_path, ["first"])
    (tmp_path / MARKER).write_text("first\nsec")
    claim(tmp_path, ["third"])
    assert (tmp_path / MARKER).read_text() == "first\nsec\nthird\n"


def _take(folder, worker):
    for k in range(20):
        claim(folder, [f"{worker}-{k}", "shared"])


def test_processes_that_take_one_folder_lose_no_name(tmp_path):
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=_take, args=(tmp_path, worker)) for worker in range(2)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(300)
        assert worker.exitcode == 0
    names = (tmp_path / MARKER).read_text().splitlines()
    assert sorted(names) == sorted(["shared", *(f"{w}-{k}" for w in range(2) for k in range(20))])


def test_files_in_a_folder_without_a_marker_are_foreign_even_if_they_look_like_our_own(tmp_path):
    with h5py.File(tmp_path / "result.h5", "w") as file:
        file.attrs["format"] = "tisim run 1"
    with pytest.raises(InputError, match=r"has not written and would replace .* with result\.h5"):
        check(tmp_path, ["result.h5"])
    with pytest.raises(InputError, match=r"has not written and might replace .* with result\.h5"):
        check_all(tmp_path)
