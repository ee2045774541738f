"""Each constant name has one value, everywhere."""

import ast
from collections import defaultdict
from pathlib import Path

from tests import rooms


def constants(tree):
    """The public upper-case names that a module defines, with the source text of their values."""
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        if isinstance(node, ast.AnnAssign) and node.value:
            targets = [node.target]
        for target in targets:
            names, values = [target], [node.value]
            if isinstance(target, ast.Tuple):
                names = target.elts
                whole = isinstance(node.value, ast.Tuple) and len(node.value.elts) == len(names)
                values = node.value.elts if whole else [ast.Subscript(node.value, ast.Constant(k))
                                                        for k in range(len(names))]  # fmt: skip
            for name, value in zip(names, values, strict=True):
                if isinstance(name, ast.Name) and name.id.isupper() and not name.id.startswith("_"):
                    yield name.id, ast.unparse(value)


FILES = rooms.modules(Path(__file__).parents[1])


def owner(module):
    """The case to which a module belongs; "" for modules shared by all."""
    package = ".".join(module.split(".")[:3])
    return package if f"{package}.scene" in FILES and package.startswith("tisim.cases.") else ""


def ambiguous(files):
    """The names with several values in the packages, or in one case and the packages together.

    Different cases may give one name different values: two of them may each have a DENSITY of their
    particles.
    """
    values = defaultdict(lambda: defaultdict(set))
    for module, text in files.items():
        for name, value in constants(ast.parse(text)):
            values[name][owner(module)].add(value)
    return {
        name
        for name, of_owner in values.items()
        if any(len(own | of_owner.get("", set())) > 1 for own in of_owner.values())
    }


def test_a_name_has_one_value():
    texts = {module: file.read_text(encoding="utf-8") for module, file in FILES.items()}
    assert ambiguous(texts) == set()


def test_a_second_value_is_found():
    assert ambiguous({"tisim.a": "MOST, LEAST = 3, 1", "tisim.optimize.b": "MOST: int = 4"}) == {"MOST"}
    assert ambiguous({"tisim.cases.blast.a": "FEW = 3", "tisim.cases.blast.b": "FEW = 4"}) == {"FEW"}
    assert ambiguous({"tisim.cases.blast.a": "FEW = 3", "tisim.b": "FEW = 4"}) == {"FEW"}
    assert ambiguous({"tisim.cases.blast.a": "FEW = 3", "tisim.cases.capture.a": "FEW = 4"}) == set()
