"""The command ``tisim watch``: its address, its end, and wrong input."""

import os
import signal
import stat
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from tests.cli.conftest import tisim  # noqa: F401
from tests.watch.conftest import growing  # noqa: F401


@pytest.fixture
def command(tmp_path):
    """Begin the command in a process of its own; yields the process and its address."""
    begun = []

    def begin(*arguments, **environment):
        order = [sys.executable, "-m", "tisim", "watch", str(tmp_path), *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        begun.append(subprocess.Popen(order, env=os.environ | environment, **pipes))
        return begun[-1], begun[-1].stdout.readline().strip()

    yield begin
    for process in begun:
        process.kill()
        process.communicate()


def test_a_run_is_served_until_ctrl_c(growing, command, tmp_path):  # noqa: F811
    growing().write(2)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    opened = tmp_path.parent / f"{tmp_path.name}.opened"
    browser = tmp_path.parent / f"{tmp_path.name}.browser"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {opened}\n')
    browser.chmod(0o755)
    process, address = command(BROWSER=f"{browser} %s")
    with urllib.request.urlopen(address, timeout=60) as answer:
        assert b'"after":1' in answer.read()
    with pytest.raises(urllib.error.HTTPError, match="404"):
        urllib.request.urlopen(address.rpartition("/")[0][:-3] + "abc/", timeout=60)
    for _ in range(100):
        if opened.exists() and opened.read_text():
            break
        time.sleep(0.1)
    link = opened.read_text()
    assert link.startswith("file:///")
    token = address.split("/")[3]
    assert token not in link, "the list of processes shows the arguments of the browser to all users"
    page = Path(link.removeprefix("file://"))
    assert address in page.read_text()
    assert stat.S_IMODE(page.stat().st_mode) == 0o600
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 0
    assert process.stderr.read() == "watching until Ctrl-C\nstopped\n"
    assert process.stdout.read() == ""
    assert not page.exists()
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before, "nothing is written"
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(address, timeout=5)


def test_wrong_input_is_refused(tisim, growing, tmp_path):  # noqa: F811
    growing().write()
    (tmp_path / "scene.toml").touch()
    for arguments, message in (
        (("none",), "folder to watch must be an existing folder or file; received 'none'"),
        ((".", "--port", 70000), "port must be 0 to 65535; received 70000"),
        ((".", "--port", "x"), "port"),
        ((".", "--world", 3), "world must be 0 to 0; received 3"),
        (("scene.toml",), "file must be a trajectory.h5 or result.h5 of a run"),
    ):
        code, out, err = tisim("watch", *arguments, "--no-open")
        assert (code, out) == (2, ""), arguments
        assert message in err
