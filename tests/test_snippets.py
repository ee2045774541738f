"""The scenes and plots on the pages of laws: docs/snippets.py and docs/pair_plots.py."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.constants import G

from tests.extremes import for_packings
from tisim.describe import reference

DOCS = Path(__file__).parents[1] / "docs"
FAMILIES = ("effects", "sources", "operators", "contact_parts", "steppers", "step_controls")
PARTS = [
    entry.name
    for entry in reference.entries()
    if entry.family in FAMILIES
    and entry.kind.__module__.startswith("tisim.")
    # Two bodies make no packing; docs/packings.md has its scenes.
    and not for_packings(entry.kind)
]
QUICK = ("stokes_drag", "induced_moment")


@pytest.fixture(autouse=True)
def path(monkeypatch):
    """The modules of docs, which are no package."""
    monkeypatch.syspath_prepend(str(DOCS))


@pytest.mark.long
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in PARTS]
)
def test_the_scene_on_the_page_of_a_part_runs_and_uses_it(name, capsys):
    names = {}
    exec(compile(importlib.import_module("snippets").snippet(name), name, "exec"), names)
    assert names["result"].status.ok
    assert re.search(rf"\b{name}\b", str(names["scene"].to_dict()))
    assert capsys.readouterr().out


def test_every_part_has_a_scene():
    assert set(importlib.import_module("snippets").EFFECTS) == set(PARTS)


def test_no_line_of_a_scene_is_too_long():
    snippets = importlib.import_module("snippets")
    assert max(len(line) for name in PARTS for line in snippets.snippet(name).splitlines()) <= snippets.WIDTH


@pytest.mark.long
def test_a_plot_shows_the_force_of_the_law(tmp_path):
    plots = importlib.import_module("pair_plots")
    distance, force = plots.force("self_gravity")
    mass = plots.DENSITY * 4 / 3 * np.pi * plots.RADIUS**3
    np.testing.assert_allclose(force, G * mass**2 / distance**2, rtol=1e-5)


def test_the_plots_in_the_repository_are_up_to_date():
    """Otherwise run ``python docs/pair_plots.py`` and look at them."""
    assert importlib.import_module("pair_plots").outdated() == []


def test_plots_that_are_there_are_not_drawn_again(tmp_path, monkeypatch):
    plots = importlib.import_module("pair_plots")
    drawn = []
    monkeypatch.setattr(plots, "force", lambda name: (drawn.append(name), (np.arange(3.0), np.ones(3)))[1])
    plots.write(tmp_path)
    plots.write(tmp_path)
    assert sorted(drawn) == sorted(plots.RANGES)
    assert "<svg" in (tmp_path / "hertz.svg").read_text(encoding="utf-8")
    monkeypatch.setitem(plots.RANGES, "hertz", (0.9, 1.0))
    plots.write(tmp_path)
    assert drawn[-1] == "hertz"
    assert len(drawn) == len(plots.RANGES) + 1
