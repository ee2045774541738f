"""The report in a browser: WebGL2 without a network, as a reader sees it.

Playwright (the extra ``browser``) drives the chromium of the system.
"""

import csv
import io
import re

import numpy as np
import pytest

from tests.report.conftest import growing_packing, scene
from tisim import Open
from tisim.effects import HardRods, HardSuperquadrics
from tisim.effects.walls.placement import placed_container
from tisim.io.reader import frames
from tisim.report.compressed_trajectory import compress
from tisim.report.run_report import run_report
from tisim.report.spectrum import Spectrum
from tisim.report.view import view
from tisim.report.viewer_data import ReportOptions
from tisim.shapes import SpherocylinderShape, SuperquadricShape
from tisim.sources import Cylinder, MagneticCylinders, MagneticField, MagneticSpheres, Sphere
from tisim.steppers import MechanicalContraction

pytestmark = pytest.mark.long
HOSTILE = "</script><script>window.hacked = 1</script><img src=x onerror='hacked=1'>&amp;\u2028${title}"
PICKED_PIXELS = """() => {
  const { viewer } = report.player, { gl } = viewer;
  viewer.draw(1);
  const { width, height, buffer } = viewer.image, pixels = new Uint32Array(width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
  gl.readBuffer(gl.COLOR_ATTACHMENT1);
  gl.readPixels(0, 0, width, height, gl.RED_INTEGER, gl.UNSIGNED_INT, pixels);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  return pixels;
}"""
"""The row, plus one, of the particle at each pixel."""
READ_PICKED = f"""() => {{
  const pixels = ({PICKED_PIXELS})();
  const counts = {{}};
  for (const one of pixels) counts[one] = (counts[one] ?? 0) + 1;
  return {{ counts, metres: report.player.viewer.metresPerPixel() }};
}}"""
"""The number of pixels of each body, and the length of a pixel."""
FOCUSED = (
    "(({ ariaLabel, labels, innerText }) => (ariaLabel || labels?.[0]?.innerText || innerText || '')"
    ".trim().split('\\n')[0])(document.activeElement)"
)
"""The name of the element that has the focus."""
PIXELS = "document.querySelector('canvas').toDataURL()"


def until(page, condition):
    """Wait for a condition. Playwright's own wait evaluates text in the page, which its policy forbids."""
    for _ in range(400):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(condition)


def drifting(rng, n=300, count=12):
    """Frames of particles that move, of which some come and go."""
    start, speed = rng.uniform(-0.009, 0.009, (n, 3)), rng.uniform(-0.1, 0.1, (n, 3))
    made = []
    for k in range(count):
        ids = np.array([one for one in range(n) if (one + k) % 37 or one < 5])
        places = np.mod(start[ids] + 0.01 * k * speed[ids] + 0.01, 0.02) - 0.01
        made.append({"id": ids, "position": places, "velocity": speed[ids] * (1 + k)})
    return made


@pytest.fixture
def moving(record, rng, tmp_path):
    """A report on particles that move, its trajectory and its frames."""
    made = drifting(rng)
    path = record(scene(300, name=HOSTILE), made)
    return run_report(path, tmp_path / "report.html"), path, made


def test_the_positions_are_those_of_the_file(moving, opened):
    html, path, made = moving
    with frames(path) as sequence:
        half = compress(sequence, range(len(made))).column("position").scale.rounding()
    with opened(html) as page:
        shown = page.evaluate(
            "report.trajectory.times.map((_, f) => Array.from({ length: report.trajectory.particles },"
            " (_, row) => [report.trajectory.id(f, row), ...report.trajectory.position(f, row),"
            "  report.trajectory.columns.speed.value(f, row)]))"
        )
        rounding = page.evaluate("report.trajectory.columns.speed.rounding")
        orders = page.evaluate("Object.values(report.trajectory.columns).map((one) => one.order)")
    assert set(orders) >= {0, 2}
    for frame, rows in zip(made, shown, strict=True):
        by_id = {int(row[0]): row[1:] for row in rows if row[0] >= 0}
        assert sorted(by_id) == frame["id"].tolist()
        values = np.array([by_id[one] for one in frame["id"].tolist()])
        assert np.abs(values[:, :3] - frame["position"]).max() <= half * (1 + 1e-9)
        speed = np.linalg.norm(frame["velocity"], axis=1)
        assert np.abs(values[:, 3] - speed).max() <= rounding * (1 + 1e-9)


