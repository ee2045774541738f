"""Tables of a scene file with all settings of a part and their texts, ready to be pasted and edited."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic.fields import FieldInfo

from tisim.components import serialization
from tisim.components.component import Component
from tisim.components.invalid import text_of, unit_of
from tisim.effects.base import Effect


def toml(kind: type[Component], place: str, named: bool) -> str:
    """Return the table ``[place]`` of a part, and nested tables. named : whether the table has a ``kind``."""
    return "\n".join(_lines(kind, place, named))


def fields(kind: type[Component]) -> dict[str, FieldInfo]:
    """Return the settings in the table of a part; the name of an effect is the name of its table."""
    infos = dict(kind.model_fields)
    if issubclass(kind, Effect):
        del infos["name"]
    return infos


def _lines(kind: type[Component], place: str, named: bool, row: bool = False) -> Iterator[str]:
    """Yield the lines of a table of a scene file with all settings of a part, and of nested tables."""
    yield f"[[{place}]]" if row else f"[{place}]"
    if named:
        yield f'kind = "{kind.kind()}"'
    row_kinds, inner = dict(kind.lists()), []
    for name, info in fields(kind).items():
        value = example(info)
        if name in row_kinds and not (info.is_required() or any(info.examples or ())):
            yield f"# {text_of(info)}"
            yield f"# [[{place}.{name}]]"
        elif name in row_kinds:
            inner += ["", *_lines(row_kinds[name], f"{place}.{name}", named=False, row=True)]
        elif isinstance(value, Component):
            inner += ["", f"# {text_of(info)}", *_lines(type(value), f"{place}.{name}", named=True)]
        else:
            remark = "; ".join(filter(None, (unit_of(info), "an example" * info.is_required())))
            yield f"# {text_of(info)}{f' ({remark})' if remark else ''}"
            yield f"# {name} =" if value is None or value == {} else f"{name} = {serialization.inline(value)}"
    yield from inner


def example(info: FieldInfo) -> Any:
    """Return the default of a setting, or an example value if there is none."""
    default = None if info.is_required() else info.get_default(call_default_factory=True)
    if default is not None:
        return default
    annotation = info.annotation
    if isinstance(annotation, type) and issubclass(annotation, Component) and not info.examples:
        return annotation(**{name: example(one) for name, one in annotation.model_fields.items()})
    return info.examples[0] if info.examples else None
