"""Cases know the search, the search knows the simulator, and neither is known to what it stands on."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMANDS = ("typer", "tisim.cli.main", "tisim.cli.search", "tisim.cli.options", "tisim.cli.scene_arguments")
ABOVE = {"tisim": ("optimize", "cases"), "optimize": ("cases", *COMMANDS), "cases": COMMANDS}


def imported(file):
    """Modules that a file imports when it is imported itself, not later within a function."""
    waiting = list(ast.parse(file.read_text(encoding="utf-8")).body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)
            yield from (f"{node.module}.{name.name}" for name in node.names)
        elif not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            waiting += ast.iter_child_nodes(node)


@pytest.mark.parametrize("package", ABOVE)
def test_nothing_is_imported_from_above(package):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    for file in files:
        for name in imported(file):
            above = [other for other in ABOVE[package] if name == other or name.startswith(f"{other}.")]
            assert not above, f"{file.relative_to(ROOT)} imports {name}"