def test_hostile_text_stays_text_and_no_request_is_possible(moving, opened):
    html, *_ = moving
    with opened(html) as page:
        assert page.evaluate("window.hacked ?? 0") == 0
        assert page.title() == HOSTILE.replace("\u2028", " ") or page.title() == HOSTILE
        assert page.inner_text("h1").startswith("</script><script>window.hacked")
        assert HOSTILE[:20] in page.text_content("pre[data-file]")
        assert page.locator("img[src=x]").count() == 0


def test_the_policy_forbids_connections_and_foreign_scripts(moving, browser):
    html, *_ = moving
    context = browser.new_context()
    page = context.new_page()
    page.goto(html.as_uri())
    page.wait_for_selector("html[data-ready=yes]")
    refused = "fetch('http://localhost:9/').then(() => 'sent', (error) => error.name)"
    assert page.evaluate(refused) == "TypeError"
    page.evaluate(
        "const s = document.createElement('script'); s.textContent = 'window.hacked = 1';"
        "document.body.append(s)"
    )
    page.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=data:, onerror=\"hacked=1\">')")
    page.wait_for_timeout(100)
    assert page.evaluate("window.hacked ?? 0") == 0
    context.close()


def test_a_cell_of_a_notebook_shows_the_viewer_and_cannot_reach_the_notebook(moving, browser, tmp_path):
    _, path, made = moving
    notebook = tmp_path / "notebook.html"
    cell = view(path, height=420)
    notebook.write_text(f"<!doctype html><body>{cell._repr_html_()}<p id=below>below</p></body>")
    context = browser.new_context(viewport={"width": 900, "height": 700})
    page, problems, requests = context.new_page(), [], []
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(notebook.as_uri())
    (frame,) = page.frames[1:]
    frame.wait_for_selector("html[data-ready=yes]")
    assert frame.evaluate("report.trajectory.frames") == len(made)
    assert frame.locator("canvas").bounding_box()["height"] > 250
    assert not frame.locator("h1").is_visible()
    page.wait_for_timeout(200)
    colours = frame.evaluate("report.player.viewer.draw(1), report.player.viewer.image.width")
    assert colours > 600
    counts = frame.evaluate(READ_PICKED)["counts"]
    assert len(counts) > 200, "the particles are drawn"
    for reach in ("parent.document.title", "localStorage.length", "top.location.href"):
        assert (
            frame.evaluate(
                f"(() => {{ try {{ return String({reach}); }} catch (e) {{ return e.name; }} }})()"
            )
            == "SecurityError"
        )
    box = page.locator("#below").bounding_box()
    assert box["y"] >= 420
    assert problems == []
    assert [one for one in requests if not one.startswith(("file:", "about:", "data:", "blob:"))] == []
    context.close()


def test_playback_changes_the_picture_and_stops_at_the_end(moving, opened):
    html, _, made = moving
    with opened(html) as page:
        page.evaluate("report.player.viewer.draw(1)")
        first = page.evaluate(f"(report.player.viewer.draw(1), {PIXELS})")
        page.get_by_role("button", name="Play").click()
        until(page, f"report.player.frame === {len(made) - 1} && !report.player.playing")
        last = page.evaluate(f"(report.player.viewer.draw(1), {PIXELS})")
        assert first != last
        assert page.get_by_role("button", name="Play").is_visible()
        assert page.inner_text("output.clock") == "t = 110 ms"
        number = len(made[-1]["id"])
        assert page.text_content("[aria-live]") == f"t = 110 ms, {number} particles"
        page.select_option("text=Speed >> xpath=../select", "4")
        assert page.evaluate("report.player.speed") == 4


