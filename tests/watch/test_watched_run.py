"""The page of a run that is watched, and its news, while the run is written."""

import base64
import html
import json
import re

import numpy as np
import pytest

from tisim import Material
from tisim.effects import Granular, Walls
from tisim.engine.result import Status
from tisim.geometry import Plane
from tisim.io.reader import frames
from tisim.report.columns import Column, Scale, whole_numbers
from tisim.report.compressed_trajectory import compress
from tisim.watch import run as module
from tisim.watch.budget import Budget
from tisim.watch.run import WatchedRun


def facts_of(page):
    return json.loads(re.search(r'id="facts">(.*?)</script>', page, re.S)[1])


def text_of(page):
    return html.unescape(re.sub(r"<[^>]*>", "\n", re.sub(r"<(script|style).*?</\1>", "", page, flags=re.S)))


def positions(facts, recording):
    """Positions (m) by id of each frame of a recording, as a browser decodes them."""
    data, begin, found = base64.b64decode(recording), 0, {}
    n = facts["trajectory"]["particles"]
    for one, length in zip(facts["trajectory"]["columns"], facts["lengths"], strict=False):
        scale = Scale(
            one["bits"], tuple(one["origin"]), tuple(one["step"]), one["logarithmic"], one["missing"]
        )
        column = Column(one["name"], "", scale, one["frames"], one["order"], data[begin : begin + length])
        whole = np.broadcast_to(
            whole_numbers(column, n), (len(facts["trajectory"]["times"]), n, len(one["origin"]))
        )
        found[one["name"]] = scale.values(whole)
        begin += length
    ids = found["id"][..., 0].astype(int)
    return [
        {int(one): place for one, place in zip(frame, places, strict=True)}
        for frame, places in zip(ids, found["position"], strict=True)
    ]


def assert_frames(news, run, indices):
    """Assert that news has some frames of a run."""
    facts = news["facts"]
    assert facts["trajectory"]["indices"] == indices
    assert facts["trajectory"]["times"] == pytest.approx([0.01 * k for k in indices])
    assert facts["series"]["times"] == pytest.approx([0.01 * k for k in indices])
    for k, places in zip(indices, positions(facts, news["recording"]), strict=True):
        shown = np.array([places[one] for one in range(run.n)])
        assert np.abs(shown - run.arrays(k)["position"]).max() <= 0.02 / 2**17 * 1.001


def test_new_frames_arrive_and_the_end_is_told(growing, tmp_path, unlimited):
    run, watched = growing(), WatchedRun(tmp_path, budget=unlimited)
    run.write(3)
    page = watched.page()
    live = facts_of(page)["live"]
    assert (live["after"], live["ended"], live["all"]) == (2, "", 3)
    assert "running" in text_of(page).splitlines()
    ask = {"key": live["key"]}
    nothing = watched.news({**ask, "after": "2"})
    assert nothing["after"] == 2
    assert "facts" not in nothing
    assert nothing["age"] < 60
    run.write(2)
    news = watched.news({**ask, "after": "2"})
    assert_frames(news, run, [3, 4])
    assert (news["after"], news["shown"], news["all"]) == (4, 2, 5)
    assert (news["ended"], news["verdict"]) == ("", "running")
    assert news["summary"].startswith("Particles: 40. Frames: 5, from t = 0 s to 0.04 s")
    assert news["notices"] == ["The run has come to t = 0.04 s of 1 s."]
    assert "The run has come to t = 0.02 s of 1 s." in text_of(page).splitlines()
    assert "momentum along x" in news["numbers"]
    run.write()
    run.end()
    news = watched.news({**ask, "after": "4"})
    assert_frames(news, run, [5])
    assert (news["ended"], news["verdict"]) == ("result", "ok")
    everything = watched.news({**ask, "after": "-1"})
    assert_frames(everything, run, list(range(6)))
    assert "particle steps" in everything["numbers"]
    assert facts_of(watched.page())["live"]["ended"] == "result"


