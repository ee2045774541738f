"""A folder belongs to one search: another one is refused before it runs, and nothing is overwritten."""

import csv
import tomllib
from dataclasses import replace

import pytest

from cases import case as catalogue
from cases.case import Case, Size
from optimize.search_folder import SEARCH_FILES, resume_or_clear
from optimize.storage.cache import Cache
from tests.optimize.fake_runs import FakeEvaluator, fake_problem
from tisim import InputError
from tisim.cli.main import main
from tisim.files.ownership import MARKER

BOWL = Case(
    "bowl", "A bowl", "none",
    {"default": Size("", {}, {"method": "zohdi", "options": {"population": 8, "parents": 2}})},
    scene=lambda size, seed: None, check=lambda: iter(()), problem=lambda size, variant: fake_problem(2),
    variants=("only",),
)  # fmt: skip
SEARCH = ["optimize", "bowl", "--out", "s", "--generations", "1"]


@pytest.fixture
def optimize(tmp_path, monkeypatch, capsys):
    """Runs a search in a fresh folder with more arguments: (exit code, standard error)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(catalogue, "every", lambda: {BOWL.name: BOWL})
    monkeypatch.setattr("optimize.evaluation.executors.BatchEvaluator", FakeEvaluator)

    def command(*arguments):
        with pytest.raises(SystemExit) as exit_:
            main([*SEARCH, *map(str, arguments)])
        return exit_.value.code, capsys.readouterr().err

    return command


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_another_search_is_refused_and_the_same_goes_on(optimize, tmp_path):
    folder = tmp_path / "s"
    assert optimize("--seed", 1)[0] == 0
    first, runs = contents(folder), len(Cache(folder / "search.h5"))
    rule = "output folder must be free of another search; received 's', which holds one that differs"
    for other, differ in {
        ("--seed", 2): "search.seed is 1 there and 2 here",
        ("--seed", 1, "--population", 9, "--set", "search.ensemble.block=2"): (
            "search.ensemble.block is 6 there and 2 here; search.options.population is 8 there and 9 here"
        ),
    }.items():
        code, err = optimize(*other)
        assert (code, err.strip()) == (
            2,
            f"{rule} ({differ}). Use another --out, or --overwrite to replace it",
        )
        assert contents(folder) == first
    code, err = optimize("--seed", 1, "--generations", 2)
    assert code == 0
    assert f"going on with s/search.h5, which has {runs} runs" in " ".join(err.split())
    assert contents(folder)["best.csv"] != first["best.csv"]
    code, err = optimize("--seed", 2, "--overwrite", "--resume")
    assert (code, err.strip()) == (2, "--overwrite must be given without --resume; received both")
    code, err = optimize("--seed", 2, "--fresh")
    message = "output folder must be without results of a search (or give --overwrite); received 's'"
    assert (code, err.strip()) == (2, message)
    code, err = optimize("--seed", 2, "--overwrite", "--target", 1e9, "--generations", 0)
    assert code == 0
    assert contents(folder)["best.csv"] != first["best.csv"]
    assert optimize("--seed", 1)[0] == 2


def test_a_search_that_goes_on_is_not_begun_anew_but_may_be_joined(optimize, tmp_path, monkeypatch):
    assert optimize("--generations", 0)[0] == 0
    interrupted = []

    class Joined(FakeEvaluator):
        def evaluate(self, scenes, progress=None):
            if not interrupted:
                interrupted.append(scenes)
                assert optimize()[0] == 0
                with pytest.raises(InputError, match="without a command that is still at work there"):
                    resume_or_clear(tmp_path / "s", None, overwrite=True)
            return super().evaluate(scenes, progress)

    monkeypatch.setattr("optimize.evaluation.executors.BatchEvaluator", Joined)
    assert optimize("--generations", 3)[0] == 0
    assert interrupted
    assert optimize("--generations", 3, "--overwrite")[0] == 0


def test_population_alone_brings_the_parents_that_go_with_it(optimize, tmp_path, monkeypatch):
    """On a case that has more parents than this population has strings; and to compare methods, too."""
    usual = {"method": "zohdi", "options": {"population": 24, "parents": 8}}
    monkeypatch.setattr(
        catalogue, "every", lambda: {BOWL.name: replace(BOWL, sizes={"default": Size("", {}, usual)})}
    )
    code, err = optimize("--population", 8)
    assert (code, "best f" in err) == (0, True)
    code, err = optimize("--population", 8, "--set", "search.options.parents=8")
    assert (code, err.strip()) == (2, "parents must be < population = 8; received 8")


@pytest.mark.parametrize("name", ["best.csv", "convergence.png.new", "search.h5.journal", "best_scene.toml"])
def test_files_of_the_user_are_not_replaced(optimize, tmp_path, name):
    users = tmp_path / "s" / name
    users.parent.mkdir()
    users.write_text("the user's own")
    code, err = optimize()
    assert (code, err.strip()) == (
        2,
        "output folder must be without files that tisim has not written and would replace "
        f"(or give --overwrite); received 's' with {name}",
    )
    assert contents(users.parent) == {name: b"the user's own"}
    assert optimize("--overwrite")[0] == 0
    assert contents(users.parent).get(name) != b"the user's own"
    assert optimize()[0] == 0


@pytest.mark.parametrize("name", ["best.csv", "best.csv.new", *SEARCH_FILES[:3]])
@pytest.mark.parametrize("way", [(), ("--fresh",), ("--fresh", "--overwrite")])
def test_planted_links_are_refused_and_not_followed(optimize, tmp_path, name, way):
    victim, folder = tmp_path / "victim", tmp_path / "s"
    folder.mkdir()
    victim.write_text("the user's own")
    (folder / name).symlink_to(victim)
    code, err = optimize(*way)
    assert code == 2
    assert f"s/{name} must be a regular file of its own that may be opened; received a symbolic link" in err
    assert victim.read_text() == "the user's own"
    assert [path.name for path in folder.iterdir()] == [name]


def test_a_folder_of_before_markers_goes_on_and_unrelated_files_do_not_matter(optimize, tmp_path):
    folder = tmp_path / "s"
    folder.mkdir()
    (folder / "notes.txt").write_text("the user's own")
    assert optimize()[0] == 0
    (folder / MARKER).unlink()
    # Searches of that time left none of these.
    for later in folder.glob("sensitivity.*"):
        later.unlink()
    first = contents(folder)
    assert optimize("--generations", 2)[0] == 0
    assert contents(folder)["best.csv"] != first["best.csv"]
    assert contents(folder)["notes.txt"] == b"the user's own"
    assert "notes.txt" not in (folder / MARKER).read_text().splitlines()


def test_time_over_in_the_first_generation_says_how_to_go_on(optimize, tmp_path):
    code, err = optimize("--budget-minutes", 1e-9)
    assert code == 1
    assert "the time was over before the first generation. To go on, give the same command again." in err
    assert optimize()[0] == 0


@pytest.mark.parametrize("common", ["true", "false"])
def test_best_scene_is_one_that_the_search_has_run(optimize, tmp_path, common):
    assert optimize("--set", f"search.ensemble.common_starts={common}")[0] == 0
    seed = tomllib.loads((tmp_path / "s" / "best_scene.toml").read_text())["seed"]
    with (tmp_path / "s" / "best.csv").open() as file:
        best = next(csv.DictReader(file))
    records = [record for record in Cache(tmp_path / "s" / "search.h5").records() if record.seed == seed]
    assert [float(best["x0 (m)"]), float(best["x1 (m)"])] in [
        list(record.design.values()) for record in records
    ]
