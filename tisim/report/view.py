"""The viewer of a report in the output of a cell of a notebook."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tisim.engine.result import Result
from tisim.errors import Words, must
from tisim.files import regular_file
from tisim.io.reader import Frame, RecordedWorld, frames
from tisim.notebook import VIEWER_HEIGHT, ViewerCell
from tisim.report.compressed_trajectory import FrameSequence
from tisim.report.kept_frames import KeptFrames, ListedFrames
from tisim.report.page import Page
from tisim.report.viewer_data import ReportOptions, viewer_data

CELL_LIMIT = 5.0
"""Default for the largest size of a page in a notebook, which stores it, MB."""
CELL_RESERVED_BYTES = 0.1e6
"""Bytes of such a page for everything but the recording, without large walls."""


def view(
    run: Result | RecordedWorld | str | Path,
    height: int = VIEWER_HEIGHT,
    world: int = 0,
    limit: float = CELL_LIMIT,
    fields: Sequence[str] | None = None,
    contacts: bool = True,
) -> ViewerCell:
    """Return a viewer of the particles of a run, which a notebook shows in the output of a cell.

    run : a result, which has the start and the end; a trajectory; or the path of a trajectory.h5, of a
        result.h5, or of the folder of a run, whose trajectory is shown if it has one.
    height : of the viewer, pixels. world : index in a batch, for a file.
    limit : largest size of the page, which the notebook stores, MB; frames are left out until it is kept.
    fields : quantities of the particles for colours; None for all. contacts : whether to store the contacts
        of grains.

    Raise InputError if there are no frames, or if an option does not fit.
    """
    options = ReportOptions(limit=limit, fields=fields, contacts=contacts)
    ViewerCell("", height)  # refuses a wrong height before anything is read
    # Before its state is read: otherwise a failed run would warn.
    reason = run.status.reason if isinstance(run, Result) and run.status.failed else ""
    with _frames(run, world) as sequence:
        must(len(sequence) > 0, "run", "one with a frame", Words("one with none yet"))
        data = viewer_data(sequence, options, CELL_RESERVED_BYTES)
    page = Page(
        title=sequence.scene.name,
        state="failed" if reason else "ok",
        verdict="",
        summary="",
        facts=data.facts | {"series": {"times": [], "curves": []}},
        recording=data.recording,
        notices=[*([f"The run failed {reason}."] if reason else []), *data.notices],
        kind="cell",
    )
    return ViewerCell(page.html(), height)


@contextmanager
def _frames(run: Result | RecordedWorld | str | Path, world: int) -> Iterator[FrameSequence]:
    if isinstance(run, Result):
        steps = run.work.get("steps", 0)
        yield ListedFrames(run.scene, (Frame(0.0, 0, run.start), Frame(run.time, steps, run.state)))
    elif isinstance(run, RecordedWorld):
        yield run
    else:
        must(isinstance(run, str | Path), "run", "a Result, a trajectory, or the path of one", run)
        path = Path(run)
        if regular_file.is_folder(path):
            found = (path / name for name in ("trajectory.h5", "result.h5"))
            file = next((one for one in found if regular_file.exists(one)), None)
            must(file is not None, "folder", "one with a trajectory.h5 or result.h5", str(path))
            path = file or path
        with frames(path, world) as sequence:
            yield KeptFrames(sequence)