def test_the_keyboard_reaches_everything(moving, opened):
    html, *_ = moving
    with opened(html) as page:
        page.focus("#theme")
        order = []
        for _ in range(40):
            page.keyboard.press("Tab")
            name = page.evaluate(FOCUSED)
            assert name, page.evaluate("document.activeElement.outerHTML")
            order.append(name)
        wanted = (
            "View of the particles",
            "First frame",
            "Play",
            "Frame",
            "Speed",
            "Colour",
            "Save the view",
        )
        places = [next(k for k, name in enumerate(order) if name.startswith(one)) for one in wanted]
        assert places == sorted(places)
        page.focus("canvas")
        before = page.evaluate("({ ...report.player.viewer.camera })")
        for key in ("ArrowLeft", "ArrowUp", "+", ".", ".", ",", "Shift+ArrowRight"):
            page.keyboard.press(key)
        after = page.evaluate("({ ...report.player.viewer.camera })")
        assert after["azimuth"] > before["azimuth"]
        assert after["elevation"] > before["elevation"]
        assert after["distance"] < before["distance"]
        assert after["target"] != before["target"]
        assert page.evaluate("report.player.frame") == 1
        assert page.get_attribute("input[aria-label=Frame]", "aria-valuetext") == "10 ms, frame 2 of 12"
        page.keyboard.press("Home")
        assert page.evaluate("report.player.viewer.camera.distance") == before["distance"]
        page.keyboard.press("Space")
        assert page.evaluate("report.player.playing")
        page.keyboard.press("Space")
        page.get_by_label("Particle id").fill("3")
        page.keyboard.press("Enter")
        assert page.inner_text(".inspector .name").startswith("particle 3")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_it_in_both_themes(moving, opened, scheme):
    html, *_ = moving
    with opened(html, 390, 780, color_scheme=scheme, device_scale_factor=2, has_touch=True) as page:
        assert page.evaluate("document.scrollingElement.scrollWidth") <= 390
        assert page.get_attribute("html", "data-theme") == scheme
        page.wait_for_timeout(300)
        corner = page.evaluate(
            "(() => { const { viewer } = report.player, { gl } = viewer, p = new Uint8Array(4);"
            " viewer.draw(1); gl.readPixels(2, 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, p); return [...p]; })()"
        )
        assert (max(corner[:3]) < 60) == (scheme == "dark")
        box = page.locator("canvas").bounding_box()
        before = page.evaluate("report.player.viewer.camera.azimuth")
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.down()
        page.mouse.move(box["x"] + 160, box["y"] + 100)
        page.mouse.up()
        assert page.evaluate("report.player.viewer.camera.azimuth") < before
        page.click("#theme")
        assert page.get_attribute("html", "data-theme") != scheme


def test_a_click_reads_the_numbers_of_a_particle(record, opened, tmp_path):
    given = {
        "id": [5, 9],
        "position": [[0.004, 0, 0], [-0.004, 0, 0]],
        "velocity": [[0, 0, 2.0], [0, 0, 3.0]],
    }
    html = run_report(record(scene(10), [given]), tmp_path / "r.html")
    with opened(html) as page:
        page.evaluate("report.player.viewer.look(-Math.PI / 2, 0)")
        page.wait_for_timeout(400)
        box = page.locator("canvas").bounding_box()
        length = page.evaluate("report.player.viewer.metresPerPixel() * devicePixelRatio")
        page.mouse.click(box["x"] + box["width"] / 2 + 0.004 / length, box["y"] + box["height"] / 2)
        assert page.inner_text(".inspector .name").startswith("particle 5")
        text = page.inner_text(".inspector table")
        assert "0.0039999" in text or "0.004" in text
        assert "2 m/s" in text
        page.keyboard.press("Escape")
        page.focus("canvas")
        page.keyboard.press("Escape")
        assert page.locator(".inspector").is_hidden()


def silhouettes(page, azimuth, elevation, cut="null"):
    """The projected area (m^2) of each body, in a view without perspective."""
    page.evaluate(f"report.player.viewer.set({{ flat: true, cut: {cut} }})")
    page.evaluate(f"report.player.viewer.look({azimuth}, {elevation})")
    seen = page.evaluate(READ_PICKED)
    return {int(one): count * seen["metres"] ** 2 for one, count in seen["counts"].items()}


def test_spheres_cover_their_area_and_a_cut_halves_it(record, opened, tmp_path):
    one = {"id": [0], "position": [[0.0, 0.0, 0.0]], "radius": [0.004]}
    html = run_report(record(scene(1), [one]), tmp_path / "r.html")
    with opened(html) as page:
        whole = np.pi * 0.004**2
        assert silhouettes(page, 0.7, 0.4)[1] == pytest.approx(whole, rel=0.01)
        half = silhouettes(page, -np.pi / 2, 0, "{ normal: [1, 0, 0], distance: 0 }")[1]
        assert half == pytest.approx(whole / 2, rel=0.02)
        front = "{ normal: [0, -1, 0], distance: 0.002 }"
        assert silhouettes(page, -np.pi / 2, 0, front)[1] == pytest.approx(whole, rel=0.01), "capped"
        behind = "{ normal: [0, 1, 0], distance: -0.002 }"
        area = np.pi * (0.004**2 - 0.002**2)
        assert silhouettes(page, -np.pi / 2, 0, behind)[1] == pytest.approx(area, rel=0.02)


