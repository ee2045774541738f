"""Pages that are made again when their files have changed, as those of a search or a study of costs.

Making a page takes longer the more there is to show. After the first time it waits until that is at most a
share of the cores (see budget.py).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from tisim.files import regular_file
from tisim.watch.budget import Budget
from tisim.watch.watched import POLL, UNREADABLE, Watched, waiting_page

PAGE_CREDIT = 0.1
"""Processor time in reserve, s: twice that of a page of 2,000 designs."""


class RemadePage(Watched):
    """A page that is made again when its files have changed; its ``answers`` are for a ``WatchServer``.

    A subclass defines ``make``. Its script reads the page again when the news say that it has changed.

    subject : of the page. script : name of a file in report/static.
    """

    subject: ClassVar[str]
    script: ClassVar[str]

    def __init__(self, files: Sequence[Path], budget: Budget | None = None) -> None:
        """files : whose changes are looked for."""
        self._files, self._budget = files, budget or Budget(credit=PAGE_CREDIT)
        self._lock = threading.Lock()
        self._made: tuple[str, str] = ("", "")
        self._ended = False

    def make(self, live: Mapping[str, Any]) -> tuple[str, bool]:
        """Return the page as HTML, and whether its subject has ended. live : facts for its script."""
        raise NotImplementedError

    def page(self) -> str:
        """Return the page; or one that waits for the files."""
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
                why = f"The {self.subject} cannot be read at this moment: {failure}."
                return waiting_page(self._files[0].parent, why, "remade.js", self.script)

    def _make(self, version: str) -> str:
        text, self._ended = self.make({"version": version, "poll": POLL})
        self._made = version, text
        return text

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
        found = [one for path in self._files if (one := regular_file.file_status(path))]
        marks = [f"{one.st_ino:x}.{one.st_size:x}.{one.st_mtime_ns:x}" for one in found]
        return "-".join(marks), max((one.st_mtime for one in found), default=0.0)
