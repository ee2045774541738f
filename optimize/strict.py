"""Base of the settings: frozen, no unknown keys, and errors in the words of tisim.errors."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from tisim.errors import InputError


class Strict(BaseModel):
    """A pydantic model that raises InputError("X must be Y; received Z")."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise InputError("; ".join(_sentence(item) for item in error.errors())) from error


def _sentence(item: Any) -> str:
    if isinstance(item.get("ctx", {}).get("error"), InputError):
        return str(item["ctx"]["error"])
    name = ".".join(map(str, item["loc"])) or "settings"
    if item["type"] == "extra_forbidden":
        return f"{name} must be a known setting; received {item['input']!r}"
    rule = item["msg"].removeprefix("Input should be ").removeprefix("a ")
    return f"{name} must be {rule}; received {item['input']!r}"
