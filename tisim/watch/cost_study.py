"""The page of a study of costs that is watched; its file is written again after each setting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

from tisim.accuracy.storage import HDF5, stored
from tisim.files import regular_file
from tisim.report.cost_report import cost_page
from tisim.report.page import WATCHED_COST_SCRIPTS
from tisim.watch.budget import Budget
from tisim.watch.remade import RemadePage


class WatchedStudy(RemadePage):
    """The folder of a study of costs that is watched."""

    subject: ClassVar[str] = "study of costs"
    script: ClassVar[str] = "watch_cost.js"

    def __init__(self, folder: Path, budget: Budget | None = None) -> None:
        """folder : of the study, or its cost.h5."""
        self._file = folder / HDF5 if regular_file.is_folder(folder) else folder
        super().__init__([self._file], budget)

    def make(self, live: Mapping[str, Any]) -> tuple[str, bool]:
        study = stored(self._file)
        page = cost_page(study)
        if not study.complete:
            # It is not known whether the study goes on.
            page = replace(page, notices=["Not all settings are measured yet.", *page.notices[1:]])
        facts = {**page.facts, "live": {**live, "ended": study.complete, "settings": len(study.rows)}}
        return replace(page, facts=facts, scripts=WATCHED_COST_SCRIPTS, connects=True).html(), study.complete
