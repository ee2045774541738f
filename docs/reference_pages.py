"""Makes the pages of docs/reference from the code: one for each part, for each family of them, and one of the
public names.

    python docs/reference_pages.py    writes docs/parts.md anew, the list of all parts with a line each

Docstrings are plain text: paragraphs, indented blocks such as equations, and names in double backticks.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterable, Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

from pair_plots import RANGES
from snippets import snippet

from tisim.components.component import Checked, Component
from tisim.describe import reference
from tisim.describe.reference import Declaration, Entry

PACKAGES = ("tisim", "tisim.effects", "tisim.sources", "tisim.operators", "tisim.steppers", "tisim.packing",
            "tisim.shapes", "tisim.accuracy", "tisim.analysis", "tisim.report", "tisim.optimize")  # fmt: skip
"""Those with public names."""
NAMES = {entry.name for entry in reference.entries()}
"""Of all parts, as scene files have them."""


def write(folder: Path) -> None:
    """Write all pages; remove those of parts that are no more."""
    entries = reference.entries()
    pages = {folder / f"{one.family}/{one.name}.rst": _law(one) for one in entries}
    for name, family in reference.FAMILIES.items():
        members = [one for one in entries if one.family == name]
        pages[folder / f"{name}.rst"] = _family(name, family.title, family.base, members)
    pages[folder / "api.rst"] = _api({one.kind: one for one in entries})
    for path, lines in pages.items():
        _put(path, lines)
    for path in set(folder.rglob("*.rst")) - set(pages):
        path.unlink()


def parts() -> str:
    """Return the text of docs/parts.md."""
    lines = [
        "# All effects, sources, operators, steppers and what else a scene is made of",
        "",
        "`tisim effects` prints this list; `tisim effects NAME` the law of one, its source, its parameters",
        "with units, and a table to paste into a scene file.",
    ]
    entries = [one for one in reference.entries() if one.kind.__module__.startswith("tisim.")]
    for name, family in reference.FAMILIES.items():
        lines += ["", f"## {family.title}", "", "| name | description |", "|---|---|"]
        lines += [
            f"| `{one.name}` | {one.summary.replace('|', chr(92) + '|')} |"
            for one in entries
            if one.family == name
        ]
    return "\n".join(lines) + "\n"


def docstrings() -> Iterator[tuple[str, str]]:
    """Yield the names and texts of the docstrings of the reference."""
    yield from ((entry.name, entry.body) for entry in reference.entries())
    for package in PACKAGES:
        module = importlib.import_module(package)
        yield package, inspect.getdoc(module) or ""
        for name in getattr(module, "__all__", ()):
            value = getattr(module, name)
            members = vars(value).items() if inspect.isclass(value) else ()
            inner = {f"{name}.{key}": one for key, one in members if not key.startswith("_")}
            for path, one in {name: value, **inner}.items():
                if inspect.isroutine(one) or inspect.isclass(one) or isinstance(one, property):
                    yield f"{package}.{path}", inspect.getdoc(one) or ""


def _put(path: Path, lines: Iterable[str]) -> None:
    """Write a page, but not one that is there: Sphinx reads anew what is newer."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = "\n".join(lines) + "\n"
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def rst(text: str) -> list[str]:
    """Plain text as lines of reStructuredText: indented paragraphs as they are, all else without markup."""
    lines: list[str] = []
    for paragraph in text.strip("\n").split("\n\n"):
        if paragraph.startswith("    "):
            lines += [".. code-block:: text", "", *paragraph.splitlines(), ""]
        else:
            lines += [*_items(paragraph), ""]
    return lines


def _items(paragraph: str) -> Iterator[str]:
    """Lines of a paragraph; a list with an item for each name if it describes names (``name : text``)."""
    if not re.search(r"^[\w, ]+ : ", paragraph, re.M):
        yield from map(plain, paragraph.splitlines())
        return
    # A line goes on with the one before, but for names and new sentences; names may also follow a stop.
    lines = re.sub(r"\n\s*(?![A-Z]|[\w, ]+ : )", " ", paragraph)
    lines = re.sub(r"(?<=\.) (?=[a-z_]\w*(?:, [a-z_]\w*)* : )", "\n", lines)
    for line in lines.splitlines():
        is_item = re.match(r"[\w, ]+ : ", line.strip())
        yield from ("", f"{'- ' if is_item else ''}{plain(line.strip())}")


def plain(line: str) -> str:
    """A line of plain text, without markup: what looks like it is escaped. Names of parts in double backticks
    are links."""
    parts = re.split(r"``(.*?)``", line)
    names = (f":ref:`{name}`" if name in NAMES else f"``{name}``" for name in parts[1::2])
    texts = (re.sub(r"([\\*|`_])", r"\\\1", text) for text in parts[::2])
    text = "".join(part for pair in zip_longest(texts, names, fillvalue="") for part in pair)
    # An initial, such as that of an author, would begin a list.
    return re.sub(r"^(\s*)([A-Za-z][.)] )", r"\1\\\2", text)


def as_rst(_app: Any, _what: str, _name: str, value: Any, _options: Any, lines: list[str]) -> None:
    """For autodoc: a docstring as plain text, in place; of a part of a scene, its settings too."""
    lines[:] = rst("\n".join(lines))
    if isinstance(value, type) and issubclass(value, Component):
        lines += _settings(reference.settings(value))


