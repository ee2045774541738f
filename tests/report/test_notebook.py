"""Scenes, results, outcomes, studies and trajectories in notebooks, without IPython."""

import base64
import re
import sys
import types
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pytest

import tisim
from tests.accuracy.scenes import oscillator
from tests.report.conftest import scene
from tisim import InputError, Result, Status, notebook, optimize
from tisim.accuracy import Row, Study
from tisim.console import LINES_KEPT, NotebookProgress, PrintableConsole, progress_bar
from tisim.effects import Gravity
from tisim.engine.observer import MeasureSeries
from tisim.io.reader import RecordedTrajectory
from tisim.notebook import ViewerCell
from tisim.report import view

HOSTILE = "</td></iframe><script>alert(1)</script><img src=x onerror='alert(2)'>&amp;$x$"


class Elements(HTMLParser):
    """The names and attributes of all elements, and the text."""

    def __init__(self, html):
        super().__init__()
        self.found, self.text = [], ""
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.text += data

    @property
    def names(self):
        return {name for name, _ in self.found}


def is_harmless(html):
    """Whether there are only tables, texts and pictures that are part of the HTML."""
    elements = Elements(html)
    pictures = [attributes["src"] for name, attributes in elements.found if name == "img"]
    attributes = {name for _, found in elements.found for name in found}
    allowed = {"div", "p", "strong", "table", "thead", "tbody", "tr", "th", "td", "img"}
    return (
        elements.names <= allowed
        and attributes <= {"style", "alt", "src"}
        and all(one.startswith("data:image/png;base64,") for one in pictures)
    )


def result(n=3, reason="", **settings):
    """A result whose particles have moved by 1 mm along x."""
    start = {
        "id": np.arange(n), "position": np.zeros((n, 3)), "velocity": np.ones((n, 3)),
        "mass": np.full(n, 2.0), "radius": np.full(n, 1e-3),
    }  # fmt: skip
    state = {**start, "position": start["position"] + [1e-3, 0, 0]}
    status = Status(not reason, reason or "reached its end")
    counts = {"steps": 12000, "rejections": 0}
    made = Result(
        scene(n, **settings), state, start, 1.0, counts, status, 0.5, {"device": "cpu"}, {"lid_force_z": 3.0}
    )
    return made.watched()


def test_a_scene_shows_its_parts_with_units_and_a_picture():
    shown = scene(4, name=HOSTILE, effects=(Gravity(),))
    html = shown._repr_html_()
    elements = Elements(html)
    assert HOSTILE in elements.text
    assert is_harmless(html)
    assert "acceleration (0, 0, -9.80665) m/s\u00b2" in elements.text
    assert "4, radius 1 mm" in elements.text
    (png,) = re.findall(r"base64,([^\"]+)", html)
    assert base64.b64decode(png).startswith(b"\x89PNG")
    assert len(html) < 200_000
    assert repr(shown).startswith("Scene(")


def test_a_scene_of_many_particles_has_no_picture(monkeypatch):
    monkeypatch.setattr("tisim.report.cells.MOST_DRAWN", 3)
    html = scene(4)._repr_html_()
    assert "<img" not in html
    assert "more than 3 particles" in Elements(html).text


def test_a_result_shows_its_status_counts_and_pictures():
    html = result(name=HOSTILE)._repr_html_()
    text = Elements(html).text
    assert is_harmless(html)
    assert f"{HOSTILE}\u2002result: ok" in text
    assert "steps12,000" in text
    assert "rejections" not in text
    assert "lid force z3" in text
    assert "wall time0.5 s, cpu" in text
    assert html.count("<img") == 1


def test_a_failed_result_shows_its_reason_and_that_counts_as_read(recwarn):
    failed = result(reason=f"at t = 0.1 s: {HOSTILE}")
    html = failed._repr_html_()
    assert f"result: failed at t = 0.1 s: {HOSTILE}" in Elements(html).text
    assert is_harmless(html)
    del failed
    assert not recwarn.list


def test_a_picture_that_cannot_be_drawn_is_left_out(monkeypatch):
    monkeypatch.setattr("tisim.plotting.cloud.start_and_end", lambda *_, **__: 1 / 0)
    html = result()._repr_html_()
    assert "<img" not in html
    assert "could not be drawn: ZeroDivisionError" in Elements(html).text
    assert "steps12,000" in Elements(html).text


