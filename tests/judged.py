"""Checks of the response to hostile input: a scene that survives a round trip, or a readable message."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from tisim import Result, RunError, Scene
from tisim.backend.runtime import Runtime
from tisim.cli.main import main
from tisim.engine.assembly import measured
from tisim.engine.monitor import REASONS
from tisim.state.status import WorldStatus

ACCEPTED = "accepted"
"""The message of a command in place of a run."""
OF_THE_WORLD = WorldStatus.OUT_OF_CAPACITY, WorldStatus.CONTACT_OVERFLOW
"""Failures for lack of capacity, which name no particle or force."""


def check_message(text: str) -> None:
    """Check an error message: a line for each fault, of bounded length and printable."""
    lines = text.splitlines()
    assert 0 < len(lines) <= 10, text[:2000]
    for line in lines:
        assert line.isprintable(), line[:2000]
        assert " must " in line, line[:2000]
        assert "; received " in line, line[:2000]
        assert len(line) < 1500, line[:2000]


def check_file(accepted: Scene, file: Path) -> None:
    """Check that a scene survives a round trip through its file, bit for bit."""
    file.write_text(accepted.to_toml(), encoding="utf-8")
    again = Scene.from_toml(file)
    assert again.to_dict() == accepted.to_dict()
    assert again.digest() == accepted.digest()


@contextmanager
def nothing_runs() -> Iterator[list[Scene]]:
    """Let commands proceed until they would start or compile anything, and end there with ACCEPTED; yields
    the scenes that would have been run."""
    scenes: list[Scene] = []

    def accept(*scene: Any, **options: Any) -> None:
        scenes.extend(one for one in scene if isinstance(one, Scene))
        raise RunError(ACCEPTED)

    with ExitStack() as patches:
        for place in (
            "tisim.cli.run.Simulation",
            "tisim.cli.cost._measure",
            "tisim.optimize.session.session",
        ):
            patches.enter_context(patch(place, accept))
        patches.enter_context(patch("tisim.backend.runtime.init", Runtime))
        yield scenes


def command(words: Sequence[str]) -> tuple[int, str]:
    """Exit code and standard error of a command given in this process."""
    out, err = io.StringIO(), io.StringIO()
    code: Any = None
    with redirect_stdout(out), redirect_stderr(err):
        try:
            main(list(words))
        except SystemExit as end:
            code = end.code
    return code, err.getvalue()


def check_result(result: Result) -> None:
    """Check that a result is finite, and that a failure states the time, and a particle, a force or a
    capacity.

    A start that fails is returned unchanged; quantities derived from it, such as forces and the virial, need
    not be finite.
    """
    if result.measures:
        assert result.measures.keys() == measured(result.scene.effects).keys()
    begun = result.status.ok or result.time > 0
    reported = {name: values for name, values in result.state.items() if begun or name in result.start}
    measures = result.measures if begun else {}
    for name, values in {**reported, **measures, "time": result.time}.items():
        assert np.isfinite(values).all(), f"{name} is not finite, and the status is {result.status}"
    if result.status.ok or result.status.reason == REASONS[WorldStatus.RUNNING]:
        return
    assert re.fullmatch(r"found at t = \S+ s: .+; kept t = \S+ s", result.status.reason), result.status.reason
    names_culprit = "particle" in result.status.reason or "effects." in result.status.reason
    assert names_culprit or any(REASONS[code] in result.status.reason for code in OF_THE_WORLD), (
        result.status.reason
    )
