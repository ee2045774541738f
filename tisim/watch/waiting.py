"""A page that asks its server until there are files to show."""

from __future__ import annotations

from pathlib import Path

from tisim.errors import InputError, RunError
from tisim.report.page import COMMON_SCRIPTS, Page

POLL = 2.0
"""Time between two requests of a browser, s."""
UNREADABLE = (InputError, RunError, OSError)
"""Errors of files that change, or are damaged."""


def waiting_page(path: Path, why: str, script: str) -> str:
    """Return the HTML of a page about the files of a path, with the reason why it has nothing else.

    script : name of a file in report/static, which asks the server.
    """
    return Page(
        title=path.name or str(path),
        state="unfinished",
        verdict="waiting",
        summary=why,
        facts={"live": {"waiting": True, "poll": POLL}},
        recording=b"",
        scripts=(*COMMON_SCRIPTS, "live.js", script),
        view="",
        connects=True,
    ).html()