def quaternion(axis, angle):
    """w, x, y, z of a rotation."""
    return [np.cos(angle / 2), *(np.sin(angle / 2) * np.array(axis, float))]


def test_rods_cover_their_area(record, opened, tmp_path):
    rod = SpherocylinderShape(length=0.006, diameter=0.002)
    bodies = scene(2, stepper=MechanicalContraction(), effects=(HardRods(rods=(rod,)),))
    given = {
        "id": [0, 1], "position": [[-0.004, 0, 0], [0.006, 0, 0]], "radius": [0.004, 0.008],
        "orientation": [quaternion((0, 1, 0), np.pi / 2), quaternion((1, 0, 0), 0.0)],
    }  # fmt: skip
    html = run_report(record(bodies, [given]), tmp_path / "r.html")
    area = 0.006 * 0.002 + np.pi * 0.001**2
    with opened(html) as page:
        seen = silhouettes(page, -np.pi / 2, 0)
        assert seen[1] == pytest.approx(area, rel=0.02)
        assert seen[2] == pytest.approx(4 * area, rel=0.02), "twice as large"
        assert silhouettes(page, np.pi, 0)[1] == pytest.approx(np.pi * 0.001**2, rel=0.03), "from its end"


def test_a_container_is_where_its_bodies_are(record, opened, tmp_path):
    """The matrix of its vertices leads to the walls in each frame."""
    made, states = growing_packing()
    html = run_report(record(made, states), tmp_path / "r.html")
    with opened(html) as page:
        reads = (
            "[0, 2].map((f) => { const v = report.player.viewer, b = v.scene.bodies[0]; v.show(f);"
            " const m = v.pose(v.bodies[0]), all = [];"
            " for (let k = 0; k < b.vertices.length; k += 3) {"
            "  const r = v.relative(b.vertices.slice(k, k + 3));"
            "  all.push([0, 1, 2].map((i) => v.centre[i] + v.unit *"
            "   (m[i] * r[0] + m[4 + i] * r[1] + m[8 + i] * r[2] + m[12 + i]))); }"
            " return all; })"
        )
        found = np.array(page.evaluate(reads))
        without = "(report.player.viewer.set({ walls: false }), report.player.viewer.draw(1), "
        assert page.evaluate(f"{without}{PIXELS})") != page.evaluate(
            f"(report.player.viewer.set({{ walls: true }}), report.player.viewer.draw(1), {PIXELS})"
        )
    for points, state in zip(found, (states[0], states[2]), strict=True):
        expected = np.unique(placed_container(made, state).triangles.reshape(-1, 3), axis=0)
        apart = np.linalg.norm(points[:, None] - expected, axis=2)
        assert apart.min(axis=1).max() < 1e-7
        assert apart.min(axis=0).max() < 1e-7


def test_field_lines_are_drawn_where_they_are_and_can_be_hidden(record, opened, tmp_path):
    magnetised = scene(2, effects=(MagneticField(constant=(0.0, 0.0, 0.5)),))
    places = [[-0.005, 0, 0], [0.005, 0, 0]]
    path = record(magnetised, [{"id": [0, 1], "position": places}] * 3)
    html = run_report(path, tmp_path / "r.html", options=ReportOptions(lines="magnetic"))
    with opened(html) as page:
        ends = np.reshape(page.evaluate("report.player.scene.lines.ends"), (-1, 2, 3))
        assert len({(round(1e6 * x), round(1e6 * y)) for x, y in ends[:, 0, :2].tolist()}) == 49
        assert np.abs(ends).max() <= 0.01
        shown = "(report.player.viewer.draw(1), " + PIXELS + ")"
        pictures = [page.evaluate(shown)]
        box = page.get_by_label("magnetic lines at 20 ms")
        for checked in (False, True):
            box.set_checked(checked)
            pictures.append(page.evaluate(shown))
    assert pictures[0] == pictures[2] != pictures[1]


