"""The report on a run: its tables, its size, and the command that writes it."""

import fnmatch
import html
import importlib
import inspect
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import tisim, toml  # noqa: F401
from tests.report.conftest import scene
from tisim import InputError, Material
from tisim.cases import case as catalogue
from tisim.cases.case import Case, Size
from tisim.cli.report import report
from tisim.effects import Granular, Gravity, Walls
from tisim.geometry import Plane
from tisim.io.reader import frames
from tisim.plotting import style
from tisim.report import page as pages
from tisim.report import run_report as write
from tisim.report.run_report import read_checks
from tisim.report.viewer_data import SIZE_LIMIT, ReportOptions


def facts_of(path):
    """The data of a report, and its text without scripts."""
    text = path.read_text(encoding="utf-8")
    data = json.loads(re.search(r'id="facts">(.*?)</script>', text, re.S)[1])
    body = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.S)
    return data, html.unescape(re.sub(r"<[^>]*>", "\n", body))


def noise(rng, n, count):
    """Frames of positions and velocities without any order, which cannot be compressed."""
    return [
        {"id": range(n), "position": rng.uniform(-0.01, 0.01, (n, 3)), "velocity": rng.normal(size=(n, 3))}
        for _ in range(count)
    ]


def test_frames_are_left_out_to_keep_the_limit(record, rng, tmp_path):
    path = record(scene(2000), noise(rng, 2000, 60))
    written = write(path, tmp_path / "r.html", options=ReportOptions(limit=0.6))
    data, text = facts_of(written)
    assert 0.4e6 < written.stat().st_size <= 0.6e6
    indices = data["trajectory"]["indices"]
    assert (indices[0], indices[-1]) == (0, 59)
    stride = indices[1]
    assert indices == sorted({*range(0, 60, stride), 59})
    notice = f"it has one frame in {stride} and the last: {len(indices)} of 60."
    assert notice in text
    assert len(data["series"]["times"]) == 60, "the curves use all"


def test_a_large_page_keeps_the_limit_too(record, rng, tmp_path, monkeypatch):
    """The space for everything beside the frames is found out, not assumed."""
    module = importlib.import_module("tisim.report.run_report")
    monkeypatch.setattr(module, "RESERVED_BYTES", 0.0)
    path = record(scene(2000), noise(rng, 2000, 60))
    written = write(path, tmp_path / "r.html", options=ReportOptions(limit=0.6))
    assert 0.4e6 < written.stat().st_size <= 0.6e6
    with pytest.raises(InputError, match=r"limit must be large enough for the scene, .*; received 0\.6 MB"):
        write(path, tmp_path / "s.html", options=ReportOptions(limit=0.6, pictures={"one": bytes(500_000)}))
    assert not (tmp_path / "s.html").exists()


def test_the_command_has_the_same_default():
    assert inspect.signature(report).parameters["limit"].default == SIZE_LIMIT


def test_the_wheel_carries_the_static_files():
    root = Path(__file__).parents[2]
    patterns = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    names = [path.name for path in (root / "tisim/report/static").iterdir()]
    lists = [value for name, value in vars(pages).items() if name.endswith("_SCRIPTS")]
    scripts = {name for one in lists for name in one}
    assert set(names) == {*scripts, "page.css", "page.html"}
    for name in names:
        assert any(fnmatch.fnmatch(f"static/{name}", one) for one in patterns["tisim.report"]), name


def test_particles_are_left_out_if_two_frames_are_too_many(record, rng, tmp_path):
    path = record(scene(20_000), noise(rng, 20_000, 2))
    written = write(path, tmp_path / "r.html", options=ReportOptions(limit=0.6))
    data, text = facts_of(written)
    assert written.stat().st_size <= 0.6e6
    part = int(re.search(r"Only particles whose id is a multiple of (\d+) are shown", text)[1])
    assert data["trajectory"]["particles"] == len(range(0, 20_000, part))


def test_a_limit_that_is_no_size_is_refused():
    for limit in (0.0, np.nan, np.inf):
        with pytest.raises(InputError, match=r"limit must be at least 0\.5 MB, and finite"):
            ReportOptions(limit=limit)


