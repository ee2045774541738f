"""The page of a study of costs: its data, and a browser that reads it."""

import csv
import io
import math
import re

import numpy as np
import pytest

from tests.cli.conftest import tisim  # noqa: F401
from tests.report.conftest import scene
from tests.report.searches import HOSTILE
from tests.report.test_run_report import facts_of
from tests.report.test_search_in_browser import click
from tisim import InputError
from tisim.accuracy import Quantity, Row, Study, write
from tisim.accuracy.quantity import QuantityEstimate, Truth
from tisim.report.cost_report import cost_report


def row(method, setting, seconds, *errors, **fields):
    """A row of a study with two quantities."""
    options = f"--set stepper.control.dt={setting}"
    known = {"python": f"Verlet(dt={setting})", "options": options, "precision": "f64", "starts": 1}
    work = {"steps": 1 / setting, "sums": 2 / setting, "rejections": 0.0}
    return Row(method, f"dt {setting}", seconds=seconds, errors=errors, **known | work | fields)


ROWS = [
    row("Verlet", 0.1, (0.1, 0.12, 0.11), (0.2, 0.01), (0.3, 0.0)),
    row("Verlet", 0.01, (1.0, 1.1, 1.2), (0.002, 1e-5), (0.003, 0.0)),
    row("Verlet", 0.001, (10.0, 11.0, 12.0), (1e-5, 1e-5), (3e-5, 0.0)),
    row("Boris", 0.1, (0.2, 0.21, 0.22), (0.15, 0.01), (0.1, 0.0)),
    row("Boris, f32", 0.1, (0.15, 0.16, 0.17), (0.15, 0.01), (0.1, 0.0), precision="f32"),
    row(HOSTILE, 0.2, (), failed=f"{HOSTILE} is too long"),
]
ROWS[-1] = Row(**vars(ROWS[-1]) | {"steps": math.nan, "sums": math.nan, "rejections": math.nan})


def write_study(folder, rows, complete=False):
    """Write a study that was never run, as ``tisim cost`` does after each row."""
    quantities = [Quantity("displacement", np.ndarray.sum), Quantity("speed", np.ndarray.sum)]
    made = Study(scene(4, name=HOSTILE), quantities)
    made.rows, made.complete = list(rows), complete
    truth = QuantityEstimate(np.array([2.0]), 2e-4)
    made.truths = (Truth(truth, "Lobatto", 2.0), Truth(QuantityEstimate(np.array([1.0])), "theory", 1.0))
    write(made, folder)
    return folder


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The folder of a study."""
    return write_study(tmp_path_factory.mktemp("cost"), ROWS)


def test_the_page_has_every_setting(study, tmp_path):
    data, text = facts_of(cost_report(study, tmp_path / "r.html"))
    assert [one["name"] for one in data["quantities"]] == ["displacement", "speed"]
    assert data["quantities"][0]["reference"] == pytest.approx(1e-4)
    for shown, known in zip(data["rows"], ROWS, strict=True):
        assert (shown["method"], shown["setting"], shown["options"]) == (
            known.method,
            known.setting,
            known.options,
        )
        if known.failed:
            assert (shown["time"], shown["steps"], shown["failed"]) == (None, None, known.failed)
            continue
        assert [shown[name] for name in ("time", "least", "most")] == [
            known.median,
            min(known.seconds),
            max(known.seconds),
        ]
        for k, error in enumerate(shown["errors"]):
            assert (error["error"], error["uncertainty"]) == known.errors[k]
            assert error["atMost"] == known.at_most(k)
            assert error["known"] == known.trusted(k)
    best = [shown["errors"][0]["best"] if shown["errors"] else "" for shown in data["rows"]]
    assert best == ["1e+00", "1e-02", "1e-04", "", "", ""]
    assert "The budget was spent" in text
    assert HOSTILE in text
    page = (tmp_path / "r.html").read_text()
    assert len(re.findall("<script", page)) == 3
    assert "class Viewer" not in page, "there are no particles"


def test_wrong_input_is_refused(tisim, study, tmp_path):  # noqa: F811
    assert tisim("report", study, "--to", "p/c.html") == (0, "p/c.html\n", "")
    for arguments, message in (
        (
            ("--designs", 2),
            f"options must be for the page of a study of costs, as {study} holds one; received '--designs'",
        ),
        (("--limit", 0.01), "limit must be at least the size of the page, 0."),
    ):
        code, _, err = tisim("report", study, *arguments)
        assert code == 2
        assert message in err
    with pytest.raises(InputError, match=r"file must be a study of costs, cost\.h5; received"):
        cost_report(tmp_path, tmp_path / "r.html")
    (tmp_path / "cost.h5").write_bytes(b"no study")
    with pytest.raises(InputError, match="file must be"):
        cost_report(tmp_path, tmp_path / "r.html")


@pytest.mark.long
def test_a_browser_reads_the_settings_of_a_point(study, opened, tmp_path):
    with opened(cost_report(study, tmp_path / "r.html"), 1400, 900) as page:
        assert page.evaluate("window.hacked ?? 0") == 0
        assert page.inner_text("#chosen h2") == "Verlet"
        plot = "report.page.diagrams[0]"
        place = page.evaluate(f"{plot}.at(3)")
        scales = page.evaluate(
            f"[[{plot}.across, 0.11], [{plot}.up, 0.02]]"
            ".map(([axis, x]) => axis.place(10 * x) - axis.place(x))"
        )
        ends = page.evaluate(f"[{plot}.across.ends, {plot}.up.ends]")
        assert scales == pytest.approx([1 / np.log10(high / low) for low, high in ends]), "both logarithmic"
        page.evaluate(f"{plot}.above.scrollIntoView({{ block: 'center', behavior: 'instant' }})")
        box = page.locator("#diagrams canvas.above").first.bounding_box()
        page.mouse.move(box["x"] + place[0], box["y"] + place[1])
        assert page.locator("#diagrams .readout").first.inner_text() == "Boris, dt 0.1: 210 ms, error 0.15"
        click(page, plot, 1)
        panel = page.inner_text("#chosen")
        assert "tisim run scene.toml --set stepper.control.dt=0.01" in panel
        assert "Verlet(dt=0.01)" in panel
        assert page.locator("tr[aria-current]").get_attribute("data-row") == "1"
        page.evaluate(f"{plot}.above.focus()")
        page.keyboard.press("Home")
        assert page.evaluate(f"{plot}.over") == 0
        page.keyboard.press("End")
        assert page.evaluate(f"{plot}.over") == 2
        page.keyboard.press("Enter")
        assert "< 2e\u22125" in page.inner_text("#chosen")
        page.get_by_label("Boris", exact=True).uncheck()
        assert page.evaluate(f"[0, 1, 2, 3, 4, 5].filter((k) => {plot}.shows(k))") == [0, 1, 2, 4]
        with page.expect_download() as kept:
            page.get_by_role("button", name="Save settings as CSV").click()
        rows = list(csv.DictReader(io.StringIO(kept.value.path().read_text())))
        assert len(rows) == 6
        by_options = {(one["setting"], one["options of tisim run"]): one for one in rows}
        assert float(by_options["Verlet, dt 0.01", f"'{ROWS[1].options}"]["time (s)"]) == 1.1
        with page.expect_download() as kept:
            page.get_by_role("button", name="Save displacement, relative to its true value as SVG").click()
        assert kept.value.path().read_text().count("<circle") >= 4
        page.set_viewport_size({"width": 390, "height": 780})
        assert page.evaluate("document.scrollingElement.scrollWidth") <= 390
