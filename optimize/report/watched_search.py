"""The page of a search that is watched."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from tisim.files import regular_file
from tisim.optimize.report.search_data import read_search
from tisim.optimize.report.search_page import SearchPageOptions, search_html
from tisim.optimize.search_folder import SEARCH_FILE
from tisim.optimize.storage.cache import cache_files
from tisim.watch.budget import Budget
from tisim.watch.remade import RemadePage


class WatchedSearch(RemadePage):
    """The folder of a search that is watched."""

    subject: ClassVar[str] = "search"
    script: ClassVar[str] = "watch_search.js"

    def __init__(
        self, folder: Path, options: SearchPageOptions | None = None, budget: Budget | None = None
    ) -> None:
        """folder : of the search, or its search.h5. options : of the page."""
        self._file = folder / SEARCH_FILE if regular_file.is_folder(folder) else folder
        self._options = options
        super().__init__(cache_files(self._file)[:2], budget)

    def make(self, live: Mapping[str, Any]) -> tuple[str, bool]:
        data = read_search(self._file)
        ended = data.stopped not in ("", "interrupted")
        facts = {**live, "ended": ended, "designs": len(data)}
        return search_html(data, self._options, facts), ended