def test_the_page_says_what_was_asked_and_what_happened(record, tmp_path):
    glass = Material(young=1e7, poisson=0.25, restitution=0.5, friction=0.5)
    effects = (Granular(), Walls(name="floor", planes=[Plane(point=(0, 0, -0.01))]), Gravity())
    asked = scene(2, name="two grains", materials={"glass": glass}, effects=effects)
    names = [f"floor_{what}_{axis}" for what in ("force", "torque") for axis in "xyz"]
    measures = [dict.fromkeys(names, float(k)) for k in range(3)]
    given = [
        {"id": [0, 1], "position": [[0, 0, 0], [0, 0, 0.004]], "velocity": [[0, 0, k], [0, 0, 0]]}
        for k in range(3)
    ]
    path = record(asked, given, measures=measures)
    data, text = facts_of(write(path, tmp_path / "r.html"))
    rows = [line.strip() for line in text.splitlines() if line.strip()]

    def cells(name, count):
        return rows[rows.index(name) + 1 :][:count]

    assert cells("momentum along z", 4) == ["kg m/s", "0", "0.002", "0.002"]
    assert cells("kinetic energy of translation", 4) == ["J", "0", "0.002", "0.002"]
    assert cells("young", 3) == ["1e+07", "Pa", "Young's modulus E"]
    assert cells("acceleration", 2) == ["(0, 0, -9.80665)", "m/s\u00b2"]
    assert "unfinished" in rows
    assert any(row.startswith("The run has come to t = 0.02 s of 1 s") for row in rows)
    assert asked.to_toml().strip() in text
    titles = {one["title"]: one for one in data["series"]["curves"]}
    assert set(titles) == {
        "kinetic energy", "velocity of the centre of gravity", "floor force", "floor torque",
    }  # fmt: skip
    assert titles["floor force"]["unit"] == "N"
    assert [one["values"] for one in titles["floor force"]["curves"]] == [[0.0, 1.0, 2.0]] * 3
    assert data["materials"] == ["glass"]
    (floor,) = data["scene"]["bodies"]
    assert floor["name"] == "floor"
    assert set(floor["vertices"][2::3]) == {-0.01}


def test_a_long_scene_is_not_shown_as_text(record, tmp_path):
    path = record(scene(9000), [{"id": range(9000), "position": np.zeros((9000, 3))}])
    _, text = facts_of(write(path, tmp_path / "r.html"))
    assert "As a file, the scene has" in text


def test_checks_that_the_command_has_written_are_shown(record, tmp_path):
    table = tmp_path / "checks.csv"
    head = "case,check,measured,half_interval,expected,allowed,verdict,tisim,physics,processor,date"
    table.write_text(f"{head}\nblast,<b>radius</b>,1.5,,1.6,0.1,FAIL,0.1.0,12,x,2026-01-01\n")
    path = record(scene(1), [{"id": [0], "position": np.zeros((1, 3))}])
    written = write(path, tmp_path / "r.html", options=ReportOptions(checks=read_checks(table)))
    assert "<b>radius" not in written.read_text()
    assert "<b>radius</b>" in facts_of(written)[1]
    assert "FAIL" in facts_of(written)[1]
    table.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="file of checks must be a table of checks, written by tisim check"):
        read_checks(table)
    with pytest.raises(InputError, match="file of checks must be a table of checks"):
        read_checks(tmp_path / "none.csv")


@pytest.mark.long
def test_the_command_writes_the_page_of_a_run(tisim, toml, tmp_path, monkeypatch):  # noqa: F811
    assert tisim("run", toml, "--frames", 3, "--out", "out")[0] == 0
    figure = style.empty(1.0, 1.0)
    size = {"default": Size("one", {})}
    drawn = Case("flow", "", "", size, None, None, pictures=lambda sequence: {"own_plot.png": figure})
    monkeypatch.setattr(catalogue, "every", lambda: {"scene": drawn})
    assert tisim("report", "out") == (0, "out/report.html\n", "")
    data, text = facts_of(tmp_path / "out" / "report.html")
    assert "own plot" in text
    assert "Run on device cpu, precision f64" in text
    with frames(tmp_path / "out" / "trajectory.h5") as sequence:
        assert len(data["trajectory"]["times"]) == len(sequence) == 4
    assert tisim("report", "out")[0] == 0, "its own page is replaced"
    (tmp_path / "out" / "trajectory.h5").unlink()
    assert tisim("report", "out", "--to", "p/start_and_end.html")[0] == 0
    assert len(facts_of(tmp_path / "p/start_and_end.html")[0]["trajectory"]["times"]) == 2


def test_wrong_input_of_the_command_is_refused(tisim, tmp_path, record):  # noqa: F811
    path = record(scene(1), [{"id": [0], "position": np.zeros((1, 3))}])
    (tmp_path / "mine.html").write_text("the user's own")
    for arguments, message in (
        (("--to", "a.txt"), "--to must be a file NAME.html; received 'a.txt'"),
        (("--limit", 0), "limit must be at least 0.5 MB, and finite; received 0.0"),
        (("--field", "heat"), "field must be one of mass, radius, speed; received 'heat'"),
        (("--world", 3), "world must be 0 to 0; received 3"),
        (("--to", "mine.html"), "output folder must be without files that tisim has not written"),
    ):
        code, out, err = tisim("report", path, *arguments)
        assert (code, out) == (2, ""), arguments
        assert message in err
    assert (tmp_path / "mine.html").read_text() == "the user's own"