def test_an_object_that_cannot_be_shown_stays_text(record, tmp_path):
    path = record(scene(1), [{"id": [0], "position": np.zeros((1, 3))}])
    world = RecordedTrajectory(path)
    path.unlink()
    assert world._repr_html_() is None


def test_a_trajectory_shows_curves(record):
    frames = [{"id": [0], "position": np.zeros((1, 3)), "velocity": [[0, 0, k]]} for k in range(4)]
    html = RecordedTrajectory(record(scene(1, name=HOSTILE), frames))._repr_html_()
    assert is_harmless(html)
    assert "4 frames, t = 0 s to 30 ms" in Elements(html).text
    assert html.count("<img") == 1


def test_a_study_shows_the_cheapest_settings():
    study = Study(oscillator(), coarser=1)
    assert "0 settings, not complete" in Elements(study._repr_html_()).text
    fast, failed = (
        Row(HOSTILE, "dt=1", "", "--set dt=1", "f64", 1, (0.5,), 10, 10, 0, ((2e-4, 1e-9),)),
        Row("Verlet", "dt=2", "", "", "f64", 1, failed="diverged"),
    )
    study.rows = [fast, failed]
    html = study._repr_html_()
    assert is_harmless(html)
    text = Elements(html).text
    assert f"1e-03{HOSTILE}: dt=10.5 s2.0e-04--set dt=1" in text
    assert "2 settings, 1 failed, not complete" in text
    assert html.count("<img") == 1


def drop(design):
    return (design["height"] - 1.5) ** 2


def test_an_outcome_shows_designs_with_units_and_the_convergence():
    height = optimize.Gene("height", "m", 1.0, 2.0)
    problem = optimize.Problem.of_function(drop, [height], name="throw", title=HOSTILE)
    outcome = optimize.run(problem, method="random", generations=1)
    html = outcome._repr_html_()
    elements = Elements(html)
    assert is_harmless(html)
    assert f"{HOSTILE}\u2002search: 40 runs, stopped by generations" in elements.text
    assert "height (m)" in elements.text
    assert elements.text.count("yes") == 5
    assert html.count("<img") == 1
    assert f"{outcome.designs[0].genes['height']:.4g}" in elements.text


def page_of(cell):
    """The page in the frame of a cell."""
    (frame,) = (attributes for name, attributes in Elements(cell._repr_html_()).found if name == "iframe")
    return frame


def test_a_viewer_is_a_frame_without_access_to_the_notebook(record):
    made = result(name=HOSTILE)
    for cell in (made.view(height=500), view(made, height=500)):
        frame = page_of(cell)
        assert frame["sandbox"] == "allow-scripts allow-downloads"
        assert frame["srcdoc"] == cell.page
        assert "height:500px" in cell._repr_html_()
        assert Elements(cell._repr_html_()).names == {"div", "p", "iframe"}
        assert 'body class="cell"' in cell.page
        assert "<viewer of particles" in repr(cell)
    frames = [{"id": [0], "position": np.full((1, 3), k * 1e-3)} for k in range(3)]
    trajectory = RecordedTrajectory(record(scene(1), frames))
    assert trajectory.view().page == view(trajectory._path).page == view(trajectory._path.parent).page
    failed = result(reason="because")
    assert "The run failed because." in unescape(failed.view().page)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"height": 10}, "height must be a whole number of pixels, 200 to 4000; received 10"),
        ({"height": 600.5}, "height must be a whole number of pixels"),
        ({"limit": 0.0}, r"limit must be at least 0\.5 MB, and finite"),
        ({"fields": ["heat"]}, "field must be one of mass, radius, speed; received 'heat'"),
    ],
)
def test_wrong_options_of_a_viewer_are_refused(settings, message):
    with pytest.raises(InputError, match=message):
        result().view(**settings)


def test_only_runs_are_viewed(tmp_path):
    with pytest.raises(
        InputError, match="run must be a Result, a trajectory, or the path of one; received 3"
    ):
        view(3)
    with pytest.raises(InputError, match=r"folder must be one with a trajectory\.h5 or result\.h5"):
        view(tmp_path)


def test_a_page_is_saved(tmp_path):
    cell = ViewerCell("<p>page</p>")
    assert cell.save(tmp_path / "a.html").read_text() == "<p>page</p>"


