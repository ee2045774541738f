"""A record is one finished evaluation; the cache finds it by a key."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from tisim.errors import must

REASON_LENGTH = 500
"""Largest number of characters of a reason. All cells of a column have one length, so a stack trace would
widen all rows."""

Gene = float | int | str | bool
"""The value of a gene in a design."""
_PLAIN = frozenset((float, int, str, bool))


def canonical(value: Any) -> bytes:
    """Return ASCII JSON with sorted keys: equal values give equal bytes. NumPy scalars become Python
    numbers."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), default=lambda scalar: scalar.item())
    return text.encode("ascii")


def plain(value: Any) -> Any:
    """Return a NumPy scalar as a Python number, and anything else unchanged."""
    return value if type(value) in _PLAIN else getattr(value, "item", lambda: value)()


def evaluation_key(
    scene_digest: str, settings: Mapping[str, Any], problem: str, version: int, code: str = ""
) -> str:
    """Return the SHA-256 (hex) of everything that determines a fitness.

    It covers the scene's digest (physics, parameters, seed), the evaluator's settings (precision, device
    kind) and the objective (the problem's name, version and code).
    """
    objective = [problem, version, *([code] if code else [])]
    return hashlib.sha256(canonical([scene_digest, dict(settings), *objective])).hexdigest()


@dataclass(frozen=True)
class Record:
    """The evaluation of one design from one random start.

    key : see evaluation_key; problem : its name.
    values : name -> value, in order: each objective, and other quantities of the run if the problem stores
        some. NaN, or missing, if the evaluation failed.
    ok, reason : whether it succeeded; if not, why.
    seed : of the start; start : its number in the search that made it, from 0.
    design : gene -> value in its unit, in order; work : counts of the run.
    wall_s : duration, s; created : time, s since 1970 (UTC).
    Raises InputError for a gene that no column can hold: an integer beyond 64 bits, a text with a NUL.
    """

    key: str
    problem: str
    values: Mapping[str, float]
    ok: bool
    reason: str
    seed: int
    design: Mapping[str, Gene]
    work: Mapping[str, Any]
    wall_s: float
    created: float
    start: int

    def __post_init__(self) -> None:
        text = self.reason.encode("ascii", "backslashreplace").decode().replace("\0", " ")
        object.__setattr__(self, "reason", text[:REASON_LENGTH])
        object.__setattr__(self, "values", {name: float(value) for name, value in self.values.items()})
        object.__setattr__(self, "design", {name: plain(value) for name, value in self.design.items()})
        object.__setattr__(self, "work", dict(self.work))
        for name, value in self.design.items():
            if isinstance(value, str):
                must("\0" not in value, "gene", "a text without a NUL", f"{name}: {value}")
            elif isinstance(value, int):
                must(-(2**63) <= value < 2**63, "gene", "an integer of 64 bits", f"{name}: {value}")

    def payload(self) -> bytes:
        """Return the record as ASCII JSON, its fields in order; NaN becomes null, which every JSON reader
        accepts."""
        fields = {**vars(self), "values": {name: _number(value) for name, value in self.values.items()}}
        return json.dumps(fields, separators=(",", ":"), default=plain).encode("ascii")

    @classmethod
    def parse(cls, payload: bytes) -> Record:
        """Return the record in a ``payload``. ValueError if it is invalid."""
        fields = dict(vars(_Form.model_validate_json(payload)))
        values = {name: math.nan if v is None else float(v) for name, v in fields.pop("values").items()}
        return cls(**fields, values=values)


def _number(value: float) -> float | str | None:
    """Return a value in a form that JSON supports."""
    if math.isfinite(value):
        return value
    return None if math.isnan(value) else str(value)


Integer64 = Annotated[int, Field(ge=-(2**63), lt=2**63)]


class _Form(BaseModel):
    """Validates the payload of a record."""

    model_config = ConfigDict(strict=True, extra="forbid")
    key: str
    problem: str
    values: dict[str, float | Literal["inf", "-inf"] | None]
    ok: bool
    reason: str
    seed: Integer64
    design: dict[str, bool | Integer64 | float | str]
    work: dict[str, Any]
    wall_s: float
    created: float
    start: Integer64