def test_a_failed_run_says_why(growing, tmp_path, unlimited):
    run, watched = growing(), WatchedRun(tmp_path, budget=unlimited)
    run.write(2)
    key = facts_of(watched.page())["live"]["key"]
    run.end(Status(False, "at t = 0.01 s: <b>lost</b>"))
    news = watched.news({"key": key, "after": "-1"})
    assert news["verdict"] == "failed"
    assert news["notices"][0] == "The run failed at t = 0.01 s: <b>lost</b>."


def test_curves_of_new_frames_go_on(growing, tmp_path, unlimited):
    run, watched = growing(), WatchedRun(tmp_path, budget=unlimited)
    run.write(6)
    whole = facts_of(watched.page())["series"]
    watched.page()
    key = facts_of(watched.page())["live"]["key"]
    part = watched.news({"key": key, "after": "3"})["facts"]["series"]
    named = {one["title"]: one for one in part["curves"]}
    assert "number of particles" in named
    for one in whole["curves"]:
        for curve, new in zip(one["curves"], named[one["title"]]["curves"], strict=True):
            assert new["label"] == curve["label"]
            assert new["values"] == pytest.approx(curve["values"][4:])


def test_all_parts_have_scales_of_one_kind(growing, tmp_path, unlimited):
    """Colours of speeds that spread over decades would be logarithmic in a report."""
    run, watched = growing(n=500), WatchedRun(tmp_path, budget=unlimited)
    speeds = np.geomspace(1e-6, 1.0, run.n)[:, None] * [0.0, 0.0, 1.0]
    usual = run.arrays
    run.arrays = lambda k: {**usual(k), "velocity": (k + 1) * speeds}
    run.write(2)
    first = facts_of(watched.page())
    run.write()
    asked = [watched.news({"key": first["live"]["key"], "after": after})["facts"] for after in ("1", "-1")]
    for facts in (first, *asked):
        (speed,) = (one for one in facts["trajectory"]["columns"] if one["name"] == "speed")
        assert not speed["logarithmic"]
    with frames(tmp_path / "trajectory.h5") as sequence:
        assert compress(sequence, [0, 1]).column("speed").scale.logarithmic


def test_of_fast_frames_some_are_shown_and_the_last(growing, tmp_path, unlimited, monkeypatch):
    run, watched = growing(), WatchedRun(tmp_path, budget=unlimited)
    run.write()
    key = facts_of(watched.page())["live"]["key"]
    run.write(10)
    monkeypatch.setattr(watched, "_rate", module.UPDATE_SECONDS / (4 * run.n))
    news = watched.news({"key": key, "after": "0"})
    assert_frames(news, run, [1, 4, 7, 10])
    assert (news["shown"], news["after"]) == (4, 10)
    run.write(2)
    monkeypatch.setattr(watched, "_rate", 1.0)
    assert_frames(watched.news({"key": key, "after": "10"}), run, [12])


def test_complete_frames_without_a_result_have_ended(growing, tmp_path, unlimited):
    """As of a recording in Python."""
    run, watched = growing(duration=0.03), WatchedRun(tmp_path, budget=unlimited)
    run.write(3)
    key = facts_of(watched.page())["live"]["key"]
    run.write()
    news = watched.news({"key": key, "after": "2"})
    assert (news["ended"], news["verdict"], news["notices"]) == ("frames", "complete", [])
    run.end()
    assert watched.news({"key": key, "after": "3"})["ended"] == "result"


def test_files_that_have_not_changed_are_not_opened(growing, tmp_path, unlimited, monkeypatch):
    run, watched = growing(), WatchedRun(tmp_path, budget=unlimited)
    run.write(3)
    ask = {"key": facts_of(watched.page())["live"]["key"], "after": "2"}
    watched.news(ask)
    opened = []
    monkeypatch.setattr(module, "frames", lambda *given: (opened.append(given), frames(*given))[1])
    for _ in range(3):
        assert watched.news(ask)["after"] == 2
    assert opened == []
    run.write()
    assert_frames(watched.news(ask), run, [3])
    assert len(opened) == 1


