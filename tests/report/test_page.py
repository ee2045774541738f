"""The page holds hostile text as text, and its policy names its own script and style."""

import base64
import hashlib
import html
import json
import re

import pytest

from tisim.report.page import Page, Section, embedded, table

HOSTILE = "</script><script>alert(1)</script><!-- \"'&\u2028 ${facts} $facts"


@pytest.fixture
def page():
    """A page with hostile text everywhere."""
    return Page(
        title=HOSTILE, state="ok", verdict=HOSTILE, summary=HOSTILE, facts={HOSTILE: [HOSTILE, 1.5]},
        recording=b"\x00\xff", notices=[HOSTILE], footer=[HOSTILE],
        sections=[Section("one", HOSTILE, table(("a", HOSTILE), [(HOSTILE, "2")], HOSTILE, (1,)))],
    ).html()  # fmt: skip


def test_hostile_text_adds_no_elements(page):
    assert len(re.findall("<script", page)) == 3
    assert len(re.findall("</script", page)) == 3
    assert "alert(1)</script" not in page
    # Title, heading, verdict, summary, link, notice, title of the section, footer, two cells and a file name.
    assert page.count(html.escape(HOSTILE)) == 11


def test_data_come_back_as_they_were(page):
    text = re.search(r'id="facts">(.*?)</script>', page, re.S)[1]
    assert json.loads(text) == {HOSTILE: [HOSTILE, 1.5]}
    recording = re.search(r'id="recording">(.*?)</script>', page, re.S)[1]
    assert base64.b64decode(recording) == b"\x00\xff"


def test_the_policy_allows_the_script_and_the_style_of_the_page_alone(page):
    policy = html.unescape(re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1])
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert set(rules) == {"default-src", "script-src", "style-src", "img-src", "base-uri", "form-action"}
    for name, pattern in (("script", r"<script>(.*?)</script>"), ("style", r"<style>(.*?)</style>")):
        (text,) = re.findall(pattern, page, re.S)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert rules[f"{name}-src"] == f"'sha256-{digest}'"
    assert not re.search(r"(src|href)=\"?(https?:)?//", page)


def test_numbers_that_json_lacks_are_refused():
    with pytest.raises(ValueError, match="not JSON compliant"):
        embedded({"a": float("nan")})
