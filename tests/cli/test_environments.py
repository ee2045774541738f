"""tisim in the environments of environments.py: the data are written, messages are short, and nothing aborts.

    python -m pytest -n 0 -m slow tests/cli/test_environments.py

prints all of them as one table.
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import tisim
from tests.cli.environments import ENVIRONMENTS, SCENE
from tests.own_files import PROBLEM

TIMEOUT = 900.0
"""Time limit of an environment, s."""
FAULTS = re.compile(
    r"Traceback|terminate called|Aborted|core dumped|Segmentation fault|Exception ignored|Assertion"
)
PROGRESS = re.compile(r"^\s*$|[━╸-]{5,}|^compiling|^.* steps to go")
"""Lines of standard error that belong to the progress bar."""
QUICK = [environment for environment in ENVIRONMENTS if environment.quick]


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The final state of a run in an ordinary environment."""
    path = tmp_path_factory.mktemp("plain") / "tiny.toml"
    path.write_text(SCENE)
    return tisim.run(tisim.Scene.from_toml(path)).state


def outcome(environment, folder, plain):
    """Run an environment in a folder; return a list of faults, which is empty if there is none, and the exit
    code."""
    (folder / "tiny.toml").write_text(SCENE)
    (folder / "my_drift.py").write_text(PROBLEM)
    site = os.pathsep.join(str(Path(part).absolute()) for part in sys.path if part)
    command = f"{sys.executable} -m tisim"
    variables = {
        **os.environ, "PYTHONPATH": site, "SITE": site, "PYTHON": sys.executable, "TISIM": command,
        "RUN": f"{command} run tiny.toml --threads 1 --out out",
    }  # fmt: skip
    try:
        done = subprocess.run(
            ["bash", "-o", "pipefail", "-c", environment.script],
            cwd=folder, env=variables, capture_output=True, timeout=TIMEOUT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return ["it hangs"], None
    out, err = (stream.decode(errors="replace") for stream in (done.stdout, done.stderr))
    faults = [f"{line!r}" for line in (out + err).splitlines() if FAULTS.search(line)]
    if done.returncode != environment.code:
        faults.append(f"exit code {done.returncode}, not {environment.code}: {err[-300:]!r}")
    if environment.says is None:
        faults += [f"says {line!r}" for line in err.splitlines() if not PROGRESS.search(line)]
    elif not re.search(environment.says, err, re.MULTILINE):
        faults.append(f"says {err[-300:]!r}")
    if not re.search(environment.prints, out, re.MULTILINE):
        faults.append(f"prints {out[-300:]!r}")
    return faults + _data_faults(environment, folder, plain), done.returncode


def _data_faults(environment, folder, plain):
    result = folder / "out" / "result.h5"
    if environment.result is None:
        return []
    if result.exists() != environment.result:
        return ["the result is there" if result.exists() else "the result is lost"]
    if not environment.result:
        return []
    state = tisim.read(result).state
    same = state.keys() == plain.keys() and all(np.array_equal(state[name], plain[name]) for name in plain)
    return [] if same else ["the result is another"]


def needs(environment):
    """Skip an environment that this machine cannot provide."""
    if "quadrants" in environment.script and importlib.util.find_spec("quadrants") is None:
        pytest.skip("Quadrants is not installed")


pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")


@pytest.mark.parametrize("environment", QUICK, ids=[environment.name for environment in QUICK])
def test_environment(environment, tmp_path, plain):
    needs(environment)
    faults, _ = outcome(environment, tmp_path, plain)
    assert not faults


@pytest.mark.slow
def test_every_environment(tmp_path, plain, capsys):
    """One table: the environment, the outcome, and the time."""
    assert len(ENVIRONMENTS) >= 60
    assert len({(environment.group, environment.name) for environment in ENVIRONMENTS}) == len(ENVIRONMENTS)
    wrong = {}
    with capsys.disabled():
        print(f"\n{'group':10} {'environment':45} {'exit':>4} {'s':>5}  outcome")
        for number, environment in enumerate(ENVIRONMENTS):
            if "quadrants" in environment.script and importlib.util.find_spec("quadrants") is None:
                continue
            folder = tmp_path / str(number)
            folder.mkdir()
            began = time.monotonic()
            faults, code = outcome(environment, folder, plain)
            took = time.monotonic() - began
            data = {True: "data there", False: "nothing begun", None: "as expected"}[environment.result]
            text = "; ".join(faults) or data
            print(f"{environment.group:10} {environment.name:45} {code!s:>4} {took:5.1f}  {text}", flush=True)
            if faults:
                wrong[environment.name] = faults
    assert not wrong
