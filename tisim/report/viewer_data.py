"""The data of the viewer on a page: frames with their contacts, and everything drawn beside the particles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tisim.errors import must
from tisim.report.compressed_trajectory import CompressedTrajectory, FrameSequence, compress
from tisim.report.contact_network import ContactNetwork, contact_network, has_contacts
from tisim.report.scenery import colour_maps, scenery
from tisim.report.spectrum import Spectrum

SIZE_LIMIT = 15.0
"""Default for the largest size of a report, MB (10^6 bytes)."""
LEAST_ROOM = 0.1e6
"""Bytes that a recording may always have."""


@dataclass(frozen=True)
class ReportOptions:
    """The choices for a report.

    limit : largest size of the file, MB. Frames are left out until it is kept, and the page says so.
    fields : quantities of the particles for colours; None for all.
    contacts : whether to store the contacts of grains.
    pictures : further pictures as PNG, by title. spectra : of a quantity of the run.
    checks : rows of text of a table of checks, from ``read_checks``.
    lines : a field whose lines in the last frame are shown: "magnetic", "electric" or "flow"; None for none.
    logarithmic : whether quantities whose values spread over decades have logarithmic scales of colours.
    """

    limit: float = SIZE_LIMIT
    fields: Sequence[str] | None = None
    contacts: bool = True
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    spectra: Sequence[Spectrum] = ()
    checks: Sequence[Sequence[str]] = ()
    lines: str | None = None
    logarithmic: bool = True

    def __post_init__(self) -> None:
        must(0.5 <= self.limit < np.inf, "limit", "at least 0.5 MB, and finite", self.limit)


@dataclass(frozen=True)
class ViewerData:
    """The data of a viewer.

    facts : plain data. recording : the compressed frames, one column after another, and the contacts.
    network : these contacts; None without any.
    notices : sentences about frames, particles and contacts that are left out.
    """

    trajectory: CompressedTrajectory
    facts: dict[str, Any]
    recording: bytes
    notices: Sequence[str] = ()
    network: ContactNetwork | None = None


def viewer_data(sequence: FrameSequence, options: ReportOptions, reserved: float) -> ViewerData:
    """Return the data of the frames that the limit of the options allows.

    reserved : bytes of the page for everything but the recording and the pictures.
    """
    trajectory, network, notices = recording(sequence, options, reserved)
    facts, data = player_facts(sequence, trajectory, network, options.lines)
    return ViewerData(trajectory, facts | {"maps": colour_maps()}, data, notices, network)


def player_facts(
    sequence: FrameSequence,
    trajectory: CompressedTrajectory,
    network: ContactNetwork | None,
    lines: str | None = None,
) -> tuple[dict[str, object], bytes]:
    """Return the recording that a browser plays: plain data, and the compressed frames. lines : a field whose
    lines in the last frame are shown, or None."""
    parts = [one.data for one in trajectory.columns] + ([network.data()] if network is not None else [])
    facts: dict[str, object] = {
        "name": sequence.scene.name, "trajectory": trajectory.facts(), "lengths": [len(one) for one in parts],
        "network": network.facts() if network else None, "scene": scenery(sequence, trajectory, lines),
        "materials": list(sequence.scene.materials),
    }  # fmt: skip
    return facts, b"".join(parts)


def recording(
    sequence: FrameSequence, options: ReportOptions, reserved: float
) -> tuple[CompressedTrajectory, ContactNetwork | None, list[str]]:
    """Return the frames that the limit allows, with their contacts, and sentences about those left out."""
    room = options.limit * 1e6 - reserved - sum(4 / 3 * len(png) for png in options.pictures.values())
    room = 0.75 * max(room, LEAST_ROOM)
    count, particles = len(sequence), max(len(sequence[k].arrays["id"]) for k in (0, -1))
    # A particle usually takes a byte or more in a frame; frames that would hardly fit are not read.
    stride, part = max(1, int(count * particles // room)), 1
    while True:
        chosen = sorted({*range(0, count, stride), count - 1})
        trajectory = compress(sequence, chosen, part, options.fields, options.logarithmic)
        excess = trajectory.size() / room
        if excess <= 1:
            break
        if len(chosen) > 2:
            stride = min(max(stride + 1, int(stride * excess)), max(count - 1, 1))
        else:
            part = max(part + 1, int(part * excess) + 1)
    notices = []
    if len(chosen) < count:
        notices.append(
            f"To keep this file below {options.limit:g} MB, it has one frame in {stride} and the last: "
            f"{len(chosen)} of {count}. The curves below use all frames."
        )
    if part > 1:
        notices.append(f"Only particles whose id is a multiple of {part} are shown, for the same reason.")
    network = None
    if options.contacts and has_contacts(sequence.scene):
        network = contact_network(sequence, trajectory)
        if network is not None and trajectory.size() + len(network.data()) > room:
            network = None
            notices.append("The contacts are left out, because they do not fit this size.")
    return trajectory, network, notices