def test_superquadrics_cover_their_area(record, opened, tmp_path):
    ellipsoid = SuperquadricShape(semi_axes=(0.004, 0.002, 0.001), exponents=(2.0, 2.0, 2.0))
    ball = SuperquadricShape(semi_axes=(0.002, 0.002, 0.002), exponents=(6.0, 6.0, 6.0))
    bodies = scene(
        2, stepper=MechanicalContraction(), effects=(HardSuperquadrics(superquadrics=(ellipsoid, ball)),)
    )
    given = {
        "id": [0, 1], "position": [[-0.004, 0, 0], [0.005, 0, 0]], "shape": [0, 1],
        "radius": [ellipsoid.bounding_radius(), ball.bounding_radius()],
        "orientation": [quaternion((1, 0, 0), 0.0)] * 2,
    }  # fmt: skip
    html = run_report(record(bodies, [given]), tmp_path / "r.html")
    x, y = np.linspace(-1, 1, 2001)[:, None], np.linspace(-1, 1, 2001)
    square = 0.004**2 * float((x**6 + y**6 <= 1).mean())
    with opened(html) as page:
        along_y = silhouettes(page, -np.pi / 2, 0)
        assert along_y[1] == pytest.approx(np.pi * 0.004 * 0.001, rel=0.02)
        assert along_y[2] == pytest.approx(square, rel=0.02)
        assert silhouettes(page, -np.pi / 2, np.pi / 2)[1] == pytest.approx(np.pi * 0.004 * 0.002, rel=0.02)


def test_magnets_cover_their_area(record, opened, tmp_path):
    magnets = (
        MagneticCylinders(
            cylinders=(Cylinder(axis=(1, 1, 0), radius=0.001, length=0.006, centre=(0, 0, 0.004)),)
        ),
        MagneticSpheres(spheres=(Sphere(centre=(0, 0, -0.004), radius=0.002),)),
    )
    with_magnets = scene(1, domain=Open(), effects=magnets)
    html = run_report(record(with_magnets, [{"id": [0], "position": [[0.0, 0.0, 0.0]]}]), tmp_path / "r.html")
    with opened(html) as page:
        page.evaluate("report.player.viewer.set({ magnets: 'solid' })")
        seen = silhouettes(page, -np.pi / 4, 0)
        magnet = [area for body, area in seen.items() if body >= 0x40000000]
        assert magnet[0] == pytest.approx(0.002 * 0.006, rel=0.02)
        assert magnet[1] == pytest.approx(np.pi * 0.002**2, rel=0.02)


def test_what_is_shown_can_be_saved(moving, opened):
    html, _, made = moving
    with opened(html) as page:

        def saved(press):
            with page.expect_download() as kept:
                press()
            return kept.value.path().read_bytes()

        page.evaluate("report.player.go(3)")
        text = saved(page.get_by_role("button", name="Save the particles of this frame as CSV").click)
        rows = list(csv.DictReader(io.StringIO(text.decode())))
        by_id = {int(row["id"]): [float(row[f"{axis} (m)"]) for axis in "xyz"] for row in rows}
        places = np.array([by_id[one] for one in made[3]["id"].tolist()])
        assert np.abs(places - made[3]["position"]).max() < 0.02 / 2**17 * 1.001
        png = saved(page.get_by_role("button", name="Save the view as PNG").click)
        assert png[:8] == b"\x89PNG\r\n\x1a\n"
        assert len(png) > 10_000
        for kind, head in (("SVG", b"<svg"), ("PNG", b"\x89PNG"), ("CSV", b"time (s),kinetic energy (J)")):
            press = page.get_by_role("button", name=f"Save kinetic energy as {kind}")
            assert saved(press.click).startswith(head), kind
        table = saved(page.get_by_role("button", name="Save balances as CSV").click)
        assert b"mass,kg" in table


def test_a_spectrum_has_its_axis_and_the_expected_frequencies(record, opened, tmp_path):
    omega = np.linspace(-300.0, 300.0, 601)
    amplitudes = 2e-6 / (1 + ((omega - 100) / 5) ** 2) + 1e-12
    one = Spectrum("spectrum of a motion", "m", omega, amplitudes, 1e-9, {"resonance": 100.0, "far": 1e4})
    path = record(scene(1), [{"id": [0], "position": [[0.0, 0.0, 0.0]]}] * 2)
    html = run_report(path, tmp_path / "r.html", options=ReportOptions(spectra=[one]))
    with opened(html) as page:
        chart = page.locator("#spectra svg.chart")
        assert "angular frequency" in chart.text_content()
        assert "resonance" in chart.text_content()
        assert "far" not in chart.text_content(), "beyond the axis"
        place = page.evaluate("report.spectra[0].x(100)")
        drawn = [
            float(x)
            for x in page.locator("#spectra line.across").evaluate_all(
                "(all) => all.map((one) => one.getAttribute('x1'))"
            )
        ]
        assert drawn == pytest.approx([place])
        with page.expect_download() as kept:
            page.get_by_role("button", name="Save spectrum of a motion as CSV").click()
        head, *rows = kept.value.path().read_text().splitlines()
    assert head == "angular frequency (1/s),spectrum of a motion (m)"
    values = [row.split(",") for row in rows]
    peak = max(values, key=lambda row: float(row[1] or "nan") if row[1] not in ("", "null") else 0.0)
    assert [float(one) for one in peak] == pytest.approx([100.0, 2e-6], rel=1e-5)


