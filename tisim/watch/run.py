"""The page of a run that is watched, and the frames that are new since a browser has last asked.

A trajectory can be read while it grows (see io/trajectory.py). Of a run without one, the page waits for the
result. After the first page, reading and compressing take at most a share of the cores (see budget.py): if
frames come faster, only some of them are shown, the last one included. Once the run has ended, the browser
asks for all.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from tisim.engine.result import Result
from tisim.files import regular_file
from tisim.io.reader import Frame, Frames, frames
from tisim.plotting import time_series
from tisim.report import tables
from tisim.report.compressed_trajectory import compress
from tisim.report.contact_network import contact_network, has_contacts
from tisim.report.kept_frames import KeptFrames, ListedFrames
from tisim.report.page import WATCHED_RUN_SCRIPTS, Page, text_data
from tisim.report.run_report import numbers, result_of, rounding, run_page, status_of, summary
from tisim.report.viewer_data import ReportOptions, player_facts
from tisim.scene.scene import Scene
from tisim.watch.budget import Budget
from tisim.watch.watched import POLL, UNREADABLE, Watched, waiting_page

UPDATE_SECONDS = 0.05
"""Processor time of an update that is aimed at, s; it always has one frame."""
FIRST_RATE, MANY_FRAMES = 3e-6, 20
"""Processor time for a particle in a frame, assumed before it is measured, s; and the number of frames from
which on the first page is a measurement."""


@dataclass(frozen=True)
class _Opened:
    """A file of a run. inode : of the file. first : its first frame."""

    inode: int
    scene: Scene
    key: str
    first: Frame


def _reached(sequence: Frames) -> str:
    reached, scene = float(sequence.times[-1]), sequence.scene
    # A stepper that ends the run by itself does so long before the duration.
    end = "" if scene.stepper.ends else f" of {scene.duration:.6g} s"
    return f"The run has come to t = {reached:.6g} s{end}."


class WatchedRun(Watched):
    """The folder of a run that is watched, or one of its files.

    Its ``answers`` are for a ``WatchServer``. An unreadable file gives the last good state, and the reason.
    """

    def __init__(
        self, path: Path, world: int = 0, options: ReportOptions | None = None, budget: Budget | None = None
    ) -> None:
        """world : index in a batch. options : of the page."""
        self._path, self._world = path, world
        # Parts of a recording must agree in the kind of their scales.
        self._options = replace(options or ReportOptions(), logarithmic=False)
        self._budget = budget or Budget()
        self._lock = threading.Lock()
        self._opened: _Opened | None = None
        self._result: tuple[Any, Result | None] = (None, None)
        self._rate = FIRST_RATE
        # The end of the run, and the state of the files that was read last with its number of frames.
        self._end, self._read = "", (tuple[Any, ...](), 0)

    def check(self) -> None:
        """Raise InputError if there is a file that is not of a run, or that has no such world."""
        if (file := self._file()) is not None:
            with frames(file, self._world):
                pass

    def page(self) -> str:
        """Return the page with all frames that exist, thinned to the limit; or one that waits for them."""
        with self._lock, self._budget.exempt():
            began = time.process_time()
            try:
                file = self._file()
                if file is None:
                    return waiting_page(self._path, "There is no frame yet.", "watch.js")
                with frames(file, self._world) as sequence:
                    if not len(sequence):
                        return waiting_page(self._path, "There is no frame yet.", "watch.js")
                    opened = self._open(file, sequence)
                    result = self._ended(file, opened.scene, sequence)
                    page = run_page(KeptFrames(sequence), self._options, result)
                    values = len(sequence) * len(opened.first.arrays["id"])
            except UNREADABLE as failure:
                return waiting_page(
                    self._path, f"The run cannot be read at this moment: {failure}.", "watch.js"
                )
            # Of few frames, imports and the text of the scene take most of the time.
            if len(sequence) >= MANY_FRAMES and values:
                self._rate = (time.process_time() - began) / values
        live = self._state(file) | {
            "key": opened.key, "after": len(sequence) - 1, "poll": POLL, "all": len(sequence),
        }  # fmt: skip
        page = self._going_on(page, sequence)
        return replace(
            page,
            facts={**page.facts, "live": live},
            scripts=WATCHED_RUN_SCRIPTS,
            connects=True,
        ).html()

    def news(self, query: Mapping[str, str]) -> dict[str, Any]:
        """Return the changes since a frame, as plain data.

        query : ``key`` of the run; ``after``, the index of the last frame that the browser knows, -1 to read
            all frames again.
        """
        with self._lock:
            try:
                return self._news(query.get("key", ""), int(query.get("after", "-1")))
            except UNREADABLE as failure:
                return {"problem": str(failure)}
            except ValueError:
                return {"reload": True}

    def _news(self, key: str, after: int) -> dict[str, Any]:
        file = self._file()
        if file is None:
            return {"waiting": True}
        state, marks = self._state(file), self._marks(file)
        if self._read == (marks, after + 1):
            return state | {"after": after}
        seen = self._opened is not None and self._opened.key == key
        wait = self._budget.wait()
        if wait and not (state["ended"] and after < 0):
            return state | {"wait": wait}
        with frames(file, self._world) as sequence:
            count = len(sequence)
            if not count:
                return {"waiting": True}
            opened = self._open(file, sequence)
            if not seen or opened.key != key or after >= count:
                return {"reload": True}
            result = self._ended(file, opened.scene, sequence)
            state = self._state(file)
            if after == count - 1:
                self._read = marks, count
                return state | {"after": after}
            if after < 0:
                return state | self._whole(sequence, result)
            return state | self._new(sequence, opened, result, after)

    def _whole(self, sequence: Frames, result: Result | None) -> dict[str, Any]:
        """Return all frames as plain data, thinned to the limit."""
        kept = KeptFrames(sequence)
        page = self._going_on(run_page(kept, self._options, result), sequence)
        return {
            "facts": page.facts, "recording": text_data(page.recording), "after": len(kept) - 1,
            "shown": len(page.facts["trajectory"]["times"]), "all": len(kept), "notices": page.notices,
            "state": page.state, "verdict": page.verdict,
            "rounding": page.footer[0], "summary": page.summary,
            "numbers": numbers(result, (kept[0].arrays, kept[-1].arrays)),
        }  # fmt: skip

    def _new(self, sequence: Frames, opened: _Opened, result: Result | None, after: int) -> dict[str, Any]:
        """Return new frames as plain data: the last one, and others before it as UPDATE_SECONDS allows."""
        count, particles = len(sequence), max(len(opened.first.arrays["id"]), 1)
        most = max(1, int(UPDATE_SECONDS / (self._rate * particles)))
        stride = -(-(count - 1 - after) // most)
        chosen = list(range(count - 1, after, -stride))[::-1]
        began = time.process_time()
        new = [sequence[k] for k in chosen]
        facts, recording, told = self._part(opened, new, chosen)
        self._rate = (time.process_time() - began) / sum(len(one.arrays["id"]) + 1 for one in new)
        first, last = opened.first, new[-1]
        state, verdict, sentences = status_of(sequence.missing, result)
        if not self._end:
            verdict, sentences = "running", [_reached(sequence)]
        ends = len(first.arrays["mass"]), len(last.arrays["mass"])
        return {
            "facts": facts, "recording": text_data(recording), "after": count - 1, "shown": len(chosen),
            "all": count, "notices": sentences, "state": state,
            "verdict": verdict, "rounding": told,
            "summary": summary(ends, count, count, (first.time, last.time)),
            "numbers": numbers(result, (first.arrays, last.arrays)),
        }  # fmt: skip

    def _going_on(self, page: Page, sequence: Frames) -> Page:
        """Return the page with the words of a run that goes on, if it does."""
        if self._end:
            return page
        return replace(page, verdict="running", notices=[_reached(sequence), *page.notices[1:]])

    def _part(
        self, opened: _Opened, new: Sequence[Frame], chosen: Sequence[int]
    ) -> tuple[dict[str, Any], bytes, str]:
        """Return new frames as a part of a recording, with the points of the curves, and their rounding."""
        some = ListedFrames(opened.scene, [opened.first, *new])
        trajectory = compress(some, range(1, len(some)), 1, self._options.fields, False)
        contacts = self._options.contacts and has_contacts(opened.scene)
        network = contact_network(some, trajectory) if contacts else None
        facts, recording = player_facts(some, trajectory, network)
        facts["trajectory"] = {**trajectory.facts(), "indices": list(chosen)}
        series = time_series.history(cast(Frames, some))
        times, panels = tables.time_series(series, opened.scene, some.measures, number=True)
        for panel in cast(list[dict[str, Any]], panels):
            for curve in panel["curves"]:
                curve["values"] = curve["values"][1:]
        facts["series"] = {"times": tables.digits(times[1:]), "curves": panels}
        return facts, recording, rounding(trajectory, network)

    def _file(self) -> Path | None:
        """Return the trajectory, or else the result; None if there is neither."""
        if not regular_file.is_folder(self._path):
            return self._path if regular_file.exists(self._path) else None
        found = (self._path / name for name in ("trajectory.h5", "result.h5"))
        return next((file for file in found if regular_file.exists(file)), None)

    def _open(self, file: Path, sequence: Frames) -> _Opened:
        """Return the scene and the first frame of an open file, which are read once."""
        inode = file.stat().st_ino
        if self._opened is None or self._opened.inode != inode:
            scene = sequence.scene
            self._opened = _Opened(inode, scene, scene.digest()[:32], sequence[0])
        else:
            # Reading the scene again would take longer than a frame.
            sequence.scene = self._opened.scene
        return self._opened

    def _ended(self, file: Path, scene: Scene, sequence: Frames) -> Result | None:
        """Return the result of the run if it has one; it is read once."""
        mark = self._marks(file)[1]
        if mark != self._result[0]:
            self._result = mark, result_of(file, scene) if mark else None
        result = self._result[1]
        self._end = "result" if result is not None else "" if sequence.missing else "frames"
        return result

    def _marks(self, file: Path) -> tuple[Any, ...]:
        """Return marks of the file and of the result beside it, which differ when they have changed."""
        found = (regular_file.file_status(path) for path in (file, file.with_name("result.h5")))
        return tuple(one and (one.st_ino, one.st_size, one.st_mtime_ns) for one in found)

    def _state(self, file: Path) -> dict[str, Any]:
        """Return how the run has ended ("" if it has not, "frames" if its frames are complete, "result" if it
        has a result), and the time since the last change of the file, s."""
        return {"ended": self._end, "age": max(0.0, time.time() - file.stat().st_mtime)}
