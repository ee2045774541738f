"""The prose avoids turns of phrase over which readers stumble."""

from pathlib import Path

import pytest

from tests import english

ROOT = Path(__file__).parents[1]
MOST = {"what": 0.2, "where": 0.5, "so many": 0.1, "that of": 0.3}
"""In 1,000 words. HOOMD's docstrings have 0.1, 1.6, 0.0 and 0.2."""


def rates(files):
    words, turns = english.counted(files)
    return {name: 1000 * turns[name] / words for name in MOST}


def test_docstrings_and_comments():
    files = [file for name in ("tisim", "optimize", "cases") for file in english.readable(ROOT / name)]
    assert {name: rate for name, rate in rates(files).items() if rate > MOST[name]} == {}


def test_pages():
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    assert {name: rate for name, rate in rates(pages).items() if rate > 3 * MOST[name]} == {}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("It returns what is left.", "what"),
        ("Forces are zero where charges are.", "where"),
        ("So many steps are taken.", "so many"),
        ("The mass is that of a grain.", "that of"),
    ],
)
def test_a_turn_is_found_in_docstrings_comments_and_pages(tmp_path, text, found):
    python, page = tmp_path / "a.py", tmp_path / "a.md"
    python.write_text(f'"""One."""\n\nA = 1\n"""{text}"""\n# {text}\n\n\ndef f():\n    """{text}"""\n')
    page.write_text(f"# A page\n\n{text} And `{text}` in code.\n\n    {text}\n\nWhat is it? It is plain.\n")
    assert dict(english.counted([python])[1])[found] == 3
    assert {name: number for name, number in english.counted([page])[1].items() if number} == {found: 1}
