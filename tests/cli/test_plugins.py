"""--plugin: a user's effect in all commands that read scenes."""

import json
import re

import pytest

from tests.own_files import LAW, METHOD, PROBLEM
from tisim import Scene
from tisim.optimize.storage.cache import Cache

PLUGIN = ["--plugin", "own_laws.py"]


@pytest.fixture
def pulled(toml, own_file):
    """A scene file with an effect of a plugin."""
    file = own_file("own_laws.py", LAW).parent / toml
    text = Scene.from_toml(file).to_toml()
    file.write_text(re.sub(r"\n\[effects\]\n", "", text) + "\n[effects.pull]\nstrength = 1e-9\n")
    return toml


@pytest.mark.slow
def test_a_run_is_stopped_continued_and_drawn(tisim, pulled, press_ctrl_c, monkeypatch, own_file):
    command = ["run", pulled, "--out", "o", "--frames", "4", *PLUGIN]
    with monkeypatch.context() as patch:
        press_ctrl_c(patch, after=1)
        assert tisim(*command)[0] == 130
    own_file("own_laws.py", LAW + "\n")
    code, _, err = tisim(*command)
    how = "(to begin anew, give --out or --fresh)"
    assert (code, err) == (2, f"checkpoint must be of the same scenes; received one of others {how}\n")
    own_file("own_laws.py", LAW)
    code, _, err = tisim(*command)
    assert code == 0, err
    assert (
        len(json.loads(own_file("o/x", "").with_name("versions.json").read_text())["plugin own_laws"]) == 12
    )
    assert tisim("plot", "o", *PLUGIN)[0] == 0
    code, out, _ = tisim("explain", pulled, *PLUGIN)
    assert code == 0
    assert "pull" in out


def test_without_the_plugin_the_effect_is_unknown(tisim, pulled):
    code, _, err = tisim("run", pulled)
    assert code == 2
    assert "effects.pull.kind must be one of" in err
    code, _, err = tisim("run", pulled, "--plugin", "other.py")
    assert (code, err) == (2, "Python file must exist; received 'other.py'\n")


@pytest.mark.slow
def test_a_search_runs_plugins_in_worker_processes(tisim, own_file):
    own_file("own_laws.py", LAW)
    text = PROBLEM.replace("duration=2e-3", "duration=2e-3,\n        effects=(Pull(strength=1e-9),)")
    own_file("my_drift.py", "from own_laws import Pull\n" + text)
    code, _, err = tisim("optimize", "my_drift.py", "--out", "s")
    assert code == 2
    assert "line 1: ModuleNotFoundError: No module named 'own_laws'" in err
    search = ["optimize", "my_drift.py", *PLUGIN, "--generations", "0"]
    assert tisim(*search, "--out", "s", "--executor", "processes:2")[0] == 0
    assert tisim(*search, "--out", "t")[0] == 0
    there, here = (
        {record.key: record.values for record in Cache(f"{folder}/search.h5").records()} for folder in "st"
    )
    assert there == here


@pytest.mark.long
def test_a_search_method_of_ones_own(tisim, own_file):
    own_file("my_drift.py", PROBLEM)
    own_file("my_steps.py", METHOD)
    command = ["optimize", "my_drift.py", "--method", "steps", "--out", "s", "--generations", "1"]
    code, _, err = tisim(*command)
    assert code == 2
    assert "or your own (--plugin, import); received 'steps'" in " ".join(err.split())
    code, _, err = tisim(*command, "--plugin", "my_steps.py", "--set", "search.options.width=0.3")
    assert code == 0, err
    cache = Cache("s/search.h5")
    (name,) = [name for name in cache.tables() if name.startswith("searches/") and name.count("/") == 1]
    made = json.loads(cache.table(name).attrs["identity"])
    assert made["search"]["options"] == {"population": 4, "width": 0.3}
    assert len(made["method_code"]) == 24
