"""Damage done by one kind of mishap: the number of trials that went wrong, by type."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass
class Counts:
    """The outcome of many trials of one kind.

    trials : number of trials. lost : acknowledged records or frames that are missing. doubled : records that
    occur twice. wrong : answers that differ from an undisturbed process, without an error. hung : trials that
    had to be ended from outside. tracebacks : errors without a user message, including crashes of the
    process.
    """

    name: str
    trials: int = 0
    lost: int = 0
    doubled: int = 0
    wrong: int = 0
    hung: int = 0
    tracebacks: int = 0

    @classmethod
    def headings(cls) -> list[str]:
        """Names of the columns."""
        return [field.name for field in fields(cls)]

    def cells(self) -> list[str]:
        """A row of the table."""
        return [str(getattr(self, name)) for name in self.headings()]

    @property
    def clean(self) -> bool:
        """Whether there were trials and none went wrong."""
        failures = (self.lost, self.doubled, self.wrong, self.hung, self.tracebacks)
        return self.trials > 0 and not any(failures)