def test_the_budget_delays_news(growing, tmp_path, clock):
    run = growing()
    watched = WatchedRun(tmp_path, budget=Budget(0.01, 0.0, clock, clock.processor))
    run.write()
    key = facts_of(watched.page())["live"]["key"]
    run.write()
    clock.now, clock.used = 10.0, 0.2
    clock.now = 29.0
    assert watched._budget.wait() == pytest.approx(20.0)
    clock.now = 48.0
    news = watched.news({"key": key, "after": "0"})
    assert news["wait"] == pytest.approx(1.0)
    assert "facts" not in news
    clock.now = 49.1
    assert_frames(watched.news({"key": key, "after": "0"}), run, [1])


def test_a_page_waits_for_the_first_frame(growing, tmp_path, unlimited):
    watched = WatchedRun(tmp_path, budget=unlimited)

    def assert_waiting():
        page = watched.page()
        assert facts_of(page)["live"]["waiting"]
        assert "There is no frame yet." in text_of(page)
        assert watched.news({"after": "-1"}) == {"waiting": True}

    assert_waiting()
    run = growing()
    assert_waiting()
    run.write()
    assert "waiting" not in watched.news({})
    assert facts_of(watched.page())["live"]["after"] == 0


def test_another_run_in_the_folder_begins_again(growing, tmp_path, unlimited):
    run, watched = growing(), WatchedRun(tmp_path, budget=unlimited)
    run.write(4)
    key = facts_of(watched.page())["live"]["key"]
    assert watched.news({"key": "other", "after": "3"}) == {"reload": True}
    assert watched.news({"key": key, "after": "9"}) == {"reload": True}, "frames were removed"
    assert watched.news({"key": key, "after": "x"}) == {"reload": True}
    run.file.close()
    other = growing(n=7, name="another")
    other.write(5)
    assert watched.news({"key": key, "after": "3"}) == {"reload": True}
    assert facts_of(watched.page())["trajectory"]["particles"] == 7


def test_an_unreadable_file_keeps_the_last_state(growing, tmp_path, unlimited):
    run, watched = growing(), WatchedRun(tmp_path, budget=unlimited)
    run.write(3)
    key = facts_of(watched.page())["live"]["key"]
    run.write()
    path = tmp_path / "trajectory.h5"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert "file must be" in watched.news({"key": key, "after": "2"})["problem"]
    assert "The run cannot be read at this moment: file must be" in text_of(watched.page())
    path.write_bytes(content)
    assert_frames(watched.news({"key": key, "after": "2"}), run, [3])


def test_a_result_alone_has_start_and_end(growing, tmp_path, unlimited):
    run, watched = growing(), WatchedRun(tmp_path, budget=unlimited)
    run.write(5)
    run.end()
    (tmp_path / "trajectory.h5").unlink()
    facts = facts_of(watched.page())
    assert facts["trajectory"]["times"] == [0.0, 0.04]
    assert facts["live"]["ended"]


def test_contacts_and_walls_of_new_frames_are_there(growing, tmp_path, unlimited):
    glass = Material(young=1e7, poisson=0.25, restitution=0.5, friction=0.5)
    floor = Walls(name="floor", planes=[Plane(point=(0, 0, -0.01))])
    run = growing(n=200, materials={"glass": glass}, effects=(Granular(), floor))
    watched = WatchedRun(tmp_path, budget=unlimited)
    run.write()
    page = facts_of(watched.page())
    run.write()
    facts = watched.news({"key": page["live"]["key"], "after": "0"})["facts"]
    assert facts["network"]["intervals"] > 0
    assert len(facts["lengths"]) == len(facts["trajectory"]["columns"]) + 1
    assert [body["name"] for body in facts["scene"]["bodies"]] == ["floor"]


def test_hostile_names_stay_text(growing, tmp_path, unlimited):
    hostile = "</script><script>alert(1)</script><img src=x onerror='alert(2)'>"
    watched = WatchedRun(tmp_path, budget=unlimited)
    growing(name=hostile).write()
    page = watched.page()
    assert "<script>alert" not in page
    assert "<img" not in page
    assert hostile in text_of(page)
    assert "connect-src 'self'" in page
