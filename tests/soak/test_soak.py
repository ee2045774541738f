"""The kill matrix in small; tests/soak.sh is the whole of it."""

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
def test_mishaps_cost_nothing(mishap):
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    command = ["bash", str(SCRIPT), mishap, "--share", "0.1", "--seed", "1"]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env={**os.environ, "PATH": path}
    )
    assert done.returncode == 0, done.stdout + done.stderr
    width = len(Counts.headings()) - 1
    rows = [line.split()[-width:] for line in done.stdout.splitlines()[2:]]
    assert rows
    for tried, *failures in rows:
        assert int(tried) > 0
        assert set(failures) == {"0"}, done.stdout
