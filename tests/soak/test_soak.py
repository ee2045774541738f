"""A small version of the kill matrix; tests/soak.sh runs all of it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.soak.__main__ import MISHAPS
from tests.soak.counts import Counts

SCRIPT = Path(__file__).parents[1] / "soak.sh"


@pytest.mark.slow
@pytest.mark.parametrize("mishap", MISHAPS)
def test_mishaps_do_no_damage(mishap):
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    command = ["bash", str(SCRIPT), mishap, "--share", "0.1", "--seed", "1"]
    completed = subprocess.run(
        command, capture_output=True, text=True, check=False, env={**os.environ, "PATH": path}
    )
    assert completed.returncode == 0, completed.stdout + completed.stderr
    width = len(Counts.headings()) - 1
    rows = [line.split()[-width:] for line in completed.stdout.splitlines()[2:]]
    assert rows
    for trials, *failures in rows:
        assert int(trials) > 0
        assert set(failures) == {"0"}, completed.stdout
