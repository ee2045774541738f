"""The scripts, links and citation in the documents are valid."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

from tisim import optimize
from tisim.describe.docstrings import PUBLICATIONS
from tisim.version import __version__

ROOT = Path(__file__).parents[1]


PAGES = [
    "README.md",
    "CONTRIBUTING.md",
    *(str(page.relative_to(ROOT)) for page in sorted((ROOT / "docs").rglob("*.md"))),
]
SCRIPTS = {
    page: re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(), re.M | re.S)
    for page in PAGES
    if "guides" not in page and page != "docs/tutorial.md"
}
"""The Python code of each page; test_contracts.py has files, test_guides.py guides and the tutorial."""
FOUND = {"docs/inverse_design.md": "out/throw"}
"""Folders of a search that the scripts of a page read."""
PRINTED = {"README.md": ["ok=True", "grains, mean radius"], "docs/accuracy.md": ["control="]}
"""Parts of their output."""


def drop(design):
    return (design["height"] - 1.5) ** 2


@pytest.mark.long
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=() if page == "README.md" else pytest.mark.slow)
        for page, scripts in SCRIPTS.items()
        if scripts
    ],
)
def test_the_scripts_of_a_page_run_as_printed(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    if page in FOUND:
        problem = optimize.Problem.of_function(drop, [optimize.Gene("height", "m", 1.0, 2.0)], name="throw")
        optimize.run(problem, out=FOUND[page], method="random", generations=0)
    for script in SCRIPTS[page]:
        exec(compile(script, page, "exec"), names)
    printed = capsys.readouterr().out
    assert all(text in printed for text in PRINTED.get(page, ()))


@pytest.mark.parametrize("page", PAGES)
def test_links_in_documents_exist(page):
    text = (ROOT / page).read_text()
    links = re.findall(r"\]\(([^)#:]+)\)", text)
    files = re.findall(r"`((?:tisim|tests|cases|optimize|docs)/[\w/]+\.\w+)`", text)
    for name in (*links, *files):
        assert (ROOT / name).exists() or (ROOT / page).parent.joinpath(name).exists(), name
    assert not re.search(r"@[A-Z]+@", text)


def test_the_picture_of_the_architecture_is_made_by_its_script_and_names_rooms_that_exist():
    script = runpy.run_path(str(ROOT / "docs/architecture_diagram.py"))
    assert script["picture"]() == (ROOT / "docs/architecture.svg").read_text(encoding="utf-8")
    for title, folder, _ in (*script["WAY"], *script["ROOMS"], *script["ABOVE"]):
        assert "/" not in folder or (ROOT / folder).is_dir(), title


def test_the_citation_is_of_this_version_and_names_all_publications():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", text, re.M) == [__version__]
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert re.findall(r"^license: (.+)$", text, re.M) == re.findall(r'^license = "(.+)"$', project, re.M)
    assert re.findall(r'^version = "(.+)"$', project, re.M) == [__version__]
    names, years = (re.findall(rf"^ +(?:- )?{key}: (.+)$", text, re.M) for key in ("family-names", "year"))
    for name, year, work in zip(names, years, PUBLICATIONS.values(), strict=True):
        assert name in work
        assert f"({year})" in work


def test_the_page_on_citing_has_this_version_and_all_publications():
    page = (ROOT / "docs/citing.md").read_text(encoding="utf-8")
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", page).replace("*", "")
    assert f"version = {{{__version__}}}" in page
    assert [work for work in PUBLICATIONS.values() if work not in plain] == []
