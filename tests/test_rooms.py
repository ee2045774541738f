"""The order of the rooms holds: no room imports from a later one."""

import ast
from collections import Counter
from pathlib import Path

import pytest

from tests import rooms

EARLY, LATE, TYPED = rooms.imports(Path(__file__).parents[1])


def test_nothing_is_imported_from_a_later_room():
    assert rooms.above(EARLY) == set()
    assert rooms.above(LATE) == set()


TYPES_FROM_ABOVE = {
    ("tisim.engine.batches", "tisim.io.recording"),
    ("tisim.optimize.problem.feasibility", "tisim.optimize.evaluation.estimate"),
}
"""Types from a later room: ``tisim.run`` takes a Recording, and an estimate is judged by the problem."""
CIRCLES_OF_TYPES = ({"tisim.engine.simulation", "tisim.engine.observer"},)
"""Modules whose classes hold each other: a simulation calls its observers, which read the simulation."""


def test_types_from_later_rooms_and_in_circles_are_known():
    assert rooms.above(TYPED) <= TYPES_FROM_ABOVE
    for circle in rooms.circles(EARLY, LATE, TYPED):
        assert any(circle <= known for known in CIRCLES_OF_TYPES), circle


def test_every_room_exists():
    assert {rooms.room(module) for module in EARLY} == set(range(len(rooms.ROOMS)))


def test_no_imports_go_in_circles():
    """Neither those of modules nor those of functions."""
    assert rooms.floors(EARLY)
    assert rooms.circles(EARLY, LATE) == []


CASES = {name for name in EARLY if name.startswith("tisim.cases.") and f"{name}.scene" in EARLY}


def test_modules_of_a_case_do_not_import_its_package():
    """A package's CASE names the modules below it; these import from each other."""
    assert CASES
    homes = {module: module.rpartition(".")[0] for module in EARLY}
    assert not [m for m, home in homes.items() if home in CASES and home in EARLY[m] | LATE[m]]


SEQUELS = {
    "tisim.cases.cascade": "tisim.cases.capture",
    "tisim.cases.packed_filter": "tisim.cases.packing",
    "tisim.cases.spin_up": "tisim.cases.coalescence",
}
"""Cases that continue another case, and say so in the docstrings of their scenes."""


def test_a_case_imports_only_the_case_that_it_continues():
    """Code that several cases need is in ``cases/common``."""
    imports = {
        (home, other)
        for module in EARLY
        for home in CASES & {module, module.rpartition(".")[0]}
        for reached in EARLY[module] | LATE[module]
        for other in CASES & {reached, reached.rpartition(".")[0]} - {home}
    }
    assert imports == set(SEQUELS.items())


def test_listing_cases_loads_no_figures_checks_or_inverse_problems():
    reached, ahead = set(), set(CASES)
    while ahead:
        reached |= ahead
        ahead = set().union(*(EARLY[module] for module in ahead)) - reached
    assert "tisim.cases.case" in reached
    inside = [module for module in reached if module.startswith("tisim.cases.")]
    assert not [module for module in inside if module.endswith((".figures", ".checks", ".problem"))]


def test_the_folders_beside_tisim_are_imported_as_parts_of_it():
    """Under two names a module would be loaded twice, and its classes would differ."""
    root = Path(__file__).parents[1]
    files = [
        file
        for folder in ("tisim", "optimize", "cases", "tests", "docs")
        for file in (root / folder).rglob("*.py")
    ]
    found = set()
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            found |= {file for name in names if name.partition(".")[0] in ("optimize", "cases")}
    assert len(files) > 1000
    assert found == set()


def test_a_circle_is_found():
    with pytest.raises(ValueError, match=r"circle: a > b > a"):
        rooms.floors({"a": {"b"}, "b": {"a"}})
    graph = {"a": {"b"}, "b": {"c"}, "c": set(), "d": {"a"}}
    assert rooms.circles(graph) == []
    assert rooms.circles(graph, {"a": set(), "b": set(), "c": {"a"}, "d": set()}) == [{"a", "b", "c"}]


def test_imports_are_told_apart(tmp_path):
    """Those of modules, of functions and for type checkers."""
    (tmp_path / "tisim").mkdir()
    for name in ("early", "late", "typed"):
        (tmp_path / f"tisim/{name}.py").touch()
    (tmp_path / "tisim/user.py").write_text(
        "from tisim import early\n"
        "if TYPE_CHECKING:\n    from tisim import typed\n"
        "class User:\n    def method(self):\n        from tisim import late\n"
    )
    graphs = rooms.imports(tmp_path)
    assert [graph["tisim.user"] for graph in graphs] == [{"tisim.early"}, {"tisim.late"}, {"tisim.typed"}]


def test_class_names_are_unique():
    names: Counter[str] = Counter()
    for file in rooms.modules(Path(__file__).parents[1]).values():
        nodes = ast.parse(file.read_text(encoding="utf-8")).body
        names.update(node.name for node in nodes if isinstance(node, ast.ClassDef))
    twice = [name for name, number in names.items() if number > 1]
    assert twice == [], "classes of one name: no two in the three packages may have one"