def signature(
    _app: Any, _what: str, _name: str, value: Any, _options: Any, given: str | None, returned: str | None
) -> tuple[str, str | None] | None:
    """For autodoc: how plain data that is checked is made; and arguments of kernels by their names alone."""
    if isinstance(value, type) and issubclass(value, Checked):
        return _call(reference.settings(value)), None
    template = r": <[\w.]+ object at \w+>"
    return (re.sub(template, "", given), returned) if given and re.search(template, given) else None


def _call(settings: tuple[Declaration, ...]) -> str:
    """The arguments that make a part: what must be given, then what has a default."""
    required = [one.name for one in settings if not one.default]
    return f"({', '.join([*required, *(f'{one.name}={one.default}' for one in settings if one.default)])})"


def _heading(text: str, line: str) -> list[str]:
    return [text, line * len(text), ""]


def _family(name: str, title: str, base: type, entries: list[Entry]) -> Iterator[str]:
    yield from _heading(title, "=")
    rows = [(f":ref:`{one.name}`", plain(one.summary), plain(one.source)) for one in entries]
    yield from _grid(("name", "description", "source"), rows)
    yield from (".. toctree::", "   :hidden:", "", *(f"   {name}/{one.name}" for one in entries), "")
    if _home(base) is None:
        yield from _heading("The contract", "-")
        yield from (f".. autoclass:: {base.__module__}.{base.__name__}", "   :members:", "")


def _home(kind: type) -> str | None:
    """The package that users import a class from; None where none has it."""
    for package in reversed(PACKAGES):
        if getattr(importlib.import_module(package), kind.__name__, None) is kind:
            return package
    return None


def _grid(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> Iterator[str]:
    yield from (".. list-table::", "   :header-rows: 1", "")
    for row in (head, *rows):
        yield from (f"   {'*' if k == 0 else ' '} - {cell}" for k, cell in enumerate(row))
    yield ""


def _law(entry: Entry) -> Iterator[str]:
    """The page of a part."""
    name, module, public = entry.kind.__name__, entry.kind.__module__, _home(entry.kind)
    yield from (f".. _{entry.name}:", "")
    yield from _heading(entry.name, "=")
    yield from (
        f".. py:class:: {public}.{name}{_call(entry.settings)}",
        f"   :canonical: {module}.{name}",
        "",
    )
    text = (*rst(f"{entry.summary}."), *rst(entry.body), *_plot(entry), *_facts(entry))
    tables = (*_settings(entry.settings), *_toml(entry), *_snippet(entry))
    yield from (f"   {line}".rstrip() for line in (*text, *tables))


def _plot(entry: Entry) -> Iterator[str]:
    """The force against the distance (pair_plots.py)."""
    if entry.name in RANGES:
        yield from (
            f".. image:: /pair_forces/{entry.name}.svg",
            f"   :alt: {entry.name}: force against distance",
            "",
        )


def _snippet(entry: Entry) -> Iterator[str]:
    """A scene with the part, in Python."""
    if lines := snippet(entry.name).splitlines():
        yield from ("A scene with it:", "", ".. code-block:: python", "")
        yield from (*(f"   {line}" for line in lines), "")


def _facts(entry: Entry) -> Iterator[str]:
    fields = ", ".join(f"{name} ({unit})" if unit else name for name, unit in entry.fields)
    facts = {
        "Source": entry.source, "Needs": "; ".join(entry.needs), "Particle fields": fields,
        "Counts and measures": ", ".join(entry.gives),
    }  # fmt: skip
    for label, text in facts.items():
        if text:
            yield from (f"{label}: {plain(text)}.", "")
    for work in entry.publications():
        yield from (plain(work), "")


def _settings(settings: tuple[Declaration, ...]) -> Iterator[str]:
    if settings:
        rows = [
            (f"``{one.name}``", *map(plain, (one.unit, one.default or "(required)", one.rule, one.text)))
            for one in settings
        ]
        yield from _grid(("parameter", "unit", "default", "must be", "description"), rows)


def _toml(entry: Entry) -> Iterator[str]:
    if entry.toml:
        yield from (
            ".. code-block:: toml",
            "",
            *(f"   {line}".rstrip() for line in entry.toml.splitlines()),
            "",
        )


def _api(parts: dict[type, Entry]) -> Iterator[str]:
    """Every public name: a part links to its page, anything else stands here."""
    yield from _heading("Public names", "=")
    ids: set[int] = set()
    for package in PACKAGES:
        module = importlib.import_module(package)
        yield from _heading(package, "-")
        yield from (*rst(inspect.getdoc(module) or ""), f".. py:module:: {package}", "")
        links = []
        for name in sorted(getattr(module, "__all__", ())):
            value = getattr(module, name)
            if value in parts if isinstance(value, type) else False:
                links.append(f":ref:`{name} <{parts[value].name}>`")
            elif not inspect.ismodule(value) and id(value) not in ids:
                ids.add(id(value))
                yield from _autodoc(package, name, value)
        if links:
            yield from (f"Parts: {', '.join(links)}.", "")


def _autodoc(package: str, name: str, value: Any) -> Iterator[str]:
    if inspect.isclass(value):
        yield from (f".. autoclass:: {package}.{name}", "   :members:", "")
    elif callable(value):
        yield from (f".. autofunction:: {package}.{name}", "")


if __name__ == "__main__":
    (Path(__file__).parent / "parts.md").write_text(parts(), encoding="utf-8")
