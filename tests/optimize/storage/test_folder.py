"""A folder belongs to one problem: another problem is refused before it runs, and nothing is overwritten."""

import csv
import json
import tomllib
from dataclasses import replace

import pytest

from tests.optimize.fake_runs import FakeEvaluator, fake_problem
from tests.optimize.shared_case import skip_pictures
from tisim import InputError
from tisim.cases import case as catalogue
from tisim.cases.case import Case, Size
from tisim.cli.main import main
from tisim.files.output_folder import MARKER
from tisim.optimize.problem.genome import Genome
from tisim.optimize.search_folder import SEARCH_FILES, resume_or_clear
from tisim.optimize.search_records import searches
from tisim.optimize.storage.cache import Cache

BOWL = Case(
    "bowl", "A bowl", "none",
    {"default": Size("", {}, {"method": "zohdi", "options": {"population": 8, "parents": 2}})},
    scene=lambda size, seed: None, check=lambda: iter(()), problem=lambda size, variant: fake_problem(2),
    variants=("only",),
)  # fmt: skip
SEARCH = ["optimize", "bowl", "--out", "s", "--generations", "1"]


@pytest.fixture
def unanalysed():
    """Skip sensitivities and pictures; a test that needs them undoes this."""
    with pytest.MonkeyPatch.context() as patch:
        skip_pictures(patch.setattr)
        yield patch


