"""Runs of designs that are made for the page of a search, because a search keeps no particles."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tisim
from tisim.errors import InputError, must
from tisim.io.reader import frames
from tisim.io.recording import Recording
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.problem.problem import Problem
from tisim.optimize.report.report import spread
from tisim.optimize.report.search_data import SearchData
from tisim.optimize.search_folder import different_problem
from tisim.optimize.settings import Settings, identity
from tisim.report.kept_frames import KeptFrames
from tisim.report.viewer_data import ReportOptions, player_facts, recording

RECORDED_FRAMES = 40
"""Number of frames of a recorded design after its start."""
PARTICLES_SHARE = 0.8
"""Part of the size of a page that recorded designs may take."""


@dataclass(frozen=True)
class RecordedDesign:
    """A run of a design from its first start.

    design : its index in the search. about : sentences about the run. facts, data : the recording that a
        browser plays, see ``player_facts``.
    """

    design: int
    about: str
    facts: Mapping[str, Any]
    data: bytes


def check_problem(data: SearchData, problem: Problem) -> None:
    """Raise InputError unless a search is one of this problem; the message lists the differences."""
    evaluator = data.identity["evaluator"]
    differences = different_problem(data.identity, identity(problem, Settings(), evaluator))
    if differences:
        raise InputError(
            f"problem must be the one of the search {data.name}; received one that differs ("
            f"{'; '.join(differences)})"
        )


def best_designs(data: SearchData, count: int) -> list[int]:
    """Return the indices of some designs of the hall of fame, at most a number of them: the best ones; of a
    front the compromise, and others spread along the front."""
    best = [k for k, one in enumerate(data.facts.get("best", ())) if one][:count]
    ranked = sorted((rank, k) for k, rank in enumerate(data.facts.get("rank", ())) if rank)
    others = [k for _, k in ranked if k not in best]
    left = count - len(best)
    if len(data.objectives) > 1 and left > 0:
        return [*best, *(others[k] for k in spread(len(others), left))]
    return [*best, *others[:left]]


def scenes(data: SearchData, problem: Problem, designs: Sequence[int]) -> dict[int, Any]:
    """Return the scene of the first start of each design, by index."""
    seed = int(data.settings["seed"])
    found = {}
    for k in designs:
        design = data.design(k)
        found[k] = problem.scene(design, start_seed(seed, 0, None if data.common_starts else design))
    return found


def record(
    data: SearchData,
    problem: Problem,
    designs: Sequence[int],
    limit: float,
    progress: Callable[[float], None] | None = None,
) -> list[RecordedDesign]:
    """Run designs from their first start, and return their recordings.

    limit : size of the page, MB; frames are left out to keep it.
    progress : called with the finished fraction.

    InputError for a problem that is a plain function, which has no particles.
    """
    must(problem.function is None, "problem", "one with particles, for start and end clouds", problem.name)
    of_designs = scenes(data, problem, designs)
    if not of_designs:
        return []
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "designs.h5"
        results = tisim.run(list(of_designs.values()), progress, Recording(path, frames=RECORDED_FRAMES))
        options = ReportOptions(max(0.5, PARTICLES_SHARE * limit / len(designs)))
        for world, (k, result) in enumerate(zip(of_designs, results, strict=True)):
            with frames(path, world) as sequence:
                kept = KeptFrames(sequence)
                trajectory, network, notices = recording(kept, options, 0.0)
                facts, content = player_facts(kept, trajectory, network)
            count = len(trajectory.times)
            about = [
                f"Run from its first start for this page: {count} frames to t = {trajectory.times[-1]:.4g} s."
            ]
            if not result.status.ok:
                about.append(f"It failed {result.status.reason}.")
            found.append(RecordedDesign(k, " ".join([*about, *notices]), facts, content))
    return found
