"""The contract of folders that are watched: a page, and the news since it was made."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tisim.errors import InputError, RunError
from tisim.report.page import COMMON_SCRIPTS, Page
from tisim.watch.server import Replies, Reply

POLL = 2.0
"""Time between two requests of a browser, s."""
UNREADABLE = (InputError, RunError, OSError)
"""Errors of files that change, or are damaged."""


class Watched:
    """A folder that is watched; its ``answers`` are for a ``WatchServer``."""

    def page(self) -> str:
        """Return the page as HTML; or one that waits for the files."""
        raise NotImplementedError

    def news(self, query: Mapping[str, str]) -> dict[str, Any]:
        """Return the changes since the page of a query was made, as plain data."""
        raise NotImplementedError

    @property
    def answers(self) -> Replies:
        """Return the functions that answer requests: for the page, and for news."""
        return {
            "": lambda query: Reply(self.page().encode(), "text/html"),
            "news": lambda query: Reply(json.dumps(self.news(query)).encode(), "application/json"),
        }


def waiting_page(path: Path, why: str, *scripts: str) -> str:
    """Return the HTML of a page that asks its server until there are files to show, with the reason to wait.

    scripts : names of files in report/static, the last of which asks the server.
    """
    return Page(
        title=path.name or str(path),
        state="unfinished",
        verdict="waiting",
        summary=why,
        facts={"live": {"waiting": True, "poll": POLL}},
        recording=b"",
        scripts=(*COMMON_SCRIPTS, "live.js", *scripts),
        view="",
        connects=True,
    ).html()
