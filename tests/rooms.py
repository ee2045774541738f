"""The dependency graph of the rooms: imports between rooms, and the longest chain of modules.

    python tests/rooms.py [FOLDER]      rooms, their order, and figures of the source
    python tests/rooms.py --run         files and changes of room of one ``tisim.run``, and of one design

A room is a package or a module of tisim: the longest name in ``ROOMS`` with which the name of a module
begins. A module imports from its own room and from earlier ones. This holds for imports within functions too.
Imports for type checkers alone are counted separately, because the program does not make them: two classes
that hold each other may name each other's types.
"""

import ast
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

ROOMS = (
    "tisim.version", "tisim.errors", "tisim.interrupt", "tisim.compiling", "tisim.streams", "tisim.console",
    "tisim.data_frames", "tisim.files", "tisim.notebook",
    "tisim.backend",
    "tisim.numerics", "tisim.components", "tisim.materials", "tisim.geometry", "tisim.shapes",
    "tisim.domains",
    "tisim.state", "tisim.program", "tisim.packing",
    "tisim.effects.base", "tisim.operators.base", "tisim.pairs", "tisim.forces", "tisim.collisions",
    "tisim.self_consistent", "tisim.population", "tisim.sources",
    "tisim.effects", "tisim.operators", "tisim.steppers", "tisim.scene",
    "tisim.engine", "tisim.describe", "tisim.testing", "tisim.io", "tisim.analysis",
    "tisim.rendering", "tisim.plotting", "tisim", "tisim.accuracy", "tisim.reading",
    "tisim.report", "tisim.watch",
    "tisim.optimize.problem", "tisim.optimize.storage", "tisim.optimize.evaluation",
    "tisim.optimize.methods.individual", "tisim.optimize.surrogate", "tisim.optimize.methods",
    "tisim.optimize.fitness_record", "tisim.optimize.hall_of_fame",
    "tisim.optimize.generation_log", "tisim.optimize.tables", "tisim.optimize.designs_csv",
    "tisim.optimize.experiments", "tisim.optimize.beginning", "tisim.optimize.settings",
    "tisim.optimize.outcome", "tisim.optimize.search_records", "tisim.optimize.search_folder",
    "tisim.optimize.search_file",
    "tisim.optimize.warm_start", "tisim.optimize.campaign_file", "tisim.optimize.ask_tell",
    "tisim.optimize.conclusion", "tisim.optimize.search", "tisim.optimize.analysis",
    "tisim.optimize.report", "tisim.optimize.session", "tisim.optimize",
    "tisim.cases", "tisim.cases.case", "tisim.cases.common", "tisim.cases.capture", "tisim.cases.coalescence",
    "tisim.cases.*", "tisim.cli",
    "tisim.__main__",
)  # fmt: skip
"""In order. ``tisim.cases.*`` is every other case: each is a room of its own beside the others."""
Imports = dict[str, set[str]]


def modules(folder: Path) -> dict[str, Path]:
    """All modules of tisim by name; optimize and cases are folders beside it."""
    names: dict[str, Path] = {}
    for package in ("tisim", "optimize", "cases"):
        for file in (folder / package).rglob("*.py"):
            name = ".".join(file.relative_to(folder).with_suffix("").parts).removesuffix(".__init__")
            names[name if package == "tisim" else f"tisim.{name}"] = file
    return names


def room(module: str) -> int:
    """The index in ``ROOMS`` of the room of a module."""
    homes = [name for name in ROOMS if module == name or module.startswith(f"{name}.")]
    home = max(homes, key=len)
    return ROOMS.index("tisim.cases.*" if home == "tisim.cases" != module else home)


def imports(folder: Path) -> tuple[Imports, Imports, Imports]:
    """The imports of each module from the others: at import, when its functions are called, and for type
    checkers alone."""
    module_files = modules(folder)
    kinds: dict[str, Imports] = {
        kind: {name: set() for name in module_files} for kind in ("early", "late", "typed")
    }
    for name, file in module_files.items():
        for node, kind in _statements(ast.parse(file.read_text(encoding="utf-8")), "early"):
            kinds[kind][name] |= {one for one in _named(node, module_files) if one != name}
    return kinds["early"], kinds["late"], kinds["typed"]


