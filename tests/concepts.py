"""Count the names that the author of each kind of part must know.

    python tests/concepts.py    the table of docs/architecture.md

The examples are those of docs/contracts. Three counts are made of an example: the class variables that it
sets, the methods that it defines, and the other names of tisim that it uses, which are imports and attributes
of the state and the like. Parameters of its own do not count. The last count is of all names in the tables of
the contract.
"""

import ast
import re
from pathlib import Path

CONTRACTS = Path(__file__).parents[1] / "docs/contracts"
PARTS = ("pair_force", "contact_part", "source", "operator", "stepper", "case")
GIVEN = ("s", "context", "pair")
"""Arguments of methods, whose attributes are names of tisim."""
HEAD = ("part", "class variables", "methods", "other names", "together", "all names of the contract")


def page(part: str) -> str:
    return (CONTRACTS / f"{part}.md").read_text(encoding="utf-8")


def example(part: str) -> tuple[str, str]:
    """Name of the file and code of the example of a contract."""
    ((name, code),) = re.findall(r'^```python title="(\w+)\.py"\n(.*?)^```$', page(part), re.M | re.S)
    return name, code


def rows(part: str) -> list[dict[str, str]]:
    """The rows of all tables of a contract, by the heads of the columns."""
    found: list[dict[str, str]] = []
    for table in re.findall(r"(?:^\|.*\n)+", page(part), re.M):
        head, _, *lines = ([cell.strip() for cell in line.split(" | ")] for line in table.splitlines())
        keys = [cell.strip("| ") for cell in head]
        found += [dict(zip(keys, (cell.strip("| ") for cell in line), strict=True)) for line in lines]
    return found


def names(row: dict[str, str]) -> list[str]:
    """The names that a row describes, methods with their arguments."""
    cell = next(row[key] for key in ("method", "name", "item") if key in row)
    return re.findall(r"`(.+?)`", cell)


def used(part: str) -> tuple[set[str], set[str], set[str]]:
    """Class variables, methods and other names of tisim in the example of a contract."""
    tree = ast.parse(example(part)[1])
    variables, methods, others = set[str](), set[str](), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("tisim"):
            others |= {alias.name for alias in node.names}
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in GIVEN:
            others.add(f"{node.value.id}.{node.attr}")
        elif isinstance(node, ast.ClassDef):
            methods |= {one.name for one in node.body if isinstance(one, ast.FunctionDef)}
            variables |= {name.id for one in node.body if isinstance(one, ast.Assign) for name in one.targets}
            variables |= {
                one.target.id for one in node.body if isinstance(one, ast.AnnAssign) and not own(one)
            }
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Case":
            functions = {one.name for one in tree.body if isinstance(one, ast.FunctionDef)}
            given = {keyword.arg for keyword in node.keywords}
            methods |= given & functions
            variables |= given - functions
    return variables, methods, others


def own(declaration: ast.AnnAssign) -> bool:
    """Whether a class variable is a parameter of the part itself."""
    call = declaration.value
    return isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "parameter"


def table() -> str:
    """The table of docs/architecture.md."""
    lines = [HEAD, ("---",) * len(HEAD)]
    for part in PARTS:
        counts = [len(kind) for kind in used(part)]
        every = {name.partition("(")[0] for row in rows(part) for name in names(row)}
        words = part.replace("_", " ")
        lines.append((f"[{words}](contracts/{part}.md)", *map(str, (*counts, sum(counts), len(every)))))
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    print(table(), end="")