def test_data_frames_have_units(record):
    pytest.importorskip("pandas")
    frame = result().to_frame()
    assert list(frame) == [
        "id", *(f"{name}_{axis}" for name in ("position", "velocity") for axis in "xyz"), "mass", "radius",
    ]  # fmt: skip
    assert frame["position_x"].tolist() == [1e-3] * 3
    assert result().to_frame(start=True)["position_x"].tolist() == [0.0] * 3
    assert frame.attrs["units"]["velocity_x"] == "m/s"
    assert "id" not in frame.attrs["units"]
    frames = [
        {"id": [0], "position": [[k, 0, 0]], "velocity": [[0, 0, 2.0]], "mass": [3.0]} for k in range(3)
    ]
    series = RecordedTrajectory(record(scene(1), frames)).to_frame()
    assert series["kinetic_energy"].tolist() == [6.0] * 3
    assert series["shift_x"].tolist() == [0, 1, 2]
    assert series.attrs["units"] == {
        "time": "s", "kinetic_energy": "J", **dict.fromkeys(("shift_x", "shift_y", "shift_z"), "m"),
        **dict.fromkeys(("drift_x", "drift_y", "drift_z"), "m/s"),
    }  # fmt: skip


def test_the_rows_of_a_study_are_a_data_frame():
    pytest.importorskip("pandas")
    study = Study(oscillator(), coarser=1)
    study.rows = [
        Row("Verlet", "dt=1", "", "", "f64", 1, (0.5, 0.7), 10, 20, 0, ((2e-4, 1e-9),)),
        Row("Verlet", "dt=2", "", "", "f64", 1, failed="diverged"),
    ]
    frame = study.to_frame()
    (name,) = (quantity.name for quantity in study.quantities)
    assert frame["seconds"].tolist()[0] == pytest.approx(0.6)
    assert frame[f"error of {name}"].tolist()[0] == 2e-4
    assert np.isnan(frame[f"error of {name}"].tolist()[1])
    assert frame["failed"].tolist() == ["", "diverged"]
    assert frame.attrs["units"] == {"seconds": "s", "spread": "s"}


def test_a_data_frame_without_pandas_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match=r'pandas must be installed .*pip install "tisim\[notebook\]"'):
        result().to_frame()
    with pytest.raises(InputError, match="world must be 0 to -1, after a run; received 0"):
        MeasureSeries(1.0).to_frame()


class Output:
    """Stands for a display handle of IPython."""

    def __init__(self, shown):
        self.shown = shown

    def update(self, content, raw):
        self.shown.append(content)


@pytest.fixture
def ipython(monkeypatch):
    """A notebook: all contents of its outputs, one list each."""
    outputs = []

    def display(content, raw, display_id):
        outputs.append([content])
        return Output(outputs[-1])

    module = types.ModuleType("IPython.display")
    module.display = display
    monkeypatch.setitem(sys.modules, "IPython", types.ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    return outputs


def test_a_long_search_has_one_output_in_a_notebook(ipython):
    console = PrintableConsole(force_jupyter=True)
    with progress_bar("{task.fields[name]}", console=console) as bar:
        assert isinstance(bar, NotebookProgress)
        task = bar.add_task("", total=1.0, name=HOSTILE)
        for k in range(3000):
            bar.console.print(f"generation {k} [b]{HOSTILE}", style="dim", highlight=False)
            bar.update(task, completed=(k + 1) / 3000)
    (shown,) = ipython
    assert len(shown) < 100, "refreshed by time, not by line"
    last = shown[-1]
    assert last["text/plain"].count("generation ") == LINES_KEPT
    assert "generation 2999 [b]" in last["text/plain"]
    assert "100%" in last["text/plain"]
    assert "\x1b" not in last["text/plain"]
    assert Elements(last["text/html"]).names == {"pre", "span"}
    assert HOSTILE[:20] in unescape(last["text/html"]).replace("\n", "")


def test_a_quiet_search_shows_nothing_in_a_notebook(ipython):
    with progress_bar("", console=PrintableConsole(force_jupyter=True, quiet=True)) as bar:
        bar.update(bar.add_task("", total=1.0), completed=1.0)
    assert ipython == []


def test_a_module_that_shows_is_imported_by_name():
    for kind in (tisim.Scene, Result, RecordedTrajectory, Study, tisim.optimize.Outcome):
        assert callable(notebook.named(kind.shown_by)), kind


def test_grains_in_contact_are_shown_too(touching):
    path, _ = touching
    assert '"network":{' in view(path).page
    assert '"network":null' in view(path, contacts=False).page
