"""What a kind of mishap has cost: nothing, or how many of its trials went wrong and how."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass
class Counts:
    """The outcome of many trials of one kind.

    trials : their number. lost : records or frames that had been acknowledged and are gone. doubled : records
    that are there twice. wrong : answers that differ from those of an undisturbed process, without an error.
    hung : trials that had to be ended from outside. tracebacks : errors that are not messages for people,
    crashes of the process among them.
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
        """Whether something was tried and nothing went wrong."""
        failures = (self.lost, self.doubled, self.wrong, self.hung, self.tracebacks)
        return self.trials > 0 and not any(failures)
