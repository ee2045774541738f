"""The page of a search that is watched, made again from its folder when its files have changed.

Making the page takes longer the more runs the search has. After the first time it waits until that is at most
a share of the cores (see watch/budget.py).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tisim.files import regular_file
from tisim.optimize.report.search_data import read_search
from tisim.optimize.report.search_page import SearchPageOptions, search_html
from tisim.optimize.search_folder import SEARCH_FILE
from tisim.optimize.storage.cache import cache_files
from tisim.watch.budget import Budget
from tisim.watch.watched import POLL, UNREADABLE, Watched, waiting_page

SCRIPT = "watch_search.js"
PAGE_CREDIT = 0.1
"""Processor time in reserve, s: twice that of a page of 2,000 designs."""


class WatchedSearch(Watched):
    """The folder of a search that is watched; its ``answers`` are for a ``WatchServer``."""

    def __init__(
        self, folder: Path, options: SearchPageOptions | None = None, budget: Budget | None = None
    ) -> None:
        """folder : of the search, or its search.h5. options : of the page."""
        self._file = folder / SEARCH_FILE if regular_file.is_folder(folder) else folder
        self._options, self._budget = options, budget or Budget(credit=PAGE_CREDIT)
        self._lock = threading.Lock()
        self._made: tuple[str, str] = ("", "")
        self._ended = False

    def page(self) -> str:
        """Return the page; or one that waits for the search."""
        with self._lock:
            try:
                version, _ = self._version()
                if version and self._made[0] == version:
                    return self._made[1]
                if self._made[0]:
                    return self._make(version)
                with self._budget.exempt():
                    return self._make(version)
            except UNREADABLE as failure:
                why = f"The search cannot be read at this moment: {failure}."
                return waiting_page(self._file.parent, why, SCRIPT)

    def _make(self, version: str) -> str:
        data = read_search(self._file)
        ended = data.stopped not in ("", "interrupted")
        live = {"version": version, "poll": POLL, "ended": ended, "designs": len(data)}
        self._made, self._ended = (version, search_html(data, self._options, live)), ended
        return self._made[1]

    def news(self, query: Mapping[str, str]) -> dict[str, Any]:
        """Return whether the files have changed since a version of the page, once it may be made again."""
        with self._lock:
            try:
                version, changed = self._version()
            except UNREADABLE as failure:
                return {"problem": str(failure)}
            if not version:
                return {"waiting": True}
            state = {"ended": self._ended, "age": max(0.0, time.time() - changed)}
            wait = self._budget.wait()
            return state | {"changed": version != query.get("version", "") and not wait, "wait": wait}

    def _version(self) -> tuple[str, float]:
        """Return a text that differs when the files have changed, "" if there are none, and the time of the
        last change, s."""
        found = [one for path in cache_files(self._file)[:2] if (one := regular_file.file_status(path))]
        marks = [f"{one.st_ino:x}.{one.st_size:x}.{one.st_mtime_ns:x}" for one in found]
        return "-".join(marks), max((one.st_mtime for one in found), default=0.0)
