"""What tisim makes of hostile input: a scene that comes back from its file, or a message for people."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from unittest.mock import patch

from tisim import Scene
from tisim.cli import main
from tisim.errors import RunError
from tisim.runtime import Runtime

ACCEPTED = "accepted"
"""What a command says in place of running."""


def check_message(text: str) -> None:
    """What is said of bad input: a line for each fault, of bounded length, that can be printed."""
    lines = text.splitlines()
    assert 0 < len(lines) <= 10, text[:2000]
    for line in lines:
        assert line.isprintable(), line[:2000]
        assert " must " in line, line[:2000]
        assert "; received " in line, line[:2000]
        assert len(line) < 1500, line[:2000]


def check_file(accepted: Scene, file: Path) -> None:
    """A scene comes back from its file to the last bit."""
    file.write_text(accepted.to_toml(), encoding="utf-8")
    again = Scene.from_toml(file)
    assert again.to_dict() == accepted.to_dict()
    assert again.digest() == accepted.digest()


@contextmanager
def nothing_runs() -> Iterator[list[Scene]]:
    """Commands go as far as they can without starting or compiling anything, and end there with ACCEPTED; the
    scenes that would have been run."""
    scenes: list[Scene] = []

    def accept(*scene: Any, **options: Any) -> None:
        scenes.extend(one for one in scene if isinstance(one, Scene))
        raise RunError(ACCEPTED)

    with ExitStack() as patches:
        for place in ("tisim.cli.Simulation", "tisim.cli_cost._measure", "optimize.session.session"):
            patches.enter_context(patch(place, accept))
        patches.enter_context(patch("tisim.runtime.start", Runtime))
        yield scenes


def command(words: Sequence[str]) -> tuple[int, str]:
    """Exit code and standard error of a command that is given in this process."""
    out, err = io.StringIO(), io.StringIO()
    code: Any = None
    with redirect_stdout(out), redirect_stderr(err):
        try:
            main(list(words))
        except SystemExit as end:
            code = end.code
    return code, err.getvalue()
