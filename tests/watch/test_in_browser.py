"""A run in the browser while it is written: frames arrive, and the view stays."""

from contextlib import contextmanager

import numpy as np
import pytest

from tests.report.test_in_browser import PICKED_PIXELS, READ_PICKED, until
from tisim.engine.result import Status
from tisim.io.reader import Frame
from tisim.report.page import static
from tisim.watch import remade, watched
from tisim.watch import run as module
from tisim.watch.run import WatchedRun
from tisim.watch.server import WatchServer

pytestmark = pytest.mark.long
HOSTILE = "</script><script>window.hacked = 1</script><img src=x onerror='hacked=1'>&amp;"


@pytest.fixture
def watching(browser, tmp_path, monkeypatch, unlimited):
    """Open the page of a folder that is watched. At the end no script may have failed, and no request may
    have left the server, except for one that has stopped."""
    problems = []

    @contextmanager
    def show(answers=None):
        for one in (module, remade, watched):
            monkeypatch.setattr(one, "POLL", 0.2)
        with WatchServer(answers or WatchedRun(tmp_path, budget=unlimited).answers) as server:
            context = browser.new_context(viewport={"width": 1000, "height": 800})
            page = context.new_page()
            page.on(
                "console",
                lambda said: problems.append(said.text) if said.type in ("error", "warning") else None,
            )
            page.on("pageerror", lambda error: problems.append(str(error)))
            page.on(
                "request",
                lambda request: (
                    None
                    if request.url.startswith((server.address, "data:", "blob:"))
                    else problems.append(f"request of {request.url}")
                ),
            )
            page.goto(server.address)
            page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
            try:
                yield page, server
            finally:
                context.close()

    yield show
    assert [one for one in problems if "net::ERR_" not in one] == []


def shown(page):
    """Frames, and the positions (m) by id of all particles in the last one, as the browser has them."""
    frames, rows = page.evaluate(
        "(({ trajectory: t }) => [t.frames, Array.from({ length: t.particles },"
        " (_, row) => [t.id(t.frames - 1, row), ...t.position(t.frames - 1, row)])])(report)"
    )
    return frames, {int(row[0]): row[1:] for row in rows if row[0] >= 0}


def assert_shows(page, run):
    frames, places = shown(page)
    assert frames == run.count
    found = np.array([places[one] for one in range(run.n)])
    assert np.abs(found - run.arrays(run.count - 1)["position"]).max() <= 0.02 / 2**17 * 1.001


def test_frames_arrive_without_losing_the_view(growing, watching):
    run = growing(name=HOSTILE)
    run.write()
    with watching() as (page, _):
        assert page.inner_text(".status") == "running"
        until(page, "document.documentElement.dataset.live === 'running'")
        assert page.inner_text("p.live").startswith("Watching: one frame, the last one ")
        assert page.locator("input[aria-label=Frame]").is_disabled()
        run.write(2)
        until(page, "report.trajectory.frames === 3")
        assert_shows(page, run)
        assert page.evaluate("report.player.frame") == 2, "the last frame is followed"
        assert page.evaluate("report.player.viewer.options.colour") == "speed", "speeds differ now"
        page.evaluate(
            "Object.assign(report.player.viewer.camera, { azimuth: 1, elevation: 0.5, distance: 3 })"
        )
        page.select_option("text=Colour >> xpath=../select", "speed")
        page.get_by_label("Upper end of the colours").fill("5")
        page.get_by_label("Particle id").fill("7")
        page.keyboard.press("Enter")
        page.evaluate("report.player.go(1)")
        before = page.evaluate("({ ...report.player.viewer.camera })")
        run.write(3)
        until(page, "report.trajectory.frames === 6")
        assert_shows(page, run)
        assert page.inner_text("footer p:first-child").startswith("Of the last frames: Positions are shown")
        assert page.evaluate("({ ...report.player.viewer.camera })") == before
        assert page.evaluate("report.player.frame") == 1, "an earlier frame stays"
        assert page.evaluate("report.player.viewer.options.range[1]") == 5
        assert page.inner_text(".inspector .name").startswith("particle 7")
        page.evaluate("report.player.go(5)")
        place = page.inner_text(".inspector tr:first-child td").removesuffix(" m").replace("\u2212", "-")
        assert float(place) == pytest.approx(run.arrays(5)["position"][7, 0], abs=2e-7)
        pixels = page.evaluate(READ_PICKED)["counts"]
        assert len(pixels) > 30, "the particles of the last part are drawn"
        times = page.evaluate("report.charts.map((one) => one.times)")
        assert all(one == pytest.approx([0.01 * k for k in range(6)]) for one in times)
        values = page.evaluate(
            "report.charts.map((one) => one.facts.curves.map((curve) => curve.values.length))"
        )
        assert {length for chart in values for length in chart} == {6}
        page.evaluate("report.player.go(0)")
        page.get_by_role("button", name="Play").click()
        until(page, "report.player.frame === 5 && !report.player.playing")
        run.end()
        until(page, "document.documentElement.dataset.live === 'ended'")
        until(page, "document.querySelector('.status').textContent === 'ok'")
        until(page, "report.trajectory.parts.length === 1")
        assert_shows(page, run)
        assert page.inner_text("p.live") == "The run has ended: 6 frames."
        assert page.inner_text("footer p:first-child").startswith("Positions are shown to within")
        assert page.text_content("[role=status].unseen") == "The run has ended: 6 frames."
        assert "particle steps" in page.inner_text("#numbers")
        assert page.get_by_role("button", name="Save balances as CSV").count() == 1
        assert page.evaluate("({ ...report.player.viewer.camera })") == before
        assert page.evaluate("window.hacked ?? 0") == 0


