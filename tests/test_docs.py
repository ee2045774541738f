"""What the documents say can be done, can."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.mark.long
def test_the_readme_script_runs(capsys):
    """The scene in the README, as it stands there."""
    (script,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    exec(compile(script, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "ok=True" in printed
    assert "grains, mean radius" in printed


PAGES = ["README.md", *sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES)
def test_what_documents_point_to_is_there(page):
    text = (ROOT / page).read_text()
    links = re.findall(r"\]\(([^)#:]+)\)", text)
    files = re.findall(r"`((?:tisim|tests|cases|optimize|docs)/[\w/]+\.\w+)`", text)
    for name in (*links, *files):
        assert (ROOT / name).exists() or (ROOT / page).parent.joinpath(name).exists(), name
    assert not re.search(r"@[A-Z]+@", text)