def test_a_click_on_a_curve_jumps_to_its_time(moving, opened):
    html, *_ = moving
    with opened(html) as page:
        chart = page.locator("svg.chart").first
        chart.scroll_into_view_if_needed()
        box = chart.bounding_box()
        page.mouse.click(box["x"] + 62 + 0.5 * (box["width"] - 76) + 4, box["y"] + 100)
        assert page.evaluate("report.player.frame") in (5, 6)


def test_a_browser_without_webgl_still_shows_curves_and_tables(moving, browser):
    html, *_ = moving
    context = browser.new_context()
    page = context.new_page()
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(html.as_uri())
    page.wait_for_selector("html[data-ready=yes]")
    assert "no WebGL2" in page.inner_text("[role=alert]")
    assert page.locator("svg.chart").count() >= 2
    context.close()


def test_contacts_are_those_of_the_file(opened, tmp_path, touching):
    path, expected = touching
    html = run_report(path, tmp_path / "r.html", options=ReportOptions())
    with opened(html) as page:
        seen = page.evaluate(
            "report.trajectory.times.map((_, f) => { const all = []; report.network.each(f, (i, j, force) =>"
            " all.push([report.trajectory.id(f, i), report.trajectory.id(f, j), force])); return all; })"
        )
        page.get_by_label("contacts", exact=True).check()
        (usual,) = page.evaluate("report.player.viewer.networks().map((one) => one.usual)")
        legend = page.inner_text(".legend")
        lines = page.evaluate("(report.player.go(2), report.player.viewer.contactLines.count)")
        strongest = max(expected[2], key=expected[2].get)
        page.get_by_label("Particle id").fill(str(strongest[0]))
        page.keyboard.press("Enter")
        told = page.inner_text(".inspector table")
        with page.expect_download() as kept:
            page.get_by_role("button", name="Save the contacts of this frame as CSV").click()
        (head, first, *rest) = kept.value.path().read_text().splitlines()
    every = [force for pairs in expected for force in pairs.values()]
    assert usual == pytest.approx(np.percentile(every, 99), rel=1e-6)
    for rows, pairs in zip(seen, expected, strict=True):
        assert {tuple(sorted(row[:2])) for row in rows} == set(pairs)
        for a, b, force in rows:
            root = pairs[min(a, b), max(a, b)] ** 0.5
            assert force**0.5 == pytest.approx(root, abs=0.5001 * max(every) ** 0.5 / 255)
    assert re.search(r"contact force \((m|\u00b5|)N\)", legend)
    assert lines == len(expected[2])
    assert re.search(rf"force with {strongest[1]}\s", told)
    assert re.search(rf"contacts\s+{sum(strongest[0] in pair for pair in expected[2])}\b", told)
    assert head == "id,other id,normal force (N)"
    assert {int(one) for one in first.split(",")[:2]} == set(strongest)
    assert float(first.split(",")[2]) == pytest.approx(expected[2][strongest], rel=0.02)
    assert len(rest) == len(expected[2]) - 1


def test_runs_that_begin_or_stay_empty_are_shown(record, opened, tmp_path):
    none = {"id": np.empty(0, int), "position": np.empty((0, 3))}
    some = {"id": [0, 1], "position": [[0.0, 0.0, 0.0], [0.004, 0.0, 0.0]]}
    for name, given, last in (("begins", [none, some], 2), ("stays", [none, none], 0)):
        html = run_report(record(scene(2), given, f"{name}.h5"), tmp_path / f"{name}.html")
        with opened(html) as page:
            page.evaluate("report.player.go(1)")
            assert page.text_content("[aria-live]").endswith(f", {last} particles")
            bodies = page.evaluate(READ_PICKED)["counts"].keys() - {"0"}
            assert len(bodies) == last