def test_the_picture_is_of_the_part_that_has_the_frame(growing, watching):
    """Particles come and go between parts, each with rows of its own."""
    run = growing(n=3)
    places = {0: [-6e-3, 0, 0], 1: [0, 0, 0], 2: [6e-3, 0, 0]}

    def write(*ids):
        arrays = {name: values[list(ids)] for name, values in run.arrays(run.count).items()}
        arrays["position"] = np.array([places[one] for one in ids])
        run.file.write(0, Frame(0.01 * run.count, run.count, arrays))
        run.count += 1

    def centres(frame):
        """The mean horizontal place (m) of the pixels of each particle in a frame, by id."""
        found = page.evaluate(
            "(frame) => { const { player, trajectory } = report; player.viewer.look(-Math.PI / 2, 0);"
            f" player.go(frame); const pixels = ({PICKED_PIXELS})(), sums = {{}};"
            " pixels.forEach((one, k) => { if (!one || one >= 0x40000000) return;"
            " const id = trajectory.id(frame, one - 1), sum = sums[id] ??= [0, 0];"
            " sum[0] += k % player.viewer.image.width + 0.5; sum[1]++; });"
            " const { width } = player.viewer.image, metres = player.viewer.metresPerPixel();"
            " return Object.entries(sums).map(([id, [x, n]]) => [id, (x / n - width / 2) * metres]); }",
            frame,
        )
        return {int(one): x for one, x in found}

    write(0)
    with watching() as (page, _):
        page.evaluate("report.player.viewer.set({ flat: true })")
        given = [(0,)]
        for ids in ((0, 1, 2), (2,), (1, 2)):
            write(*ids)
            given.append(ids)
            until(page, f"report.trajectory.frames === {run.count}")
        assert page.evaluate("report.trajectory.parts.length") == 4
        for frame in (0, 1, 2, 3, 1, 0, 3):
            seen = centres(frame)
            assert sorted(seen) == list(given[frame])
            for one, x in seen.items():
                assert x == pytest.approx(places[one][0], abs=3e-4)


def test_a_page_waits_for_a_run_and_shows_its_failure(growing, watching):
    with watching() as (page, _):
        assert page.inner_text(".status") == "waiting"
        run = growing()
        run.write(2)
        page.wait_for_selector("canvas", timeout=30_000)
        page.wait_for_selector("html[data-ready=yes]")
        assert page.evaluate("report.trajectory.frames") == 2
        run.end(Status(False, "at t = 0.01 s: lost"))
        until(page, "document.querySelector('.status').textContent === 'failed'")
        assert page.inner_text("#notices") == "The run failed at t = 0.01 s: lost."


def test_an_unreadable_file_and_a_stopped_server_are_told(growing, watching, browser, tmp_path):
    run = growing()
    run.write(3)
    with watching() as (page, server):
        path = tmp_path / "trajectory.h5"
        content = path.read_bytes()
        run.write()
        path.write_bytes(content[:-100])
        until(page, "document.documentElement.dataset.live === 'problem'")
        assert "The files cannot be read at this moment; this is their last good state." in page.inner_text(
            "p.live"
        )
        assert page.evaluate("report.trajectory.frames") == 3
        path.write_bytes(content)
        until(page, "document.documentElement.dataset.live === 'running'")
        server.shutdown()
        server.server_close()
        until(page, "document.documentElement.dataset.live === 'gone'")
        assert "does not answer" in page.inner_text("p.live")
        assert page.evaluate("report.trajectory.frames") >= 3


def test_memory_of_the_browser_is_limited():
    """Above it, all frames are read again, thinned to the limit of a report."""
    assert "MOST_BYTES = 4e8" in static("watch.js")
