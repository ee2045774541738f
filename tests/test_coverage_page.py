"""The page of the coverage of publications is made from its data, and names only things that exist."""

import importlib
import re
from dataclasses import replace
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture(scope="module")
def modules():
    """Modules of docs, which do not belong to a package, by the end of their names."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        names = ("page", "rows", "faults")
        yield {name: importlib.import_module(f"coverage_{name}") for name in names}


@pytest.fixture(scope="module")
def works(modules):
    return modules["rows"].publications()


@pytest.fixture(scope="module")
def faults(modules):
    """The faults of publications, as a list."""
    return lambda works: list(modules["faults"].faults(works))


def test_every_row_names_things_that_exist_and_gives_its_reason(faults, works):
    assert faults(works) == []


@pytest.mark.parametrize("page", ["coverage.md", "coverage_tests.md"])
def test_the_page_is_made_from_its_data(modules, page):
    """If it fails, run: python docs/coverage_page.py."""
    assert (DOCS / page).read_text(encoding="utf-8") == modules["page"].PAGES[page]()


def test_the_counts_add_up(works):
    text = (DOCS / "coverage.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (?:\[\w+\]\([^)]*\)|all) \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|$", text, re.M)
    counts = [[int(cell) for cell in row] for row in rows]
    assert len(counts) == len(works) + 1
    assert all(sum(row[:3]) == row[3] for row in counts)
    assert [sum(column) for column in zip(*counts[:-1], strict=True)] == counts[-1]
    assert [row[3] for row in counts[:-1]] == [len(work.rows) for work in works]
    tables = text.partition("\n## ")[2]
    cells = re.findall(r"^\|[^|\n]+\|[^|\n]+\| (works|in part|left out) \|", tables, re.M)
    assert [cells.count(one) for one in ("works", "in part", "left out")] == counts[-1][:3]
    others = [row for work in works for row in work.rows if not row.laboratory]
    whole = sum(row.status == "works" for row in others)
    assert f"Of the other {len(others)} rows, {whole} work." in " ".join(text.split())


def test_every_publication_of_the_package_is_covered(works):
    from tisim.describe.docstrings import PUBLICATIONS

    assert {work.name for work in works} == set(PUBLICATIONS)


def test_no_source_is_listed_twice(works):
    for work in works:
        sources = [row.source for row in work.rows]
        assert len(set(sources)) == len(sources), work.name


FAULTS = [
    ({"status": "perhaps"}, "status must be one of works, part, out; received 'perhaps'"),
    ({"status": "part", "reason": ""}, "has no reason"),
    ({"tests": (), "checks": ()}, "has no test or check"),
    ({"page": "", "parts": (), "code": ()}, "has no place"),
    ({"page": "", "here": ("1",)}, "has numbers, but no page on which they stand"),
    ({"title": "A title."}, "the title ends with a full stop"),
    ({"page": "nowhere.md"}, "there is no page nowhere.md"),
    ({"page": "blast.md#nowhere"}, "there is no section blast.md#nowhere"),
    ({"here": ("0.12345678",)}, "'0.12345678' is not on vibration.md"),
    ({"parts": ("warp",)}, "there is no part warp"),
    ({"code": ("tisim/warp.py",)}, "there is no tisim/warp.py"),
    ({"tests": ("test_docs.py::test_warp",)}, "there is no test test_docs.py::test_warp"),
    ({"tests": ("test_docs.py::drop",)}, "there is no test test_docs.py::drop"),
    ({"checks": ({"case": "blast", "check": "warp"},)}, "there is no check 'warp' of blast"),
    ({"command": "tisim warp"}, "tisim warp: "),
    ({"command": "tisim check warp"}, "tisim check warp: there is no such case"),
    ({"command": "tisim check blast --warp"}, "tisim check blast --warp: "),
    ({"command": "tisim run blast --size warp"}, "blast has no size warp"),
    ({"command": "tisim optimize blast --variant warp"}, "there is no variant warp"),
    ({"command": "tisim run blast --frames many"}, "tisim run blast --frames many: "),
    ({"command": "tisim figures agglomeration"}, "agglomeration has no figures"),
    ({"command": "python tests/benchmarks/warp.py"}, "there is no "),
    ({"command": "python tests/benchmarks/mrf_cost.py --warp"}, "mrf_cost.py has no --warp"),
    ({"command": "python -m tisim.cases.warp"}, "there is no "),
    ({"command": "rm -r out"}, "must begin with tisim or python"),
]


@pytest.mark.parametrize(("change", "fault"), FAULTS)
def test_a_row_with_a_fault_is_found(faults, works, change, fault):
    z13 = next(work for work in works if work.name == "Z13")
    sound = next(row for row in z13.rows if row.source == "Fig. 3")
    assert faults([replace(z13, rows=(sound,))]) == []
    (found, *_) = faults([replace(z13, rows=(replace(sound, **change),))])
    assert found.startswith("Z13 Fig. 3: ")
    assert fault in found


def test_a_failed_check_is_found(modules, faults, works, monkeypatch):
    row = next(one for one in works[1].rows if one.checks)
    lines = {
        (one["case"], one["check"]): {"verdict": "FAIL", "measured": "1", "half_interval": ""}
        for one in row.checks
    }
    monkeypatch.setattr(modules["rows"], "measured", lambda: lines)
    assert any("fails" in one for one in faults([replace(works[1], rows=(row,))]))


def test_numbers_have_their_intervals(modules):
    number = modules["rows"].number
    assert number({"measured": "0.784", "half_interval": "0.0216"}) == "0.784 ± 0.022"
    assert number({"measured": "46126.34", "half_interval": ""}) == "46126"
    assert number({"measured": "3.3307e-16", "half_interval": ""}) == "3.3e-16"


def test_anchors_are_made_as_sphinx_makes_them(modules):
    assert modules["rows"].slug("A step beside L21's") == "a-step-beside-l21s"
    assert modules["rows"].slug("`tisim check` and 3.4 others") == "tisim-check-and-34-others"
