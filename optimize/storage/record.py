"""A record is one finished evaluation; the cache finds it by a key."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

REASON_LENGTH = 500
"""Largest number of characters of a reason. A column has one length: a stack trace would widen all rows."""


def canonical(value: Any) -> bytes:
    """Return ASCII JSON with sorted keys: equal values, equal bytes. NumPy scalars become Python numbers."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), default=lambda scalar: scalar.item())
    return text.encode("ascii")


def evaluation_key(
    scene_digest: str, settings: Mapping[str, Any], problem: str, version: int, code: str = ""
) -> str:
    """Return the SHA-256 (hex) of all that decides a fitness.

    That is the scene's digest (physics, parameters, seed), the evaluator's settings (precision, device kind)
    and the objective (the problem's name, version and code).
    """
    objective = [problem, version, *([code] if code else [])]
    return hashlib.sha256(canonical([scene_digest, dict(settings), *objective])).hexdigest()


@dataclass(frozen=True)
class Record:
    """A record is the evaluation of one design from one random start.

    key : see evaluation_key; problem : its name.
    fitness : the first objective, NaN if the evaluation failed; others : the other ones, where there are
    several. ok, reason : how it ended.
    seed : of the start; design : gene -> value in its unit, or a text or flag; work : counts of the run.
    wall_s : seconds it took; created : seconds since 1970 (UTC).
    """

    key: str
    problem: str
    fitness: float
    ok: bool
    reason: str
    seed: int
    design: Mapping[str, float]
    work: Mapping[str, Any]
    wall_s: float
    created: float
    others: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        plain = self.reason.encode("ascii", "backslashreplace").decode().replace("\0", " ")
        object.__setattr__(self, "reason", plain[:REASON_LENGTH])
        object.__setattr__(self, "design", dict(self.design))
        object.__setattr__(self, "work", dict(self.work))
        object.__setattr__(self, "others", tuple(self.others))

    @property
    def values(self) -> tuple[float, ...]:
        """Return the values of all objectives, as they are (not with the sign of a cost)."""
        return (self.fitness, *self.others)

    def payload(self) -> bytes:
        """Return the record as canonical JSON; NaN is written as null, which every JSON reader knows."""
        fields = dict(vars(self))
        fields["fitness"] = self.fitness if math.isfinite(self.fitness) else None
        if not fields.pop("others"):
            return canonical(fields)  # as it was before there could be others: old checksums stay true
        return canonical(fields | {"others": [v if math.isfinite(v) else None for v in self.others]})

    @classmethod
    def parse(cls, payload: bytes) -> Record:
        """Return the record that ``payload`` has written. ValueError if it is none."""
        _Form.model_validate_json(payload)
        fields = json.loads(payload)
        if fields["fitness"] is None:
            fields["fitness"] = math.nan
        others = fields.pop("others", ())
        return cls(**fields, others=tuple(math.nan if value is None else value for value in others))


class _Form(BaseModel):
    """The form holds a record as its payload has it."""

    model_config = ConfigDict(strict=True, extra="forbid")
    key: str
    problem: str
    fitness: float | None
    ok: bool
    reason: str
    seed: Annotated[int, Field(ge=-(2**63), lt=2**63)]
    design: dict[str, bool | int | float | str]
    work: dict[str, Any]
    wall_s: float
    created: float
    others: list[float | None] = []
