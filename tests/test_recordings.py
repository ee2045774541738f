"""Recordings of the cases in the docs: read again, without a run of a case."""

import base64
import importlib
import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.report.conftest import record, scene
from tisim.cases.case import every
from tisim.io.reader import frames
from tisim.report.bodies import DrawnBody, Mesh
from tisim.report.kept_frames import KeptFrames

__all__ = ["record"]
DOCS = Path(__file__).parents[1] / "docs"
CASES = sorted(every())
PAGES = {"packing": "packings", "cascade": "capture", "concentration": "capture"}
"""Pages of cases that have none of their own name."""


def module(name):
    """A module of docs, which do not belong to a package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        return importlib.import_module(name)


recordings, figures = module("recordings"), module("recorded_figures")


def test_every_case_is_recorded_and_nothing_else():
    known = recordings.every_case()
    assert sorted(known) == CASES
    for name, one in known.items():
        case = every()[name]
        case.size(one.size)
        assert one.variant is None or one.variant in case.scenes
        assert (one.frames is None) != (one.every is None)
    expected = {f"{name}.{kind}" for name in CASES for kind in ("js", "webp")}
    assert {path.name for path in recordings.FOLDER.iterdir()} == expected


@pytest.mark.parametrize("name", CASES)
def test_a_recording_is_small_and_holds_its_particles(name):
    one = recordings.every_case()[name]
    text = one.script.read_text(encoding="utf-8")
    assert len(text) <= recordings.LARGEST
    of, facts, values = recordings.decoded(text)
    trajectory, colour = facts["trajectory"], facts["colour"]
    assert (of, facts["name"], colour) == (name, name, one.colour)
    frame_count = len(trajectory["times"])
    assert frame_count >= recordings.LEAST_FRAMES
    assert np.all(np.diff(trajectory["times"]) > 0)
    present = np.broadcast_to(values["id"][..., 0] >= 0, (frame_count, trajectory["particles"]))
    assert present.sum(axis=1).tolist() == trajectory["counts"]
    place = np.broadcast_to(values["position"], (*present.shape, 3))
    inside = (place >= np.array(trajectory["low"])) & (place <= np.array(trajectory["high"]))
    assert inside[present].all()
    assert (np.ptp(place, axis=0).max() > 0) or name == "packing"
    radius = np.broadcast_to(values["radius"][..., 0], present.shape)
    assert (radius[present] > 0).all()
    # As the viewer of today reads them.
    drawn = DrawnBody("wall", Mesh.of(np.zeros((1, 3, 3)), np.zeros((0, 2, 3)))).facts()
    assert all(body.keys() == drawn.keys() for body in facts["scene"]["bodies"])
    assert {"box", "focus", "magnets", "shapes", "gravity", "lines"} < facts["scene"].keys()
    if colour:
        shown = next(column["shown"] for column in trajectory["columns"] if column["name"] == colour)
        tints = np.broadcast_to(values[colour][..., 0], present.shape)
        assert shown[0] < np.nanmax(tints[present])


def test_all_recordings_and_pictures_are_small():
    sizes = {path.name: path.stat().st_size for path in recordings.FOLDER.iterdir()}
    assert sum(sizes.values()) <= recordings.LARGEST_IN_ALL
    assert max(size for name, size in sizes.items() if name.endswith("webp")) < 60_000


def test_the_gallery_and_the_page_of_each_case_show_its_recording():
    told = figures.told()
    assert sorted(told) == CASES
    for name in CASES:
        page = (DOCS / f"{PAGES.get(name, name)}.md").read_text(encoding="utf-8")
        assert re.search(rf"^!\[[^\]]+\]\(_static/recordings/{name}\.webp\)$", page, re.M), name
        section = told[name]
        assert section.question.endswith("?")
        assert section.command.startswith(f"tisim {section.command.split()[1]} {name}")
        assert len(section.finding) > 40
        assert not re.search(r"[\[\]`]|The case", section.finding)


def test_the_caption_says_what_is_recorded_and_only_the_gallery_leaves_out_the_finding():
    told, one = figures.told(), recordings.every_case()["packing"]
    html = figures.figure_html(one, "a.webp", 'rods "<b>"', told, "packings")
    assert 'alt="rods &quot;&lt;b&gt;&quot;"' in html
    for part in (told["packing"].question, told["packing"].finding, "60 particles; ", one.note):
        assert part in html
    assert "tisim run packing <span>--size</span> small <span>--variant</span> rods" in html
    assert told["packing"].finding not in figures.figure_html(one, "a.webp", "", told, "gallery")


@pytest.mark.parametrize(
    ("counts", "whole", "expected"),
    [
        ([5, 5], {"frames": 2, "particles": [5, 5]}, "5 particles; 2 frames"),
        ([5, 2], {"frames": 2, "particles": [5, 2]}, "5 particles at the start, 2 at the end; 2 frames"),
        ([3, 3], {"frames": 9, "particles": [5, 5]}, "3 of 5 particles; 2 frames of 9"),
    ],
)
def test_the_caption_tells_of_frames_and_particles_that_are_left_out(counts, whole, expected):
    facts = {"trajectory": {"counts": counts, "times": [0.0, 1.0]}, "whole": whole}
    assert recordings.contents(facts) == expected


@pytest.mark.long
def test_frames_and_then_particles_are_left_out_until_the_limit_is_kept(record, rng, monkeypatch):
    made, ids = [], np.arange(150)
    for _ in range(80):
        made.append({"id": ids, "position": rng.uniform(-0.01, 0.01, (150, 3))})
    one = recordings.Recorded("packing", "small", "speed", frames=79)
    with frames(record(scene(150), made)) as trajectory:
        sequence = KeptFrames(trajectory)
        whole = recordings.thinned(one, sequence, 1.0)
        found = {}
        for part in (0.6, 0.2):
            monkeypatch.setattr(recordings, "LARGEST", int(part * len(whole)))
            text = recordings.thinned(one, sequence, 1.0)
            assert len(text) <= recordings.LARGEST
            found[part] = recordings.contents(recordings.facts_of(text))
    # Half of the frames, rounded up, and the last.
    assert found[0.6] == "150 particles; 41 frames of 80"
    assert re.fullmatch(r"\d+ of 150 particles; 41 frames of 80", found[0.2])
    _, facts, values = recordings.decoded(whole)
    shown = values["position"]
    half = 0.5 * np.array(next(c["step"] for c in facts["trajectory"]["columns"] if c["name"] == "position"))
    for k, frame in enumerate(made):
        assert np.abs(shown[k] - frame["position"]).max() <= half.max() * (1 + 1e-9)


def test_a_recording_that_is_cut_or_has_bytes_too_many_is_refused():
    text = recordings.every_case()["vibration"].script.read_text(encoding="utf-8")
    with pytest.raises(ValueError, match="not the script"):
        recordings.decoded(text[:-10])
    name, facts, data = json.loads(f"[{text[len(recordings.BEGIN) : -len(recordings.END)]}]")
    facts["lengths"][-1] -= 1
    with pytest.raises(Exception, match="incomplete"):
        recordings.decoded(f"{recordings.BEGIN}{json.dumps([name, facts, data])[1:-1]}{recordings.END}")
    facts["lengths"][-1] += 1
    longer = base64.b64encode(base64.b64decode(data) + b"abc").decode()
    more = json.dumps([name, facts, longer])[1:-1]
    with pytest.raises(ValueError, match="3 bytes more"):
        recordings.decoded(f"{recordings.BEGIN}{more}{recordings.END}")


def test_the_script_of_the_viewer_is_for_a_shadow_root_and_has_one_name():
    script = figures.viewer()
    assert ":root" not in script
    assert ':host([data-theme=\\"dark\\"])' in script
    assert re.findall(r"^window\.\w+", script, re.M) == ["window.tisimViewer"]
    assert all(f"class {name} " in script for name in ("Trajectory", "Viewer", "Player"))
