"""The recordings of the docs in a browser: a page that Sphinx builds, opened as a file, plays them."""

import io
import re
import shutil
from pathlib import Path

import pytest

pytestmark = pytest.mark.long
DOCS = Path(__file__).parents[2] / "docs"
CONF = f"""
import sys
sys.path.insert(0, {str(DOCS)!r})
import recorded_nodes
extensions = ["myst_parser"]
html_static_path = ["_static"]
html_css_files = ["recordings.css"]
setup = recorded_nodes.setup
"""
PAGE = """# Page

![Grains](_static/recordings/avalanche.webp)

![Particles](_static/recordings/vibration.webp)

[![A link](_static/recordings/blast.webp)](https://example.org)
"""
PLAYER = "document.querySelector('figure[data-recording={}]').player"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A page with two recordings and a link."""
    pytest.importorskip("myst_parser", reason="needs the extra docs")
    from sphinx.application import Sphinx

    source, out = tmp_path_factory.mktemp("docs"), tmp_path_factory.mktemp("html")
    (source / "conf.py").write_text(CONF)
    (source / "index.md").write_text(PAGE)
    (source / "plain.md").write_text("---\norphan: true\n---\n# Plain\n")
    shutil.copytree(DOCS / "_static", source / "_static")
    warnings = io.StringIO()
    Sphinx(source, source, out, out / "trees", "html", status=None, warning=warnings).build()
    assert warnings.getvalue() == ""
    return out


@pytest.fixture
def opened(built, browser):
    """The page as a file, with all that it requests; no script may fail."""
    context = browser.new_context(viewport={"width": 900, "height": 900})
    page, said, asked = context.new_page(), [], []
    page.on("console", lambda one: said.append(one.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((built / "index.html").as_uri())
    yield page, asked
    context.close()
    assert said == []


def frame(page, name):
    return page.evaluate(f"{PLAYER.format(name)}.frame")


def test_a_recording_is_loaded_by_a_click_and_plays(opened):
    page, asked = opened
    assert not any("viewer.js" in one or "recordings/" in one for one in asked if one.endswith(".js"))
    figure = page.locator("figure[data-recording=avalanche]")
    figure.get_by_role("button", name="Play the recording of avalanche").click()
    canvas = figure.locator("canvas")
    canvas.wait_for(state="visible")
    assert [one.split("/")[-1] for one in asked if "recordings/" in one and one.endswith(".js")] == [
        "avalanche.js"
    ]
    pixels = f"({PLAYER.format('avalanche')}.viewer.draw(1), {PLAYER.format('avalanche')}.canvas.toDataURL())"
    first, begun = page.evaluate(pixels), frame(page, "avalanche")
    for _ in range(200):
        if frame(page, "avalanche") > begun + 10:
            break
        page.wait_for_timeout(50)
    assert frame(page, "avalanche") > begun + 10
    assert page.evaluate(pixels) != first
    assert figure.locator("img").is_hidden()
    # The style of the viewer stays in its shadow root.
    assert page.evaluate("getComputedStyle(document.body).fontFamily") != page.evaluate(
        f"getComputedStyle({PLAYER.format('avalanche')}.place).fontFamily"
    )


def test_one_recording_is_open_at_a_time_and_closes_with_the_focus_on_its_button(opened):
    page, _ = opened
    for name in ("avalanche", "vibration"):
        page.locator(f"figure[data-recording={name}] button.play").click()
        page.locator(f"figure[data-recording={name}] canvas").wait_for(state="visible")
    assert page.locator("canvas").count() == 1
    assert page.locator("figure[data-recording=avalanche] img").is_visible()
    assert page.evaluate(f"{PLAYER.format('avalanche')}.playing") is False
    page.get_by_role("button", name="Close the recording").click()
    assert page.locator("canvas").count() == 0
    label = page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert label == "Play the recording of vibration"
    page.keyboard.press("Enter")
    page.locator("figure[data-recording=vibration] canvas").wait_for(state="visible")
    page.keyboard.press("Space")
    assert page.evaluate(f"{PLAYER.format('vibration')}.playing") is False


def test_the_viewer_has_the_colours_of_the_page(opened):
    page, _ = opened
    page.locator("figure[data-recording=vibration] button.play").click()
    page.locator("canvas").wait_for(state="visible")
    player = PLAYER.format("vibration")
    ground = f"getComputedStyle({player}.place).backgroundColor"
    light = page.evaluate(ground)
    page.evaluate("document.body.dataset.theme = 'dark'")
    page.wait_for_function(f"{player}.viewer.options.dark && {ground} !== '{light}'")
    page.evaluate("document.body.dataset.theme = 'auto'")
    page.wait_for_function(f"!{player}.viewer.options.dark && {ground} === '{light}'")
    page.emulate_media(color_scheme="dark")
    page.wait_for_function(f"{player}.viewer.options.dark")


def test_without_scripts_the_still_pictures_stay(built, browser):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((built / "index.html").as_uri())
    assert page.locator("figure.recording img").count() == 2
    assert page.locator("figure.recording img").first.is_visible()
    assert page.locator("button.play").first.is_hidden()
    context.close()


def test_a_recording_that_is_absent_is_reported_beside_the_picture(built, browser, tmp_path):
    copy = shutil.copytree(built, tmp_path / "copy")
    (copy / "_static/recordings/vibration.js").unlink()
    context = browser.new_context()
    page = context.new_page()
    page.goto((copy / "index.html").as_uri())
    page.locator("figure[data-recording=vibration] button.play").click()
    said = page.locator("figure[data-recording=vibration] [role=status]")
    said.get_by_text("could not be loaded").wait_for()
    assert page.locator("figure[data-recording=vibration] img").is_visible()
    context.close()


def test_links_and_other_pages_have_no_player(built):
    index, plain = ((built / f"{name}.html").read_text(encoding="utf-8") for name in ("index", "plain"))
    assert re.findall(r'data-recording="(\w+)"', index) == ["avalanche", "vibration"]
    assert re.search(r'<a [^>]*href="https://example.org"><img [^>]*class="still"', index)
    assert "recordings.js" in index
    assert "recordings.js" not in plain
