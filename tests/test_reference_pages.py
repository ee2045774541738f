"""Pages of the reference from the code; Sphinx itself is run by .ci/run."""

import importlib
import re
from pathlib import Path

import pytest

from tisim.describe import reference

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture(scope="module")
def maker():
    """docs/reference_pages.py, which does not belong to a package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        yield importlib.import_module("reference_pages")


@pytest.fixture(scope="module")
def pages(maker, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages") / "reference"
    maker.write(folder)
    return {
        str(page.relative_to(folder).with_suffix("")): page.read_text(encoding="utf-8")
        for page in folder.rglob("*.rst")
    }


def test_there_is_a_page_for_each_part_each_family_and_one_of_names(pages):
    parts = {f"{entry.family}/{entry.name}" for entry in reference.entries()}
    assert set(pages) == {*parts, *reference.FAMILIES, "api"}
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^reference/(\w+)$", index, re.M)) == set(pages) - parts
    listed = {
        name for family in reference.FAMILIES for name in re.findall(r"^   (\w+/\w+)$", pages[family], re.M)
    }
    assert listed == parts


def test_pages_of_removed_parts_are_deleted(maker, tmp_path):
    (tmp_path / "effects").mkdir()
    (tmp_path / "effects" / "gone.rst").write_text("gone")
    maker.write(tmp_path)
    assert not (tmp_path / "effects" / "gone.rst").exists()


def test_every_guide_and_case_is_in_the_index():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^(?!reference/)([\w/]+)$", index, re.M))
    pages = {str(page.relative_to(DOCS).with_suffix("")) for page in DOCS.rglob("*.md")}
    assert pages - {"index"} == listed


def test_a_page_describes_its_whole_part(pages):
    for entry in reference.entries():
        page = pages[f"{entry.family}/{entry.name}"]
        assert page.startswith(f".. _{entry.name}:\n\n{entry.name}\n===")
        assert f".{entry.kind.__name__}" in page
        for one in entry.settings:
            assert f"``{one.name}``" in page


def test_all_public_names_are_listed(pages):
    assert ".. autofunction:: tisim.init" in pages["api"]
    assert ".. autoclass:: tisim.effects.PairForce" in pages["api"]
    assert ":ref:`Impact <impact>`" in pages["api"]
    assert "autoclass:: tisim.effects.Impact\n" not in pages["api"]


def test_no_page_has_a_name_that_sphinx_gives_its_own_pages():
    assert not {page.stem for page in DOCS.glob("*.md")} & {"search", "genindex", "modindex", "py-modindex"}


def test_no_line_of_a_page_is_a_comment():
    for page in DOCS.rglob("*.md"):
        assert not re.search(r"^\s*% ", page.read_text(encoding="utf-8"), re.M), page


@pytest.mark.parametrize("line", ["C. D. Willett, Langmuir", "e. of that", "M) of three"])
def test_initials_at_the_beginning_of_a_line_begin_no_list(maker, line):
    assert maker.plain(line) == f"\\{line}"
    assert maker.plain(f"  {line}") == f"  \\{line}"


def test_docstrings_are_plain_text(maker):
    law = "A force |F| on i_ by ``impact``, ``j`` and *.\n\n    F = |a_b|\n\n"
    text = f"{law}name : one,\n    and more. third : 3,\n3.\nlow, high : two.\nMore."
    assert maker.rst(text) == [
        *(r"A force \|F\| on i\_ by :ref:`impact`, ``j`` and \*.", ""),
        *(".. code-block:: text", "", "    F = |a_b|", ""),
        *("", "- name : one, and more.", "", "- third : 3, 3.", "", "- low, high : two.", "", "More.", ""),
    ]


def test_the_documented_list_of_parts_matches_the_code(maker):
    """If it fails, run: python docs/reference_pages.py."""
    assert (DOCS / "parts.md").read_text(encoding="utf-8") == maker.parts()
