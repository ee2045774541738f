"""A browser with WebGL2 for tests of pages."""

import shutil
from pathlib import Path

import pytest

SWITCHES = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL2 without a graphics card."""


def executable(driver):
    """The browser of the system, or the one that Playwright has installed; None if there is neither."""
    found = shutil.which("chromium") or shutil.which("google-chrome")
    own = driver.chromium.executable_path
    return found or (own if Path(own).exists() else None)


@pytest.fixture(scope="session")
def browser():
    """A browser with WebGL2; the test is skipped if there is none."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="needs pip install playwright (the extra browser)"
    )
    with playwright.sync_playwright() as driver:
        path = executable(driver)
        if path is None:
            pytest.skip("no chromium: install one, or run python -m playwright install chromium")
        chromium = driver.chromium.launch(executable_path=path, args=SWITCHES)
        yield chromium
        chromium.close()