@pytest.fixture
def optimize(tmp_path, monkeypatch, capsys, unanalysed):
    """Runs a search in a fresh folder with further arguments: (exit code, standard error)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(catalogue, "every", lambda: {BOWL.name: BOWL})
    monkeypatch.setattr("tisim.optimize.evaluation.executors.BatchEvaluator", FakeEvaluator)

    def command(*arguments):
        with pytest.raises(SystemExit) as exit_:
            main([*SEARCH, *map(str, arguments)])
        return exit_.value.code, capsys.readouterr().err

    return command


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_same_search_continues_and_overwrite_restarts_it(optimize, tmp_path):
    folder = tmp_path / "s"
    assert optimize("--seed", 1)[0] == 0
    first, runs = contents(folder), len(Cache(folder / "search.h5"))
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
    assert len(searches(Cache(folder / "search.h5"))) == 1


def test_another_problem_is_refused_and_nothing_changes(optimize, tmp_path, monkeypatch):
    assert optimize()[0] == 0
    first = contents(tmp_path / "s")
    rule = "output folder must be free of a search of another problem; received 's', which holds one that"
    x0, x1 = fake_problem(2).genome.genes
    for changes, differ in (
        ({"name": "trough"}, "problem is 'bowl' there and 'trough' here"),
        ({"version": 2}, "problem_version is 1 there and 2 here"),
        ({"genome": Genome((x0, replace(x1, unit="mm")))}, "units.x1 is 'm' there and 'mm' here"),
        ({"symbol": "R"}, "objective_order is ['fitness'] there and ['R'] here"),
        (
            {"objective": lambda r: -r.value},
            "the problem file, or a value that its functions use, has changed",
        ),
    ):
        other = replace(fake_problem(2), **changes)
        case = replace(BOWL, problem=lambda size, variant, other=other: other)
        monkeypatch.setattr(catalogue, "every", lambda case=case: {BOWL.name: case})
        code, err = optimize("--seed", 7)
        assert code == 2
        assert differ in err.strip()
        assert err.startswith(rule)
        assert err.strip().endswith(". Use another --out, or --overwrite to replace it")
        assert contents(tmp_path / "s") == first


def test_searches_of_one_problem_share_their_runs(optimize, tmp_path):
    """Two methods that propose the same designs first, with common starts of the same seed."""
    folder = tmp_path / "s"
    assert optimize("--seed", 1)[0] == 0
    runs = len(Cache(folder / "search.h5"))
    (first,) = searches(Cache(folder / "search.h5"))
    code, err = optimize("--seed", 1, "--method", "restart", "--generations", 0, "--population", 8)
    assert code == 0
    assert f"another search in s/search.h5, which has {runs} runs" in " ".join(err.split())
    assert "(0 runs" in err.split("generation   0")[1].split("\n")[0]
    for change in (
        ("--seed", 2),
        ("--population", 9),
        ("--fix", "x1=0.5"),
        ("--set", "search.ensemble.min_starts=3"),
    ):
        assert optimize(*change, "--generations", 0)[0] == 0
    with Cache(folder / "search.h5") as cache:
        assert len(searches(cache)) == 6
        assert first in searches(cache)
        assert len(cache) > runs


def test_results_are_of_the_search_that_ended_last(optimize, tmp_path, unanalysed):
    unanalysed.undo()
    folder = tmp_path / "s"

    def shown():
        return f"searches/{json.loads((folder / 'shown.json').read_text())['search']}"

    assert optimize("--seed", 1)[0] == 0
    first = contents(folder)
    assert shown() == next(iter(searches(Cache(folder / "search.h5"))))
    assert "sensitivity.csv" in first
    # There are too few designs for sensitivities; the earlier sensitivities must not remain.
    assert optimize("--seed", 2, "--generations", 0, "--population", 4)[0] == 0
    now = contents(folder)
    with Cache(folder / "search.h5") as cache:
        assert cache.table(shown()).attrs["stopped"] == "generations"
        assert json.loads(cache.table(shown()).attrs["settings"])["seed"] == 2
    assert not [name for name in now if name.startswith("sensitivity")]
    assert now["best.csv"] != first["best.csv"]
    assert optimize("--seed", 1)[0] == 0
    assert {
        name: content for name, content in contents(folder).items() if name.endswith((".csv", ".toml"))
    } == {name: content for name, content in first.items() if name.endswith((".csv", ".toml"))}


def test_resume_needs_an_existing_search(optimize, tmp_path):
    assert optimize("--seed", 1)[0] == 0
    assert optimize("--seed", 2, "--population", 9)[0] == 0
    before = contents(tmp_path / "s")
    code, err = optimize("--seed", 3, "--population", 9, "--resume")
    rule = (
        "output folder must be one in which this search has begun; received 's', where the most similar one"
    )
    assert (code, err.strip()) == (2, f"{rule} differs (search.seed is 2 there and 3 here)")
    assert contents(tmp_path / "s") == before
    assert optimize("--seed", 1, "--resume")[0] == 0


def test_a_running_search_is_not_restarted_but_may_be_joined(optimize, tmp_path, monkeypatch):
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

    monkeypatch.setattr("tisim.optimize.evaluation.executors.BatchEvaluator", Joined)
    assert optimize("--generations", 2)[0] == 0
    assert interrupted
    assert optimize("--generations", 0, "--overwrite")[0] == 0


def test_the_population_option_adapts_the_parents(optimize, tmp_path, monkeypatch):
    """This holds for a case with more parents than this population has individuals, and for comparisons."""
    usual = {"method": "zohdi", "options": {"population": 24, "parents": 8}}
    monkeypatch.setattr(
        catalogue, "every", lambda: {BOWL.name: replace(BOWL, sizes={"default": Size("", {}, usual)})}
    )
    code, err = optimize("--population", 8)
    assert (code, "best f" in err) == (0, True)
    code, err = optimize("--population", 8, "--set", "search.options.parents=8")
    assert (code, err.strip()) == (2, "parents must be < population = 8; received 8")


@pytest.mark.slow
def test_a_search_starts_with_its_files_and_folder(optimize, tmp_path):
    assert optimize("--seed", 1)[0] == 0
    (tmp_path / "tried.csv").write_text("x0,x1 (m)\n0.25,0.5\n0.3,0.3\n")
    (tmp_path / "measured.csv").write_text("x0,x1,fitness,std. error\n0.3,0.35,0.51,0.01\n0.9,0.9,1.2,0.01\n")
    ways = {
        "starting_designs": ("--start-from", "tried.csv"),
        "experiments": ("--experiments", "measured.csv", "--method", "genetic"),
        "warm_start": ("--warm-start", "--method", "genetic", "--seed", 2),
    }
    for way in ways.values():
        assert optimize(*way)[0] == 0
        assert optimize(*way, "--resume")[0] == 0
    with Cache(tmp_path / "s/search.h5") as cache:
        begun = {name.rpartition("/")[2]: cache.table(name) for name in cache.tables()}
        assert begun["starting_designs"].columns == {"x0": [0.25, 0.3], "x1": [0.5, 0.3]}
        assert begun["experiments"].columns["fitness std. deviation"] == [0.01, 0.01]
        assert len(begun["warm_start"]) > 8
        assert len(searches(cache)) == 4
    code, err = optimize("--seed", 9, "--start-from", "tried.csv", "--resume")
    assert "differs (search.seed is 0 there and 9 here)" in err
    (tmp_path / "tried.csv").write_text("x0,x1 (m)\n0.25,0.5\n0.3,1.3\n")
    code, err = optimize("--start-from", "tried.csv")
    assert (code, err.strip()) == (
        2, "tried.csv, line 3: gene x1 must be a number within 0..1 m; received 1.3",
    )  # fmt: skip
    code, err = optimize("--experiments", "measured.csv")
    assert "method must be for experiments: cma-es, gaussian-process, genetic, nsga2; received" in err


OF_USERS = ["best.csv", "convergence.png.new", "search.h5.journal", "best_scene.toml"]


@pytest.mark.parametrize("name", OF_USERS)
def test_user_files_are_not_replaced_by_default(optimize, tmp_path, name):
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


def test_user_files_are_replaced_on_request(optimize, tmp_path, unanalysed):
    unanalysed.undo()
    (tmp_path / "s").mkdir()
    for name in OF_USERS:
        (tmp_path / "s" / name).write_text("the user's own")
    assert optimize("--overwrite")[0] == 0
    assert b"the user's own" not in contents(tmp_path / "s").values()
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
    assert f"s/{name} must be a regular file that can be opened; received a symbolic link" in err
    assert victim.read_text() == "the user's own"
    assert [path.name for path in folder.iterdir()] == [name]


def test_unrelated_files_in_the_folder_do_not_matter(optimize, tmp_path):
    folder = tmp_path / "s"
    folder.mkdir()
    (folder / "notes.txt").write_text("the user's own")
    assert optimize()[0] == 0
    first = contents(folder)
    assert optimize("--generations", 2)[0] == 0
    assert contents(folder)["best.csv"] != first["best.csv"]
    assert contents(folder)["notes.txt"] == b"the user's own"
    assert "notes.txt" not in (folder / MARKER).read_text().splitlines()


def test_a_time_limit_in_the_first_generation_explains_how_to_continue(optimize, tmp_path):
    code, err = optimize("--budget-minutes", 1e-9)
    assert code == 1
    assert (
        "the time limit was reached before the first generation. To go on, give the same command again."
        in err
    )
    assert optimize()[0] == 0


@pytest.mark.parametrize("common", ["true", "false"])
def test_the_best_scene_was_run_by_the_search(optimize, tmp_path, common):
    assert optimize("--set", f"search.ensemble.common_starts={common}")[0] == 0
    seed = tomllib.loads((tmp_path / "s" / "best_scene.toml").read_text())["seed"]
    with (tmp_path / "s" / "best.csv").open() as file:
        best = next(csv.DictReader(file))
    records = [record for record in Cache(tmp_path / "s" / "search.h5").records() if record.seed == seed]
    assert [float(best["x0 (m)"]), float(best["x1 (m)"])] in [
        list(record.design.values()) for record in records
    ]