def _statements(node: ast.AST, kind: str) -> Iterator[tuple[ast.AST, str]]:
    """The imports below a node, each with its kind."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child, kind
        of_child = kind
        if isinstance(child, ast.If) and getattr(child.test, "id", "") == "TYPE_CHECKING":
            of_child = "typed"
        elif isinstance(child, ast.FunctionDef | ast.Lambda) and kind == "early":
            of_child = "late"
        yield from _statements(child, of_child)


def _named(node: ast.AST, module_files: dict[str, Path]) -> Iterator[str]:
    if isinstance(node, ast.ImportFrom) and node.module:
        for alias in node.names:
            whole = f"{node.module}.{alias.name}"
            yield from [name for name in (whole, node.module) if name in module_files][:1]
    elif isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in module_files)


def floors(early: Imports) -> list[str]:
    """The longest chain of imports, from the top down; raises ValueError for a circular import."""
    chains: dict[str, list[str]] = {}

    def chain(name: str, above: tuple[str, ...]) -> list[str]:
        if name in above:
            raise ValueError(f"circle: {' > '.join((*above[above.index(name) :], name))}")
        if name not in chains:
            below = [chain(other, (*above, name)) for other in sorted(early[name])]
            chains[name] = [name, *max(below, key=len, default=[])]
        return chains[name]

    return max((chain(name, ()) for name in sorted(early)), key=len)


def circles(*graphs: Imports) -> list[set[str]]:
    """The circles of imports in all graphs together: groups of modules each of which reaches all others."""
    names = sorted(graphs[0])
    pairs = {(name, other) for graph in graphs for name in names for other in graph[name]}
    rows, columns = np.array([[names.index(name) for name in pair] for pair in pairs], int).reshape(-1, 2).T
    links = csr_array((np.ones(len(pairs)), (rows, columns)), shape=(len(names), len(names)))
    _, group = connected_components(links, connection="strong")
    return [{names[i] for i in np.flatnonzero(group == k)} for k in np.flatnonzero(np.bincount(group) > 1)]


def above(graph: Imports) -> set[tuple[str, str]]:
    """(module, imported module) for imports from a later room."""
    pairs = {(module, other) for module, others in graph.items() for other in others}
    return {(module, other) for module, other in pairs if room(other) > room(module)}


def figures(folder: Path) -> Iterator[str]:
    """Files and lines of the three folders and of the tests, and the fraction of lines that are imports."""
    for name in ("tisim", "optimize", "cases", "tests"):
        texts = [file.read_text(encoding="utf-8") for file in (folder / name).rglob("*.py")]
        lines = sum(text.count("\n") for text in texts)
        spans = [
            node.end_lineno - node.lineno + 1
            for text in texts
            for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.Import | ast.ImportFrom) and node.end_lineno
        ]
        short = sum(0 < text.count("\n") < 60 for text in texts)
        yield (
            f"{name}: {len(texts)} files, {lines} lines, {lines / len(texts):.0f} a file, "
            f"{100 * sum(spans) / lines:.1f} % imports, {short} files of 1 to 59 lines"
        )


class Passage:
    """The Python code through which a call passes, in all threads: the files, and the number of changes of
    room. The calling thread waits while the thread of kernels works."""

    def __init__(self, folder: Path) -> None:
        self.rooms = {str(file): room(name) for name, file in modules(folder).items()}
        self.files: set[str] = set()
        self.changes, self.at = 0, -1

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        here = self.rooms.get(frame.f_code.co_filename)
        if event == "call" and here is not None:
            self.files.add(frame.f_code.co_filename)
            self.changes += here != self.at
            self.at = here

    def __str__(self) -> str:
        crossed = len({self.rooms[name] for name in self.files})
        return f"{len(self.files)} files in {crossed} rooms, {self.changes} changes of room"


def passages(folder: Path) -> Iterator[str]:
    """The passages of a run of agglomeration and of a search of one design, each called twice; the second
    call compiles nothing."""
    passage = Passage(folder)
    # Before tisim starts its thread.
    threading.setprofile(lambda *call: passage(*call))
    import tisim
    from tisim import optimize
    from tisim.cases.case import every

    tisim.init("cpu", threads=1)
    case = every()["agglomeration"]
    problem, _ = case.inverse("small", None)
    for name, call in (
        ("tisim.run", lambda: tisim.run(case.scene("small", 1))),
        ("a search of one design", lambda: optimize.run(problem, max_evaluations=20, generations=0)),
    ):
        for which in ("first", "second"):
            passage = Passage(folder)
            sys.setprofile(passage)
            call()
            sys.setprofile(None)
            yield f"{name}, {which} call: {passage}"


def main() -> None:
    """Print modules of each room, the longest chain, circles and figures; or the passages."""
    folder = Path(__file__).parents[1]
    if "--run" in sys.argv:
        sys.path.insert(0, str(folder))
        print(*passages(folder), sep="\n")
        return
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else folder
    early, late, typed = imports(folder)
    for k, name in enumerate(ROOMS):
        inside = [module for module in early if room(module) == k]
        below = sorted({ROOMS[room(o)] for m in inside for o in early[m]} - {name}, key=ROOMS.index)
        print(f"{name:26s} {len(inside):3d} modules, on {', '.join(below) or 'nothing'}")
    longest = floors(early)
    print(f"longest chain of imports: {len(longest)} modules: {' > '.join(longest)}")
    for kind, graph in (("at import", early), ("in functions", late), ("for type checkers", typed)):
        names = "; ".join(f"{module} > {other}" for module, other in sorted(above(graph)))
        print(f"imports from above, {kind}: {len(above(graph))} {names}".rstrip())
    for kind, graphs in (("of the program", (early, late)), ("with types", (early, late, typed))):
        found = circles(*graphs)
        print(f"circles of imports, {kind}: {len(found)}")
        for circle in found:
            print(f"    {len(circle)} modules: {', '.join(sorted(circle))}")
    print(f"rooms: {len(ROOMS)}")
    print(*figures(folder), sep="\n")


if __name__ == "__main__":
    main()
